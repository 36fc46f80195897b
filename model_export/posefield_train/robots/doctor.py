"""Faults of reference motions of a robot: limits, speeds, feet, seams, jumps, outliers."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from posefield.common.units import Booleans, Floats
from posefield.motion.contact_detection import ContactThresholds, detect_contacts
from posefield.robots.robot import HingeAngles, Robot, velocities
from posefield.robots.robot_motion import LIMIT_TOLERANCE, RobotMotion
from posefield_train.robots.cycle_search import Cycle

SUNK, FLOATING, SKATING, SLIDE = 0.002, 0.02, 0.05, 0.1
"""Depth of a sole below the floor, m, height of the lowest sole above it, m, and mean speed of a
standing foot, m/s, from which each is told; seconds over which a foot slides."""
CONTACTS = ContactThresholds(height=0.012, grown_height=0.02)
"""Thresholds of contacts: robots lift their feet by a few centimetres."""
LIFT_SHARE, LEAST_GROWN = 0.4, 0.004
"""Share of the height by which a foot is lifted, and least height, m, below which it may stand."""
JUMP, JUMP_RATIO = np.radians(5.0), 8.0
"""Change of an angle's step from one frame to the next that is told as a jump: so large, and so
many times its 90th percentile in the motion."""
SEAM_RATIO = 3.0
"""Step from the last frame to the first over the largest of the motion at which a seam is told."""
FALSE_ALARMS, LEAST_OUTLIER = 0.002, 6.0
"""Share of sound motions that may be told as outliers, which sets the residual of each folder from
which they are, and the least such residual, in standard deviations."""
FEWEST_COMPARED, COMPONENTS, CURVED, ROUNDS = 12, 10, 4, 5
"""Motions from which on they are compared; components at most, those with products, and rounds, of
the regression."""
LEAST_DEVIATION, LEAST_HEIGHT, LEAST_SPEED = np.radians(0.15), 2.5e-4, 1.25e-3
"""Deviations that are none: of angles, rad, heights of soles, m, and their speeds, m/s."""
RIDGE, STANCE = 3e-3, 0.4
"""Weight of the regression's ridge, and share of the frames in which a sole is the lowest, whose
heights and speeds are compared."""
RHYTHMS = np.arange(0.3, 4.0, 0.02)
"""Frequencies, a second, among which that of a motion's cycle is searched."""
HARMONICS, SHIFTS, MATCHES = np.array([1.0, 2.0]), 120, 4
"""Harmonics of it, phases at which motions are matched, and rounds of that."""


@dataclass(frozen=True)
class Finding:
    """One fault of a motion.

    kind: "limit", "sunk", "floating", "skating", "jump", "seam" or "outlier". where: joint or foot.
    frame: in which it is worst. value: in `unit`. frames: in which it is.
    """

    kind: str
    where: str
    frame: int
    value: float
    unit: str
    frames: int = 1

    @property
    def text(self) -> str:
        """Return the finding as a sentence without its end."""
        count = f", {self.frames} frames" if self.frames > 1 else ""
        size = f"{self.value:.3g} {self.unit}"
        return f"{self.where} {SENTENCES[self.kind]} {size} (frame {self.frame}{count})"


SENTENCES = {
    "limit": "is beyond its limit by",
    "sunk": "sinks below the floor by",
    "floating": "and all other soles are above the floor by",
    "skating": "slides while it stands, at",
    "jump": "jumps: its step changes by",
    "seam": "steps from the last frame to the first by",
    "outlier": "is unlike what the other motions lead to expect, by",
}


@dataclass(frozen=True)
class Diagnosis:
    """A motion's facts and faults.

    speeds, accelerations: largest of each hinge, rad/s and rad/s². contacts (F, K): which of the
    robot's feet stand; empty without a robot. heights (F, K): of their lowest points, m. slides
    (F, K): speeds over SLIDE seconds of feet that stand so long, m/s; nan elsewhere. cycle: of a
    motion that repeats.
    """

    motion: RobotMotion
    speeds: Annotated[Floats, "hinges"]
    accelerations: Annotated[Floats, "hinges"]
    findings: tuple[Finding, ...]
    contacts: Annotated[Booleans, "frames feet"]
    heights: Annotated[Floats, "frames feet"]
    slides: Annotated[Floats, "frames feet"]
    cycle: Cycle | None = None

    def facts(self) -> dict[str, Any]:
        """Return what the command prints, as plain values."""
        motion = self.motion
        fastest = int(np.argmax(self.speeds))
        return {
            "file": motion.source,
            "format": motion.format,
            "frames": len(motion),
            "rate": motion.rate,
            "seconds": round(motion.duration, 6),
            "joints": list(motion.hinges) or motion.angles.shape[1],
            "loops": motion.loops,
            "cycle": asdict(self.cycle) if self.cycle else None,
            "evidence": dict(motion.evidence),
            "largest_speed": {
                "joint": joint_name(motion, fastest),
                "rad_s": round(float(self.speeds[fastest]), 4),
            },
            "largest_acceleration_rad_s2": round(float(self.accelerations.max()), 2),
            "findings": [asdict(finding) for finding in self.findings],
        }


def joint_name(motion: RobotMotion, hinge: int) -> str:
    """Return the name of a hinge, or its number from 1 where the motion has no names."""
    return motion.hinges[hinge] if motion.hinges else f"joint {hinge + 1}"


def diagnose(motion: RobotMotion, robot: Robot | None) -> Diagnosis:
    """Return the facts and faults of a motion whose hinges are those of the robot, if given."""
    steps = np.diff(motion.angles, axis=0)
    speeds = np.abs(steps).max(axis=0) * motion.rate
    changes = np.zeros_like(motion.angles)
    changes[1:-1] = np.abs(np.diff(steps, axis=0))
    findings = [*_jumps(motion, changes), *_seam(motion, steps)]
    contacts, heights = np.empty((len(motion), 0), bool), np.empty((len(motion), 0))
    slides = heights
    if robot:
        excess = motion.beyond_limits(robot)
        limits = _of_hinges(motion, "limit", excess, excess > LIMIT_TOLERANCE)
        findings = [*limits, *findings]
        if robot.feet:
            contacts, heights, slides = _feet(motion, robot)
            findings += _faults_of_feet(robot, contacts, heights, slides)
    accelerations = changes.max(axis=0) * motion.rate**2
    return Diagnosis(motion, speeds, accelerations, tuple(findings), contacts, heights, slides)


def _jumps(motion: RobotMotion, changes: HingeAngles) -> list[Finding]:
    usual = np.percentile(changes[1:-1], 90.0, axis=0) if len(changes) > 22 else 0.0
    return _of_hinges(motion, "jump", changes, (changes > JUMP) & (changes > JUMP_RATIO * usual))


def _of_hinges(
    motion: RobotMotion, kind: str, sizes: HingeAngles, faulty: Annotated[Booleans, "frames hinges"]
) -> list[Finding]:
    """Return the largest size, rad, of each hinge that is faulty in a frame."""
    return [
        Finding(
            kind,
            joint_name(motion, hinge),
            int(np.argmax(sizes[:, hinge])),
            float(np.degrees(sizes[:, hinge].max())),
            "degrees",
            int(faulty[:, hinge].sum()),
        )
        for hinge in np.flatnonzero(faulty.any(axis=0)).tolist()
    ]


def _seam(motion: RobotMotion, steps: Annotated[Floats, "frames hinges"]) -> list[Finding]:
    """Return the worst step from the last frame to the first of a motion that repeats."""
    if not motion.loops:
        return []
    gaps = np.abs(motion.angles[0] - motion.angles[-1])
    usual = np.maximum(np.abs(steps).max(axis=0), LIMIT_TOLERANCE)
    hinge = int(np.argmax(gaps / usual))
    if gaps[hinge] < SEAM_RATIO * usual[hinge]:
        return []
    name, degrees = joint_name(motion, hinge), float(np.degrees(gaps[hinge]))
    return [Finding("seam", name, len(motion) - 1, degrees, "degrees")]


def _feet(motion: RobotMotion, robot: Robot) -> tuple[Booleans, Floats, Floats]:
    """Return contacts, heights, m, and speeds of standing feet, m/s, each (F, K).

    A foot stands where it is low and slow. It slides by the slowest of its points, so that one that
    rolls does not.
    """
    soles = robot.foot_points(*motion.body_poses(robot))
    heights = np.stack([points[..., 2].min(axis=1) for points in soles], axis=1)
    contacts, slides = np.zeros(heights.shape, bool), np.full(heights.shape, np.nan)
    # Between frames that lie apart: in one step, noise of a tenth of a degree looks like sliding.
    frames = max(2, round(SLIDE * motion.rate))
    for foot, points in enumerate(soles):
        middle = points.mean(axis=1)
        path = np.stack([middle[:, 0], heights[:, foot], middle[:, 1]], axis=-1)
        # A foot that is lifted little and slowly swings below the usual thresholds.
        lift = float(np.ptp(np.percentile(heights[:, foot], (2.0, 98.0))))
        grown = np.clip(LIFT_SHARE * lift, LEAST_GROWN, CONTACTS.grown_height)
        height = CONTACTS.height * grown / CONTACTS.grown_height
        thresholds = replace(CONTACTS, height=height, grown_height=grown)
        contacts[:, foot] = detect_contacts(path, motion.rate, cyclic=False, thresholds=thresholds)
        for frame in range(len(points) - frames):
            if contacts[frame : frame + frames + 1, foot].all():
                step = points[frame + frames, :, :2] - points[frame, :, :2]
                speed = np.linalg.norm(step, axis=-1).min() * motion.rate / frames
                slides[frame + frames // 2, foot] = speed
    return contacts, heights, slides


def _faults_of_feet(
    robot: Robot, contacts: Booleans, heights: Floats, slides: Floats
) -> list[Finding]:
    findings = []
    names = [robot.bodies[foot.body] for foot in robot.feet]
    for name, low, stands, slide in zip(names, heights.T, contacts.T, slides.T, strict=True):
        if low.min() < -SUNK:
            frame, count = int(np.argmin(low)), int((low < -SUNK).sum())
            findings.append(Finding("sunk", name, frame, -100 * float(low.min()), "cm", count))
        sliding = slide[np.isfinite(slide)]
        if len(sliding) and sliding.mean() > SKATING:
            frame, count = int(np.nanargmax(slide)), int(stands.sum())
            speed = 100 * float(sliding.mean())
            findings.append(Finding("skating", name, frame, speed, "cm/s", count))
    above = np.where(contacts.any(axis=1), heights.min(axis=1), 0.0)
    if above.max() > FLOATING:
        frame, count = int(np.argmax(above)), int((above > FLOATING).sum())
        name = names[int(np.argmin(heights[frame]))]
        findings.append(Finding("floating", name, frame, 100 * float(above[frame]), "cm", count))
    return findings


def expect_same_robot(motion: RobotMotion, first: RobotMotion) -> None:
    """Raise MotionFileError for a motion of other joints than the first of the same call."""
    counts = motion.angles.shape[1], first.angles.shape[1]
    names = set(motion.hinges) ^ set(first.hinges) if motion.hinges and first.hinges else set()
    if counts[0] != counts[1] or names:
        difference = f", without {min(names)!r} in both" if names else ""
        raise motion.error(
            f"found {counts[0]} joints{difference}, expected the {counts[1]} of {first.source}: "
            "files of one robot"
        )


def outliers(motions: Sequence[RobotMotion], robot: Robot | None = None) -> dict[int, Finding]:
    """Return a finding for each motion that breaks what the others have in common, by its index.

    How far each joint turns, how fast and when in the cycle is predicted from the other joints of
    the same motion, by a regression over all motions in which odd ones count little; so are, with a
    robot, heights and speeds of its low soles. Residuals of motions left out are told in standard
    deviations. The tail of a folder's residuals sets the one from which a motion is an outlier.
    Fewer than a dozen motions, or other joints, are not compared.
    """
    if len(motions) < FEWEST_COMPARED:
        return {}
    features = _features(motions)
    hinges = features.shape[1]
    names = [joint_name(motions[0], hinge) for hinge in range(hinges)]
    if robot and robot.feet:
        soles = np.array([_sole_features(motion, robot) for motion in motions])
        features = np.concatenate([features, soles], axis=1)
        names += [robot.bodies[foot.body] for foot in robot.feet]
    scores = np.stack([_residuals(features, group) for group in range(len(names))], axis=-1)
    findings: dict[int, Finding] = {}
    # A joint that is odd moves a sole, so that joints are named before feet.
    for first, last in ((0, hinges), (hinges, len(names))):
        largest = scores[:, first:last].max(axis=1, initial=0.0)
        for index in np.flatnonzero(largest > _bound(largest)).tolist():
            name = names[first + int(np.argmax(scores[index, first:last]))]
            value, unit = float(largest[index]), "standard deviations"
            findings.setdefault(index, Finding("outlier", name, 0, value, unit))
    return dict(sorted(findings.items()))


def _bound(scores: Annotated[Floats, "motions"]) -> float:
    """Return the score beyond which FALSE_ALARMS of sound motions lie, by an exponential tail.

    The tail passes through the median and the 90th percentile, so that a tenth may be broken.
    """
    middle, high = np.quantile(scores, (0.5, 0.9))
    return max(
        LEAST_OUTLIER, float(middle + (high - middle) * np.log(0.5 / FALSE_ALARMS) / np.log(5.0))
    )


def _sole_features(motion: RobotMotion, robot: Robot) -> Annotated[Floats, "feet features"]:
    """Return heights and speeds of each foot while it is low, scaled to compare with angles."""
    features = []
    for points in robot.foot_points(*motion.body_poses(robot)):
        heights = points[..., 2].min(axis=1)
        low = heights <= np.quantile(heights, STANCE)
        speeds = np.linalg.norm(velocities(points, motion.rate)[low, :, :2], axis=-1)
        slowest, mean = speeds.min(axis=1), speeds.mean(axis=1)
        quantiles = np.quantile(heights, (0.0, 0.5 * STANCE, STANCE, 1.0)) / LEAST_HEIGHT
        slides = [slowest.mean(), np.quantile(slowest, 0.9), *np.quantile(mean, (0.5, 0.8))]
        features.append([*quantiles, *(np.array(slides) / LEAST_SPEED)])
    return LEAST_DEVIATION * np.array(features)


def _features(motions: Sequence[RobotMotion]) -> Annotated[Floats, "motions hinges features"]:
    """Return what is compared of each angle: mean, spread, speeds, and harmonics of the cycle."""
    single = np.array([_paces(motion) for motion in motions])
    waves = _in_phase(np.array([_waves(motion) for motion in motions]))
    return np.concatenate([single, waves.real, waves.imag], axis=-1)


def _paces(motion: RobotMotion) -> Annotated[Floats, "hinges features"]:
    """Return the mean and spread of each angle, rad, and its speeds, tenths of a rad/s."""
    speeds = np.abs(velocities(motion.angles, motion.rate))
    pace = 0.1 * np.sqrt((speeds**2).mean(axis=0)), 0.1 * speeds.max(axis=0)
    return np.stack([motion.angles.mean(axis=0), motion.angles.std(axis=0), *pace], axis=-1)


def _waves(motion: RobotMotion) -> NDArray[np.complex128]:
    """Return the amplitudes (H, K), rad, of the harmonics of the strongest rhythm of all angles."""
    window = np.hanning(len(motion) + 2)[1:-1, None]
    angles = (motion.angles - motion.angles.mean(axis=0)) * window * (2.0 / window.sum())
    times = np.arange(len(motion)) / motion.rate
    powers = (np.abs(np.exp(-2j * np.pi * np.outer(RHYTHMS, times)) @ angles) ** 2).sum(axis=1)
    rhythms = HARMONICS * RHYTHMS[int(powers.argmax())]
    return np.asarray((np.exp(-2j * np.pi * np.outer(rhythms, times)) @ angles).T)


def _in_phase(waves: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the amplitudes (M, H, K) of motions that begin at one phase of the cycle.

    Each is shifted to where it matches the median of all best; one odd joint changes little.
    """
    phases = np.linspace(0.0, 2.0 * np.pi, SHIFTS, endpoint=False)
    shifts = np.exp(1j * np.outer(phases, HARMONICS))
    typical, shifted = waves[0], waves
    for _ in range(MATCHES):
        matches = np.real(np.einsum("mhk,pk,hk->mp", waves, shifts, typical.conj()))
        shifted = waves * shifts[matches.argmax(axis=1)][:, None]
        typical = np.median(shifted.real, axis=0) + 1j * np.median(shifted.imag, axis=0)
    return shifted


def _residuals(
    features: Annotated[Floats, "motions groups features"], group: int
) -> Annotated[Floats, "motions"]:
    """Return the largest residual of a group's features in each motion, in standard deviations."""
    count = len(features)
    others = np.delete(features, group, axis=1).reshape(count, -1)
    others -= np.median(others, axis=0)
    # An odd motion must not become a component of its own.
    limits = 3.0 * _deviations(others)
    others = np.clip(others, -limits, limits)
    left, _, _ = np.linalg.svd(others - others.mean(axis=0), full_matrices=False)
    components = left[:, : min(count // 6, COMPONENTS)] * np.sqrt(count)
    rows, columns = np.triu_indices(min(count // 12, CURVED))
    products = 0.5 * components[:, rows] * components[:, columns]
    terms = np.hstack([np.ones((count, 1)), components, products])
    values, weights = features[:, group], np.ones(count)
    for _ in range(ROUNDS):
        normal = terms.T @ (weights[:, None] * terms) + RIDGE * count * np.eye(terms.shape[1])
        solved = np.linalg.solve(normal, terms.T * weights)
        # Of a prediction from all other motions: an odd one does not pull the fit to itself.
        left_out = np.maximum(1.0 - np.einsum("mk,km->m", terms, solved), 0.05)
        residuals = (values - terms @ (solved @ values)) / left_out[:, None]
        scores = (np.abs(residuals) / _deviations(residuals)).max(axis=1)
        weights = 1.0 / np.maximum(1.0, 0.5 * scores) ** 2
    return np.asarray(scores)


def _deviations(values: Floats) -> Floats:
    """Return standard deviations that outliers do not change, at least that of rounding."""
    return 1.4826 * np.median(np.abs(values), axis=0) + LEAST_DEVIATION
