"""Errors of a synthesised motion against a captured one, and their means over clips."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from posefield.common.units import Floats
from posefield.motion import contact_detection, curves, quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.curves import Curve, CurveValues
from posefield_train.align import dtw, time_alignment
from posefield_train.tensor import motion_tensor
from posefield_train.tensor.motion_tensor import FRAMES, UNIFORM_SHARES

# Distance of three points at right angles from a joint, m, as in the Animation Compression Library.
SHELL_RADIUS = 0.03
# Frames at either end whose acceleration is told apart: a motion that snaps does so there.
END_FRAMES = 3


@dataclass(frozen=True)
class ComparedMotion:
    """A motion of J joints.

    points: each joint and three points around it (FRAMES, J, 4, 3), m. duration: s. event: position
    (3,) of the event's joint at its event, m; None without an event. curves: values (FRAMES, C);
    None for a family without curves.
    """

    points: Floats
    duration: float
    event: Floats | None
    curves: CurveValues | None = None

    @property
    def joints(self) -> Floats:
        """Return the joint positions (FRAMES, J, 3), m."""
        return self.points[:, :, 0]


@dataclass(frozen=True)
class MotionEvent:
    """Event of a motion. joint: its index. share: its time as a share of the duration."""

    joint: int
    share: float

    def position_of(self, joints: Floats) -> Floats:
        """Return the joint's position (3,) at that time, m. joints: (FRAMES, J, 3)."""
        return time_alignment.interpolate(joints[:, self.joint], np.array([self.share]))[0]


def motion_of_clip(clip: Clip, event: MotionEvent | None) -> ComparedMotion:
    """Return the motion of a captured clip on its own skeleton."""
    poses = motion_tensor.captured_poses(clip)
    motion = motion_of_poses(clip.skeleton.parents, *poses, clip.duration, event)
    if clip.curves is None:
        return motion
    values = time_alignment.interpolate(clip.curves.values, UNIFORM_SHARES)
    return replace(motion, curves=replace(clip.curves, values=values))


def with_curves(
    motions: Sequence[ComparedMotion], curves: tuple[Curve, ...], values: Floats
) -> list[ComparedMotion]:
    """Return motions with the values (Q, FRAMES, C) of their curves, if there are any."""
    if not curves:
        return list(motions)
    pairs = zip(motions, values, strict=True)
    return [
        replace(motion, curves=CurveValues(curves, curve_values)) for motion, curve_values in pairs
    ]


def motion_of_poses(
    parents: tuple[int, ...],
    rotations: Floats,
    translations: Floats,
    duration: float,
    event: MotionEvent | None,
) -> ComparedMotion:
    """Return the motion of local rotations (FRAMES, J, 4) and translations (FRAMES, J, 3), m."""
    (motion,) = motions_of_poses(parents, rotations[None], translations[None], [duration], [event])
    return motion


def motions_of_poses(
    parents: tuple[int, ...],
    rotations: Floats,
    translations: Floats,
    durations: Sequence[float],
    events: Sequence[MotionEvent | None],
) -> list[ComparedMotion]:
    """Return motions of local rotations (Q, FRAMES, J, 4) and translations (Q, FRAMES, J, 3), m."""
    positions, orientations = skeleton.forward_kinematics(parents, rotations, translations)
    axes = quat.rotate(orientations[..., None, :], SHELL_RADIUS * np.eye(3))
    points = positions[..., None, :] + np.concatenate(
        [np.zeros_like(axes[..., :1, :]), axes], axis=-2
    )
    listed = zip(points, durations, positions, events, strict=True)
    return [
        ComparedMotion(shell, duration, event.position_of(joints) if event else None)
        for shell, duration, joints, event in listed
    ]


@dataclass(frozen=True)
class DistanceStatistics:
    """Statistics of distances over joints and frames, m.

    mean, rms: root mean square, p95, p99: percentiles, largest.
    """

    mean: float
    rms: float
    p95: float
    p99: float
    largest: float


@dataclass(frozen=True)
class MotionErrors:
    """Errors of one synthesized motion relative to the captured one.

    relative, absolute: after time warping, without and with the root's position; plain_…: at equal
    shares of the duration. shell: largest of three points around each joint, after time warping,
    without the root's position. effector: distance at the event, m; NaN without an event.
    acceleration: mean magnitude, synthesized over captured, at equal durations. peak: largest of a
    frame, the same, each in its own duration. ends, ends_captured: acceleration (2,) of the first
    and of the last three frames, m/s². skate, skate_captured: mean speed of feet on the ground,
    m/s. duration: logarithm of synthesized over captured. joints: mean squared absolute distance
    (J,) of each joint, m². curves: mean squared error (C,) of each curve after time warping, in the
    square of its own unit. counted: the same as the distances that curves count as, m².
    """

    relative: DistanceStatistics
    absolute: DistanceStatistics
    plain_relative: DistanceStatistics
    plain_absolute: DistanceStatistics
    shell: DistanceStatistics
    effector: float
    acceleration: float
    peak: float
    ends: Floats
    ends_captured: Floats
    skate: float
    skate_captured: float
    duration: float
    joints: Floats
    curves: Floats = field(default_factory=lambda: np.zeros(0))
    counted: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def mean_squared_error(self) -> float:
        """Return the mean squared distance of joints and curves, m², which sigma predicts."""
        if not len(self.counted):
            return self.absolute.rms**2
        return float(np.mean([*self.joints, *self.counted]))


def compare_motions(
    synthesized: ComparedMotion, captured: ComparedMotion, feet: tuple[int, ...]
) -> MotionErrors:
    """Return the errors of a synthesized motion. feet: joint indices."""
    return compare_all([synthesized], captured, feet)[0]


def compare_all(
    synthesized: Sequence[ComparedMotion], captured: ComparedMotion, feet: tuple[int, ...]
) -> list[MotionErrors]:
    """Return the errors of several motions against one captured motion. feet: joint indices."""
    points, true = np.stack([motion.points for motion in synthesized]), captured.points
    captured_features = np.concatenate(
        [_warping_features(true), _curve_features(captured)], axis=-1
    )
    synthesized_features = [
        np.concatenate([_warping_features(m.points), _curve_features(m)], -1) for m in synthesized
    ]
    features = np.broadcast_to(captured_features, (len(synthesized), *captured_features.shape))
    phases = dtw.warp(features, np.stack(synthesized_features))
    warped = np.stack([_resample(*pair) for pair in zip(points, phases, strict=True)])
    distances = _joint_distances(warped, true)
    shell = np.linalg.norm(_root_relative(warped) - _root_relative(true), axis=-1)
    spreads = zip(
        _distances(_joint_distances(_root_relative(warped), _root_relative(true))),
        _distances(distances),
        _distances(_joint_distances(_root_relative(points), _root_relative(true))),
        _distances(_joint_distances(points, true)),
        _distances(shell[..., 1:].max(axis=-1)),
        strict=True,
    )
    sizes, true_sizes = frame_accelerations(points), frame_accelerations(true)
    jerks = _ratios(sizes.mean(axis=-1), true_sizes.mean())
    durations = np.array([motion.duration for motion in synthesized])
    sizes *= ((FRAMES - 1) / durations[:, None]) ** 2
    true_sizes *= ((FRAMES - 1) / captured.duration) ** 2
    peaks = _ratios(sizes.max(axis=-1), true_sizes.max())
    movements = zip(jerks.tolist(), peaks.tolist(), map(_ends, sizes), strict=True)
    slid = skate(captured, feet)
    channels = [_curve_errors(*pair, captured) for pair in zip(synthesized, phases, strict=True)]
    squares = np.mean(np.square(distances), axis=1)
    return [
        MotionErrors(
            *statistics,
            _effector(motion.event, captured.event),
            *movement,
            _ends(true_sizes),
            skate(motion, feet),
            slid,
            float(np.log(motion.duration / captured.duration)),
            joints,
            *errors,
        )
        for motion, statistics, movement, joints, errors in zip(
            synthesized, spreads, movements, squares, channels, strict=True
        )
    ]


def _curve_features(motion: ComparedMotion) -> Floats:
    """Return the curves (FRAMES, C) as the distances that they count as, m, for time warping."""
    curve_values = motion.curves
    return (
        np.zeros((FRAMES, 0))
        if curve_values is None
        else curve_values.values * curves.distances(curve_values.curves)
    )


def _curve_errors(
    synthesized: ComparedMotion, phase: Floats, captured: ComparedMotion
) -> tuple[Floats, Floats]:
    """Return mean squared errors (C,) of the curves, in their own units and as distances, m².

    phase: (FRAMES,), places of the made motion after time warping.
    """
    if synthesized.curves is None or captured.curves is None:
        return np.zeros(0), np.zeros(0)
    differences = (
        time_alignment.interpolate(synthesized.curves.values, phase) - captured.curves.values
    )
    squares = np.mean(np.square(differences), axis=0)
    return squares, squares * np.square(curves.distances(captured.curves.curves))


def _ratios(synthesized: Floats, captured: Floats) -> Floats:
    """Return the ratios of accelerations (M,); NaN for a captured motion that rests."""
    return synthesized / captured if captured > 0.0 else np.full(len(synthesized), np.nan)


def compare_methods(
    motions: Mapping[str, Sequence[ComparedMotion | None]],
    captured: Sequence[ComparedMotion],
    feet: tuple[int, ...],
) -> dict[str, list[MotionErrors | None]]:
    """Return the errors of every method by clip; None for clips that it did not predict."""
    by_method: dict[str, list[MotionErrors | None]] = {name: [] for name in motions}
    for index, true in enumerate(captured):
        synthesized = {
            name: motion for name, listed in motions.items() if (motion := listed[index])
        }
        errors = dict(
            zip(synthesized, compare_all(list(synthesized.values()), true, feet), strict=True)
        )
        for name, results in by_method.items():
            results.append(errors.get(name))
    return by_method


def _effector(synthesized: Floats | None, captured: Floats | None) -> float:
    if synthesized is None or captured is None:
        return math.nan
    return float(np.linalg.norm(synthesized - captured))


def _root_relative(points: Floats) -> Floats:
    return points - points[..., :1, :1, :]


def _warping_features(points: Floats) -> Floats:
    """Return joint positions (..., FRAMES, J * 3) relative to the root, for time warping."""
    return _root_relative(points)[..., 0, :].reshape(*points.shape[:-3], -1)


def _resample(points: Floats, phase: Floats) -> Floats:
    return time_alignment.interpolate(points.reshape(FRAMES, -1), phase).reshape(points.shape)


def _joint_distances(a: Floats, b: Floats) -> Floats:
    return np.linalg.norm(a[..., 0, :] - b[..., 0, :], axis=-1)


def _distances(distances: Floats) -> list[DistanceStatistics]:
    """Return the statistics of distances (M, FRAMES, J) of each of M motions."""
    flat = distances.reshape(len(distances), -1)
    p95, p99 = np.percentile(flat, [95, 99], axis=1)
    rms = np.sqrt(np.mean(np.square(flat), axis=1))
    rows = zip(flat.mean(axis=1), rms, p95, p99, flat.max(axis=1), strict=True)
    return [DistanceStatistics(*map(float, row)) for row in rows]


def frame_accelerations(points: Floats) -> Floats:
    """Return mean sizes (..., FRAMES - 2) of second differences of points (..., FRAMES, J, 4, 3).

    In metres; the points are taken relative to the root. Zero for a single joint.
    """
    joints = _root_relative(points)[..., 1:, 0, :]
    if not joints.shape[-2]:
        return np.zeros((*points.shape[:-4], points.shape[-4] - 2))
    return np.linalg.norm(np.diff(joints, n=2, axis=-3), axis=-1).mean(axis=-1)


def _ends(sizes: Floats) -> Floats:
    """Return the means (2,) of the first and of the last values (FRAMES - 2,)."""
    return np.array([sizes[:END_FRAMES].mean(), sizes[-END_FRAMES:].mean()])


def skate(motion: ComparedMotion, feet: tuple[int, ...]) -> float:
    """Return the mean horizontal speed of feet on the ground, m/s; 0 without feet."""
    return float(
        contact_detection.mean_skate_speed(
            motion.joints[:, list(feet)], (FRAMES - 1) / motion.duration
        )
    )


def mean(errors: Sequence[MotionErrors]) -> MotionErrors:
    """Return the means over clips.

    RMS distances are pooled, the largest is the largest of all, and the duration's error is an RMS.
    """

    def pooled(name: str) -> DistanceStatistics:
        return _pool([getattr(error, name) for error in errors])

    def average(name: str) -> float:
        return float(np.mean([getattr(error, name) for error in errors]))

    return MotionErrors(
        relative=pooled("relative"),
        absolute=pooled("absolute"),
        plain_relative=pooled("plain_relative"),
        plain_absolute=pooled("plain_absolute"),
        shell=pooled("shell"),
        effector=average("effector"),
        acceleration=average("acceleration"),
        peak=average("peak"),
        ends=np.mean([error.ends for error in errors], axis=0),
        ends_captured=np.mean([error.ends_captured for error in errors], axis=0),
        skate=average("skate"),
        skate_captured=average("skate_captured"),
        duration=float(np.sqrt(np.mean(np.square([error.duration for error in errors])))),
        joints=np.mean([error.joints for error in errors], axis=0),
        curves=np.mean([error.curves for error in errors], axis=0),
        counted=np.mean([error.counted for error in errors], axis=0),
    )


def _pool(statistics: Sequence[DistanceStatistics]) -> DistanceStatistics:
    listed = np.array([[d.mean, d.rms, d.p95, d.p99, d.largest] for d in statistics])
    average = listed.mean(axis=0)
    rms = np.sqrt(np.mean(np.square(listed[:, 1])))
    return DistanceStatistics(
        *map(float, (average[0], rms, average[2], average[3], listed[:, 4].max()))
    )
