"""Proposals for the settings of a recipe that motion files do not state, with their evidence."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from posefield.common.units import Floats, UpAxis
from posefield.motion import quat, skeleton
from posefield.roles import joint_recognition
from posefield.roles.joint_recognition import RoleGuess
from posefield_train.source import frame_faults, motion_file, skeleton_checks
from posefield_train.source.clip_joints import UNITS
from posefield_train.source.motion_file import MotionFile
from posefield_train.source.skeleton_checks import ADULT_LEG, OTHER_UNIT

MAX_FRAMES = 200
"""Frames of a file that are measured, spread evenly."""
MOST_WHOLE, FEW = 50, 5
"""Files with the same joints of which all measured frames are kept, and frames of each further one:
ten thousand files would take gigabytes."""


@dataclass(frozen=True)
class Figure:
    """A file's figure.

    guesses: joints by role, with confidence. positions: of the joints (F, J, 3), in some of the
    frames. bones: length (J,) of the bone that leads to each joint. turns: rotations (F, 4) of the
    root. moves: whether position channels of each joint (J,) change. frames: number of the file's.
    """

    file: MotionFile
    guesses: dict[str, RoleGuess]
    positions: Floats
    bones: Floats
    turns: Floats
    moves: tuple[bool, ...]
    frames: int

    @property
    def names(self) -> list[str]:
        """Return the names of the joints."""
        return list(self.file.skeleton.names)

    @property
    def roles(self) -> dict[str, str]:
        """Return the joint of each role that seems right, however surely."""
        return {role: guess.joint for role, guess in self.guesses.items()}

    @property
    def sure_roles(self) -> dict[str, str]:
        """Return the joint of each role that needs no confirmation."""
        return joint_recognition.sure_roles(self.guesses)

    def role(self, role: str) -> Floats | None:
        """Return the positions (F, 3) of the joint with a role, or None."""
        name = self.roles.get(role)
        return None if name is None else self.positions[:, self.names.index(name)]

    def pair(self, role: str) -> tuple[Floats, Floats] | None:
        """Return the positions (F, 3) of the left and the right joint of a role, or None."""
        left, right = self.role("left" + role), self.role("right" + role)
        return None if left is None or right is None else (left, right)

    def leg_length(self) -> float | None:
        """Return the length of the bones from the hip to the foot, in the file's unit, or None."""
        return skeleton_checks.leg_length(self.file.skeleton, self.roles, self.bones)

    def without_frames(self) -> "Figure":
        """Return the figure with the first frame alone of its file, whose others take memory."""
        file = self.file
        first = replace(file, rotations=file.rotations[:1], translations=file.translations[:1])
        return replace(self, file=first)

    def with_few_frames(self) -> "Figure":
        """Return the figure with FEW of the frames that were measured."""
        few = np.unique(np.linspace(0, len(self.positions) - 1, FEW).round().astype(int))
        return replace(self, positions=self.positions[few], turns=self.turns[few])

    @property
    def size(self) -> float:
        """Return the largest extent of the joints along an axis, in the file's unit."""
        return float(np.median(np.ptp(self.positions, axis=1).max(axis=-1)))


def measure(file: MotionFile) -> Figure:
    """Return the measurements of a file."""
    rotations, translations, joints = file.rotations, file.translations, file.skeleton
    picked = np.linspace(0, len(file) - 1, min(len(file), MAX_FRAMES)).round()
    frames = np.unique(picked.astype(int))
    positions = skeleton.positions(joints.parents, rotations[frames], translations[frames])
    guesses = joint_recognition.recognise(joints.names, joints.parents)
    moves = np.ptp(translations, axis=0).max(axis=-1) > 0.0
    return Figure(
        file,
        joint_recognition.check_shape(guesses, joints.names, positions),
        positions,
        np.linalg.norm(np.median(translations, axis=0), axis=-1),
        rotations[frames, 0],
        tuple(moves.tolist()),
        len(file),
    )


def faults(measured: Figure) -> list[str]:
    """Return the faults of the frames of a figure's file, which has its frames and a rate."""
    file, joints = measured.file, list(measured.sure_roles.values())
    leg = measured.leg_length()
    if file.rate is None or not leg or not joints:
        return []
    columns = [measured.names.index(joint) for joint in joints]
    bones = file.skeleton
    positions = skeleton.positions(bones.parents, file.rotations, file.translations)[:, columns]
    rest = bones.at_rest(bones.offsets)[columns]
    frame_fault = frame_faults.find_faults(
        positions * ADULT_LEG / leg, file.rate, rest * ADULT_LEG / leg
    )
    return frame_faults.describe(frame_fault, joints, file.rate)


Confidence = Literal["certain", "high", "medium", "low", "none"]

LEG_FACTORS = (1.2, 1.35)
"""Usual length of an adult's leg from hip to ankle, m, and the largest factors between it and the
proposed length for a high and a medium confidence."""
ADULT_SIZE = 1.7
"""Usual largest extent of an adult, m."""
AXES = "xyz"


@dataclass(frozen=True)
class Proposal:
    """A proposed value, None if there is none, with its confidence and its evidence."""

    value: Any
    confidence: Confidence
    evidence: tuple[str, ...]


def propose_unit(figures: Sequence[Figure]) -> Proposal:
    """Return the length of the files' unit in metres: as they state, else from the legs."""
    measured = _measured_unit(figures)
    return _stated([figure.file.metres_per_unit for figure in figures], measured, " m") or measured


def _stated(values: Sequence[Any], measured: Proposal, unit: str = "") -> Proposal | None:
    """Return what all files state, with the measured evidence beside it; None if one states none.

    A measurement that contradicts it with a high confidence makes it doubtful.
    """
    if None in values:
        return None
    if len(set(values)) > 1:
        sentence = f"the files state different values: {', '.join(map(str, sorted(set(values))))}"
        return Proposal(None, "none", (sentence, *measured.evidence))
    doubtful = measured.confidence == "high" and measured.value != values[0]
    evidence = f"stated by the files: {values[0]}{unit}"
    if doubtful:
        evidence += f", which the motion contradicts: {measured.value}{unit} fits it"
    confidence: Confidence = "low" if doubtful else "certain"
    return Proposal(values[0], confidence, (evidence, *measured.evidence))


def _measured_unit(figures: Sequence[Figure]) -> Proposal:
    lengths = [leg for figure in figures if (leg := figure.leg_length())]
    # Of files in several units those of most.
    alike = [[leg for leg in lengths if one / OTHER_UNIT < leg <= one] for one in lengths]
    legs = max(alike, key=len, default=[])
    length = float(np.median(legs or [figure.size for figure in figures]))
    adult, what = (ADULT_LEG, "leg, hip to foot") if legs else (ADULT_SIZE, "largest extent")
    if length <= 0.0:
        return Proposal(None, "none", (f"{what}: no length",))
    deviations = {name: abs(np.log(length * metres / adult)) for name, metres in UNITS.items()}
    first, second, third = sorted(deviations, key=lambda name: deviations[name])[:3]
    factor = float(np.exp(deviations[first]))
    high, medium = LEG_FACTORS
    confidence: Confidence = "high" if factor < high else "medium" if factor < medium else "low"
    evidence = [
        f"{what}: {length:.4g} units, which is {length * UNITS[first]:.2f} m in {first}; of an "
        f"adult about {adult} m",
        f"the next units: {length * UNITS[second]:.3g} m in {second}, "
        f"{length * UNITS[third]:.3g} m in {third}",
    ]
    if len(legs) < len(lengths):
        evidence.append(f"{len(lengths) - len(legs)} of {len(lengths)} files are in another unit")
        confidence = "low"
    if not legs:
        evidence.append("no legs were recognised by their names")
        confidence = "low"
    return Proposal(UNITS[first], confidence, tuple(evidence))


def propose_up(figures: Sequence[Figure]) -> Proposal:
    """Return the up axis: as the files state, else from the motion."""
    measured = _measured_up(figures)
    return _stated([figure.file.up for figure in figures], measured) or measured


def _measured_up(figures: Sequence[Figure]) -> Proposal:
    moving = [_upward(figure, figure.positions) for figure in figures]
    at_rest = [
        _upward(figure, figure.file.skeleton.at_rest(figure.file.skeleton.offsets)[None])
        for figure in figures
    ]
    votes = [
        _main_axis([one for one in moving if one is not None], "from the feet to the head"),
        _floor_axis(figures),
        _main_axis(
            [one for one in at_rest if one is not None], "from the feet to the head at rest"
        ),
    ]
    known_votes = [(axis, sentence) for axis, sentence in votes if axis is not None]
    evidence = tuple(sentence for _, sentence in known_votes)
    if not known_votes:
        return Proposal(None, "none", ("neither a head nor feet were recognised",))
    first = known_votes[0][0]
    agreeing = sum(axis == first for axis, _ in known_votes)
    if first not in ("+y", "+z"):
        sentence = f"the up axis seems to be {first}; only +y and +z can be read"
        return Proposal(None, "none", (*evidence, sentence))
    confidence: Confidence = "high" if agreeing == len(known_votes) > 1 else "medium"
    return Proposal(first[1], "low" if agreeing * 2 < len(known_votes) else confidence, evidence)


Vote = tuple[str | None, str]


def _upward(figure: Figure, positions: Floats) -> Floats | None:
    """Return the mean direction (3,) from the feet to the head at positions (F, J, 3), or None."""
    if not {"head", "leftFoot", "rightFoot"} <= figure.roles.keys():
        return None
    head, left, right = (
        positions[:, figure.names.index(figure.roles[role])]
        for role in ("head", "leftFoot", "rightFoot")
    )
    return np.asarray(np.mean(head - 0.5 * (left + right), axis=0))


def _main_axis(directions: Sequence[Floats], what: str) -> Vote:
    if not directions:
        return None, ""
    lengths = np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-12)
    mean = np.mean(np.asarray(directions) / lengths, axis=0)
    axis = int(np.argmax(np.abs(mean)))
    name = ("+" if mean[axis] > 0 else "-") + AXES[axis]
    return name, f"{what}: {name}, {abs(mean[axis]):.0%} of the direction"


def _floor_axis(figures: Sequence[Figure]) -> Vote:
    """Return the axis along which the lowest joint stays most nearly at one height."""
    spreads = []
    for figure in figures:
        # A root that stays at the origin is no foot on the floor.
        moving = np.ptp(figure.positions, axis=0).any(axis=-1)
        body = figure.positions[:, moving] if moving.any() else figure.positions
        low, high = body.min(axis=1), body.max(axis=1)
        both = np.concatenate([low, high], axis=1)
        spreads.append(both.std(axis=0) / max(figure.size, 1e-12))
    spread = np.mean(spreads, axis=0)
    best = int(np.argmin(spread))
    name = ("+" if best < 3 else "-") + AXES[best % 3]
    second = np.delete(spread, best).min()
    sentence = (
        f"lowest joint along {name}: moves by {spread[best]:.1%} of the figure's size, along any "
    )
    return name, f"{sentence}other axis by {second:.1%} or more"


def propose_feet(figures: Sequence[Figure], up: UpAxis | None) -> Proposal:
    """Return the joints of the feet: the lowest of the joints that are named as feet or toes."""
    first = figures[0]
    roles = [role for role in ("Toes", "Foot") if first.pair(role)]
    if not roles:
        return Proposal([], "none", ("no joints are named as feet or toes",))
    feet = [first.roles[side + roles[0]] for side in ("left", "right")]
    evidence = [f"named as {'toes' if roles[0] == 'Toes' else 'feet'}: {', '.join(feet)}"]
    if up is None:
        return Proposal(feet, "medium", tuple(evidence))
    axis = AXES.index(up)
    heights = np.mean(
        [
            figure.positions[..., axis].min(axis=0)
            for figure in figures
            if figure.names == first.names
        ],
        axis=0,
    )
    lowest = [first.names[joint] for joint in np.argsort(heights, kind="stable")[:4]]
    agree = set(feet) <= set(lowest)
    evidence.append(f"joints that come lowest: {', '.join(lowest)}")
    return Proposal(feet, "high" if agree else "medium", tuple(evidence))


def propose_facing(figures: Sequence[Figure], up: UpAxis | None) -> Proposal:
    """Return the angle from the root's forward axis to the body's, degrees to the left.

    Training takes +z of the root (after conversion to y up) as forward unless the recipe says
    otherwise.
    """
    if up is None:
        return Proposal(None, "none", ("the up axis is not known",))
    angles = [angle for figure in figures if (angle := _facing(figure, up)) is not None]
    if not angles:
        return Proposal(None, "none", ("no pair of hips or shoulders was recognised",))
    mean = float(np.degrees(np.angle(np.mean(np.exp(1j * np.array(angles))))))
    agree = float(np.abs(np.mean(np.exp(1j * np.array(angles)))))
    value = round(mean, 1) + 0.0
    evidence = [f"the line between the hips faces {value:g} degrees to the left of the root's +z"]
    if abs(mean) > 45.0:
        evidence.append(
            "training takes +z of the root as forward: say motion.facing = 'hips' to take the "
            "nearest axis"
        )
    return Proposal(value, "high" if agree > 0.9 and abs(mean) < 45.0 else "low", tuple(evidence))


def _facing(figure: Figure, up: UpAxis) -> float | None:
    """Return the mean angle of the body's forward direction to the root's +z, rad, or None."""
    pair = figure.pair("UpperLeg") or figure.pair("UpperArm")
    if pair is None:
        return None
    left, right = (motion_file.to_y_up(points, up) for points in pair)
    across = left - right
    # Forward is left turned by a quarter: x to z, and z to -x.
    body = np.arctan2(-across[:, 2], across[:, 0])
    turns = figure.turns.copy()
    turns[:, 1:] = motion_file.to_y_up(turns[:, 1:], up)
    heading = quat.twist(turns, np.array([0.0, 1.0, 0.0]))
    return float(np.angle(np.mean(np.exp(1j * (body - heading)))))
