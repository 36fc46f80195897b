"""Checks of a family before it is trained, and detection of clips that do not fit it.

Outliers stay in the training data: one can be the only clip in a part of the control space.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import UP, Floats
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper
from posefield.motion import skeleton
from posefield.motion.clip import Clip
from posefield_train.graph.trained_model import Outlier, TrainedModel
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.source import clip_joints, frame_faults, measured_controls, recording_groups
from posefield_train.source.clip_joints import ForeignBones, apart
from posefield_train.source.control_sources import Auto, Control, ControlMeasured
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

LEAST_RANGE = 10.0**-measured_controls.DECIMALS * 10
"""Range of a measured control below which its values differ by rounding only, in its unit."""
SAME_MOTION = 1e-6
"""Largest distance between joints of motions that are the same, m."""


def check_family(recipe: Recipe, examples: Sequence[Example]) -> None:
    """Raise TrainingError for a control with one value, with its cause, and for equal motions."""
    if len(examples) < 2:
        return
    for index, control in enumerate(recipe.controls):
        values = np.array([example.controls[index] for example in examples])
        measured = isinstance(control, ControlMeasured)
        if np.ptp(values) <= (LEAST_RANGE if measured else 0.0):
            raise TrainingError(
                f"control {control.name!r} has the value {values[0]:g} in all {len(values)} "
                f"samples, expected at least two values; {_cause(recipe, control)}; leave it out "
                "of the recipe, or add clips that differ in it"
            )
    if _all_equal(examples):
        raise TrainingError(
            f"all {len(examples)} clips have the same motion, expected motions that differ with "
            f"their controls: check column {recipe.clips.file!r} of the table and its frames"
        )


def _all_equal(examples: Sequence[Example]) -> bool:
    first = examples[0].clip
    positions = first.positions()
    return all(
        len(example.clip) == len(first)
        and bool(np.all(np.abs(example.clip.positions() - positions) < SAME_MOTION))
        for example in examples[1:]
    )


def _cause(recipe: Recipe, control: Control) -> str:
    if isinstance(control, ControlMeasured):
        return _measured_cause(recipe, control.auto)
    column = f"column {control.column!r} holds it in every row"
    if control.column in recipe.clips.where:
        return f"{column} that [clips.where] lets pass by this column"
    return f"{column} that [clips.where] lets pass" if recipe.clips.where else column


def _measured_cause(recipe: Recipe, auto: Auto) -> str:
    if auto.quantity in ("leg_length", "stature"):
        return f"{auto.quantity} is of the performer, and all clips have bones of the same size"
    if auto.quantity in ("left", "forward", "turn") and auto.at == "start":
        return "each clip begins at the origin, so that a root is there in all of them"
    if auto.quantity in ("left", "forward") and recipe.motion.root == "in_place":
        return "motion.root = 'in_place' takes the travel away"
    where = f" of {' and '.join(auto.joint_names)}" if auto.joint_names else ""
    when = f" at {auto.at}" if auto.at else ""
    return f"{auto.quantity}{where}{when} is measured, and no clip differs in it"


# A clip is an outlier if its distance, in kriging deviations, exceeds the median by the factor
# TIMES and by DEVIATIONS robust standard deviations. On three real families and the procedural one
# no clip exceeds 2.7 and 5.6.
MEDIAN_FACTOR, DEVIATIONS = 3.0, 6.0
# Largest share of a family that can be outliers.
MAX_OUTLIER_SHARE = 0.25
# Ratio of a robust standard deviation to the median absolute deviation.
MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True)
class OutlierDistances:
    """Leave-one-out distances of a family with its outliers excluded.

    left_out: maps values to leave-one-out residuals (N, N), without contributions of outliers.
    distances: of whole motions (N,), m. times: distances (N,) relative to the median, both in units
    of the kriging deviation. outside: outliers, the farthest first.
    """

    left_out: Floats
    distances: Floats
    times: Floats
    outside: tuple[int, ...]

    @property
    def usual(self) -> float:
        """Return the median distance of the clips that are not outliers, m."""
        return float(np.median(np.delete(self.distances, self.outside)))


def measure_outliers(hyper: Hyper, samples: SamplePoints, motions: Floats) -> OutlierDistances:
    """Return the outliers of motions (N, m), whose differences are distances, m.

    The farthest outlier is excluded before the next is searched, because it spoils the predictions
    of its neighbours.
    """
    outside: list[int] = []
    measured = _measure(hyper, samples, motions, outside)
    while len(outside) < MAX_OUTLIER_SHARE * len(motions):
        times = measured.times.copy()
        times[outside] = 0.0
        worst = int(np.argmax(times))
        if (
            times[worst] < MEDIAN_FACTOR
            or robust_deviations(np.delete(times, outside)).max() < DEVIATIONS
        ):
            break
        outside.append(worst)
        measured = _measure(hyper, samples, motions, outside)
    return measured


def robust_deviations(values: Floats) -> Floats:
    """Return values (N,) as robust standard deviations from their median."""
    gaps = values - np.median(values)
    spread = MAD_TO_SIGMA * float(np.median(np.abs(gaps)))
    # The spread is zero if most values are equal; any difference is then an outlier.
    return gaps / max(spread, 1e-12)


def _measure(
    hyper: Hyper, samples: SamplePoints, motions: Floats, outside: list[int]
) -> OutlierDistances:
    inside = np.delete(np.arange(len(motions)), outside)
    left_out = np.zeros((len(motions), len(motions)))
    left_out[np.ix_(inside, inside)] = universal_kriging.leave_out_samples(hyper, samples, inside)
    for clip in outside:
        with_it = np.append(inside, clip)
        left_out[clip, with_it] = universal_kriging.leave_out_samples(hyper, samples, with_it)[-1]
    distances = np.linalg.norm(left_out @ motions, axis=1)
    times = distances / np.sqrt(kriging_model.left_out_variances(hyper, samples.points, left_out))
    return OutlierDistances(left_out, distances, times / np.median(times[inside]), tuple(outside))


# A transform is reported if undoing it reduces the distance below this share.
MAX_DISTANCE_RATIO = 0.5
# Smallest turn that is reported, degrees: clips are placed by the heading of their first frame,
# which differs by some degrees from clip to clip.
MIN_TURN = 15.0


@dataclass(frozen=True)
class ClipTransform:
    """A transform of a clip and its effect.

    description: the transform in words. before, after: distance from the prediction without and
    with the transform undone, m.
    """

    description: str
    before: float
    after: float


def find_transform(
    positions: Floats, expected: Floats, names: tuple[str, ...], left: Floats
) -> ClipTransform | None:
    """Return the transform that explains a clip's distance from its prediction; None if none does.

    positions, expected: joint positions (T, J, 3), m. left: unit vector (3,) to the family's left.
    """
    before = apart(positions, expected)
    undone = [
        ClipTransform(description, before, apart(other, expected))
        for description, other in _transformed(positions, expected, names, left)
    ]
    best = min(undone, key=lambda disguise: disguise.after, default=None)
    return best if best and best.after < MAX_DISTANCE_RATIO * before else None


def _transformed(
    positions: Floats, expected: Floats, names: tuple[str, ...], left: Floats
) -> Iterator[tuple[str, Floats]]:
    swapped, flipped = (
        recording_groups.mirrored_joints(names),
        positions - 2.0 * (positions @ left)[..., None] * left,
    )
    turn = _best_rotation(positions, expected)
    if description := _describe_rotation(turn):
        yield description, positions @ turn.T
    if swapped != tuple(range(len(names))):
        yield "mirrored left to right", flipped[:, swapped]
        yield "with the names of left and right joints exchanged", positions[:, swapped]
        yield "with the axis from left to right reversed", flipped


def left_direction(joints: Floats, names: tuple[str, ...]) -> Floats:
    """Return the horizontal unit vector (3,) to the left of joints (N, T, J, 3).

    It is x if no joint names contain sides.
    """
    swapped = np.array(recording_groups.mirrored_joints(names))
    rights = recording_groups.right_joints(names)
    if not rights:
        return np.array([1.0, 0.0, 0.0])
    # The median over clips ignores a few mirrored clips.
    across = (joints[:, :, swapped[rights]] - joints[:, :, rights]).mean(axis=(1, 2))
    level = np.median(across, axis=0) * (1.0 - UP)
    return np.asarray(level / np.linalg.norm(level))


def _best_rotation(positions: Floats, expected: Floats) -> Floats:
    """Return the rotation matrix that best aligns positions with expected (Kabsch 1976)."""
    u, _, v = np.linalg.svd(np.einsum("tjk,tjl->kl", expected, positions))
    sign = np.sign(np.linalg.det(u @ v))
    return np.asarray(u @ np.diag([1.0, 1.0, sign]) @ v)


def _describe_rotation(turn: Floats) -> str:
    """Describe a rotation in words: the wrong up axis, or the angle about the vertical.

    The description of a small rotation is empty: it is no mistake of a file.
    """
    tilt = np.degrees(np.arccos(np.clip(UP @ turn @ UP, -1.0, 1.0)))
    if tilt > 45.0:
        # The axis that the rotation maps to up is the file's up axis.
        up = turn.T @ UP
        axis = int(np.argmax(np.abs(up)))
        return f"with {'-' if up[axis] < 0 else ''}{'xyz'[axis]} for up"
    angle = np.degrees(np.arctan2(turn[0, 2] - turn[2, 0], turn[0, 0] + turn[2, 2]))
    if abs(angle) < MIN_TURN:
        return ""
    return f"turned by {angle:.0f} degrees about the vertical"


@dataclass(frozen=True)
class JointJump:
    """The largest jump of a clip, from frame to frame + 1.

    distance: of the joint, m. times: ratio to the median step around it. whole_body: True if more
    than half of the joints jump too.
    """

    frame: int
    joint: int
    distance: float
    times: float
    whole_body: bool


def largest_jump(clip: Clip) -> JointJump | None:
    """Return the largest jump of a clip; None if there is none."""
    steps = np.linalg.norm(np.diff(clip.positions(), axis=0), axis=-1)
    frames, joints, paces = frame_faults.leaping_steps(steps, clip.rate)
    if not len(frames):
        return None
    ways = steps[frames, joints]
    farthest = int(np.argmax(ways - paces))
    frame, joint, distance = int(frames[farthest]), int(joints[farthest]), float(ways[farthest])
    whole_body = bool(np.sum(frames == frame) > 0.5 * steps.shape[1])
    return JointJump(frame, joint, distance, distance / float(paces[farthest]), whole_body)


# Multiple of the median distance above which a clip is tested for mirroring, turns and swaps.
SUSPECT_FACTOR = 1.5
# A duration or travel is an outlier beyond STRANGE robust standard deviations, and by at least the
# factor FACTOR, or WAY, m.
OUTLIER_DEVIATIONS, FACTOR, WAY = 8.0, 1.5, 0.3


def find_outliers(recipe: Recipe, trained: TrainedModel) -> tuple[Outlier, ...]:
    """Return the evidence against the clips of a trained family, sorted by clip."""
    search = _OutlierSearch(recipe, trained)
    findings = (
        search.resized_clips(),
        search.distant_clips(),
        search.transformed_clips(),
        search.jumping_clips(),
        search.unusual_durations(),
        search.unusual_travel(),
    )
    return tuple(
        sorted((one for outliers in findings for one in outliers), key=lambda one: one.clip)
    )


@dataclass(frozen=True)
class _OutlierSearch:
    recipe: Recipe
    trained: TrainedModel

    @cached_property
    def leave_one_out(self) -> OutlierDistances:
        return measure_outliers(self.trained.pose.hyper, self.trained.samples, self.motions)

    @cached_property
    def motions(self) -> Floats:
        """Return motions (N, m) whose differences are root mean square joint distances, m."""
        tensor = self.trained.tensor
        return self.trained.values["pose"] / np.sqrt(tensor.weight * tensor.values.shape[1])

    def distant_clips(self) -> Iterator[Outlier]:
        for clip in self.leave_one_out.outside:
            evidence = (
                f"lies {_cm(self.leave_one_out.distances[clip])} from what the others predict, "
                f"{self.leave_one_out.times[clip]:.0f} times as far as is usual "
                f"({_cm(self.leave_one_out.usual)}); {self._nearest(clip)}"
            )
            yield Outlier(clip, "far", evidence)

    def _nearest(self, clip: int) -> str:
        gaps = np.linalg.norm(self.motions - self.motions[clip], axis=1)
        gaps[clip] = np.inf
        nearest = int(np.argmin(gaps))
        clip_name = self.trained.examples[nearest].row.named
        return f"most like it is {clip_name}, {_cm(gaps[nearest])} away"

    def transformed_clips(self) -> Iterator[Outlier]:
        """Yield clips that would fit better mirrored, turned or with sides exchanged."""
        suspects = np.flatnonzero(self.leave_one_out.times > SUSPECT_FACTOR)
        # A single joint has no shape that could be mirrored or turned.
        if not len(suspects) or len(self.trained.skeleton) == 1:
            return
        names, values = self.trained.skeleton.names, self.trained.tensor.values
        offsets = np.stack([example.offsets for example in self.trained.examples])
        median_offsets = np.median(offsets, axis=0)
        left = left_direction(self._root_relative_positions(values, median_offsets), names)
        for clip, size in zip(suspects, clip_joints.relative_sizes(offsets)[suspects], strict=True):
            expected = values[:, :, clip] - values @ self.leave_one_out.left_out[clip]
            positions = self._root_relative_positions(values[:, :, [clip]], offsets[clip] / size)[0]
            there = self._root_relative_positions(expected[:, :, None], median_offsets)[0]
            worn = find_transform(positions, there, names, left)
            if worn:
                yield Outlier(int(clip), "disguise", _transform_text(worn))

    def _root_relative_positions(self, values: Floats, offsets: Floats) -> Floats:
        """Return joint positions (B, T, J, 3), m, relative to the root, of slices (D', T, B).

        offsets: bone offsets (J, 3), m.
        """
        tensor = self.trained.tensor
        rotations, _ = tensor.chart.poses(tensor.numbers(values))
        translations = np.broadcast_to(offsets, (*rotations.shape[:-1], 3))
        return skeleton.positions(self.trained.skeleton.parents, rotations, translations)

    def jumping_clips(self) -> Iterator[Outlier]:
        for clip, example in enumerate(self.trained.examples):
            leap = largest_jump(example.clip)
            if leap:
                yield Outlier(clip, "leap", _jump_text(leap, example))

    def resized_clips(self) -> Iterator[Outlier]:
        """Yield clips with bones of another size, or another performer's."""
        offsets = np.stack([example.offsets for example in self.trained.examples])
        performers = tuple(example.row.performer for example in self.trained.examples)
        for clip, size in enumerate(clip_joints.relative_sizes(offsets)):
            other = clip_joints.find_foreign_bones(offsets, performers, clip)
            if not 1.0 / clip_joints.SIZE_LIMIT < size < clip_joints.SIZE_LIMIT:
                yield Outlier(clip, "size", _size_text(size, self.recipe.source.metres_per_unit))
            elif other:
                yield Outlier(clip, "bones", _bones_text(other, performers[clip]))

    def unusual_durations(self) -> Iterator[Outlier]:
        """Yield clips with a duration far from the prediction."""
        gaps = self.trained.residuals["duration"][:, 0]
        for clip in _beyond_limits(np.abs(gaps), np.log(FACTOR)):
            lasts = self.trained.aligned.durations[clip]
            evidence = f"lasts {lasts:.2f} s, expected about {lasts / np.exp(gaps[clip]):.2f} s"
            yield Outlier(clip, "duration", evidence)

    def unusual_travel(self) -> Iterator[Outlier]:
        """Yield cycles with travel far from the prediction."""
        gaps = self.trained.residuals.get("travel", np.zeros((1, 2)))[:, :2]
        lost = np.linalg.norm(gaps, axis=1)
        for clip in _beyond_limits(lost, WAY):
            evidence = f"its cycle ends {lost[clip]:.2f} m from where the others predict"
            yield Outlier(clip, "travel", evidence)


def _beyond_limits(gaps: Floats, limit: float) -> list[int]:
    strange = (robust_deviations(gaps) > OUTLIER_DEVIATIONS) & (gaps > limit)
    return [int(clip) for clip in np.flatnonzero(strange)]


def _cm(metres: float) -> str:
    return f"{100 * metres:.1f} cm" if metres < 0.1 else f"{100 * metres:.0f} cm"


def _transform_text(worn: ClipTransform) -> str:
    return (
        f"{worn.description} its joints would lie {_cm(worn.after)} from what is "
        "expected, seen from the "
        f"root, not {_cm(worn.before)}"
    )


def _jump_text(leap: JointJump, example: Example) -> str:
    cycle = len(example.clip) - 1
    frame = example.row.first_frame + (leap.frame + round(example.shift * cycle)) % cycle
    what = "its whole body" if leap.whole_body else example.clip.skeleton.names[leap.joint]
    return (
        f"{what} leaps {_cm(leap.distance)} between frames {frame} and {frame + 1}, "
        f"{leap.times:.0f} times the pace around them"
    )


def _size_text(size: float, expected: float) -> str:
    unit = clip_joints.guess_unit(expected, size)
    guess = f": is the file in {unit}, not in units of {expected:g} m?" if unit else ""
    return f"its bones are {size:.3g} times as long as the family's, expected about 1{guess}"


def _bones_text(other: ForeignBones, performer: str) -> str:
    alike = (
        f", and by {_cm(other.nearest_distance)} from those of {other.nearest_performer}"
        if other.nearest_performer
        else ""
    )
    return (
        f"its bones differ by {_cm(other.distance)} from those of {performer} elsewhere "
        f"({other.clips} clips){alike}"
    )
