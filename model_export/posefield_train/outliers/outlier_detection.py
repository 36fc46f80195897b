"""Detection of clips that do not fit their family, with the evidence.

The clips stay in the training data: an outlier can be the only clip in a part of the control space.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from posefield.common.units import Floats
from posefield.motion import skeleton
from posefield.motion.clip import Clip
from posefield_train.graph.trained_model import Outlier, TrainedModel
from posefield_train.outliers import mirrored_clips, outlier_distances
from posefield_train.outliers.mirrored_clips import ClipTransform
from posefield_train.outliers.outlier_distances import OutlierDistances
from posefield_train.source import clip_joints, frame_faults
from posefield_train.source.clip_joints import ForeignBones
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe


@dataclass(frozen=True)
class JointJump:
    """The largest jump of a clip, from frame to frame + 1.

    distance: of the joint, m. times: ratio to the median step around it. whole: True if more than
    half of the joints jump too.
    """

    frame: int
    joint: int
    distance: float
    times: float
    whole: bool


def largest_jump(clip: Clip) -> JointJump | None:
    """Return the largest jump of a clip; None if there is none."""
    steps = np.linalg.norm(np.diff(clip.positions(), axis=0), axis=-1)
    leaping = frame_faults.leaping_steps(steps, clip.rate)
    if not len(leaping.frames):
        return None
    ways = steps[leaping.frames, leaping.joints]
    farthest = int(np.argmax(ways - leaping.paces))
    frame, joint = int(leaping.frames[farthest]), int(leaping.joints[farthest])
    found, usual = float(ways[farthest]), float(leaping.paces[farthest])
    whole = bool(np.sum(leaping.frames == frame) > 0.5 * steps.shape[1])
    return JointJump(frame, joint, found, found / usual, whole)


# Multiple of the median distance above which a clip is tested for mirroring, turns and swaps.
SUSPECT_FACTOR = 1.5
# A duration or travel is an outlier beyond STRANGE robust standard deviations, and by at least the
# factor FACTOR, or WAY, m.
OUTLIER_DEVIATIONS, FACTOR, WAY = 8.0, 1.5, 0.3


def find_outliers(recipe: Recipe, trained: TrainedModel) -> tuple[Outlier, ...]:
    """Return the evidence against the clips of a trained family, sorted by clip."""
    own = _OutlierSearch(recipe, trained)
    parts = (
        own.resized_clips(),
        own.distant_clips(),
        own.transformed_clips(),
        own.jumping_clips(),
        own.unusual_durations(),
        own.unusual_travel(),
    )
    return tuple(sorted((one for part in parts for one in part), key=lambda one: one.clip))


@dataclass(frozen=True)
class _OutlierSearch:
    recipe: Recipe
    trained: TrainedModel

    @cached_property
    def leave_one_out(self) -> OutlierDistances:
        return outlier_distances.measure_outliers(
            self.trained.pose.hyper, self.trained.samples, self.motions
        )

    @cached_property
    def motions(self) -> Floats:
        """Return motions (N, m) whose differences are root mean square joint distances, m."""
        whole = self.trained.tensor
        return self.trained.values["pose"] / np.sqrt(whole.weight * whole.values.shape[1])

    def distant_clips(self) -> Iterator[Outlier]:
        for clip in self.leave_one_out.outside:
            said = (
                f"lies {_cm(self.leave_one_out.distances[clip])} from what the others predict, "
                f"{self.leave_one_out.times[clip]:.0f} times as far as is usual "
                f"({_cm(self.leave_one_out.usual)}); {self._nearest(clip)}"
            )
            yield Outlier(clip, "far", said)

    def _nearest(self, clip: int) -> str:
        apart = np.linalg.norm(self.motions - self.motions[clip], axis=1)
        apart[clip] = np.inf
        nearest = int(np.argmin(apart))
        named = self.trained.examples[nearest].row.named
        return f"most like it is {named}, {_cm(apart[nearest])} away"

    def transformed_clips(self) -> Iterator[Outlier]:
        """Yield clips that would fit better mirrored, turned or with sides exchanged."""
        suspects = np.flatnonzero(self.leave_one_out.times > SUSPECT_FACTOR)
        # A single joint has no shape that could be mirrored or turned.
        if not len(suspects) or len(self.trained.skeleton) == 1:
            return
        names, whole = self.trained.skeleton.names, self.trained.tensor.values
        offsets = np.stack([example.offsets for example in self.trained.examples])
        usual = np.median(offsets, axis=0)
        left = mirrored_clips.left_direction(self._root_relative_positions(whole, usual), names)
        for clip, size in zip(suspects, clip_joints.relative_sizes(offsets)[suspects], strict=True):
            expected = whole[:, :, clip] - whole @ self.leave_one_out.left_out[clip]
            own = self._root_relative_positions(whole[:, :, [clip]], offsets[clip] / size)[0]
            there = self._root_relative_positions(expected[:, :, None], usual)[0]
            worn = mirrored_clips.find_transform(own, there, names, left)
            if worn:
                yield Outlier(int(clip), "disguise", _transform_text(worn))

    def _root_relative_positions(self, values: Floats, offsets: Floats) -> Floats:
        """Return joint positions (B, T, J, 3), m, relative to the root, of slices (D', T, B).

        offsets: bone offsets (J, 3), m.
        """
        whole = self.trained.tensor
        rotations, _ = whole.chart.poses(whole.numbers(values))
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
            said = f"lasts {lasts:.2f} s, expected about {lasts / np.exp(gaps[clip]):.2f} s"
            yield Outlier(clip, "duration", said)

    def unusual_travel(self) -> Iterator[Outlier]:
        """Yield cycles with travel far from the prediction."""
        gaps = self.trained.residuals.get("travel", np.zeros((1, 2)))[:, :2]
        lost = np.linalg.norm(gaps, axis=1)
        for clip in _beyond_limits(lost, WAY):
            said = f"its cycle ends {lost[clip]:.2f} m from where the others predict"
            yield Outlier(clip, "travel", said)


def _beyond_limits(gaps: Floats, least: float) -> list[int]:
    strange = (outlier_distances.robust_deviations(gaps) > OUTLIER_DEVIATIONS) & (gaps > least)
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
    what = "its whole body" if leap.whole else example.clip.skeleton.names[leap.joint]
    return (
        f"{what} leaps {_cm(leap.distance)} between frames {frame} and {frame + 1}, "
        f"{leap.times:.0f} times the pace around them"
    )


def _size_text(size: float, given: float) -> str:
    unit = clip_joints.guess_unit(given, size)
    guess = f": is the file in {unit}, not in units of {given:g} m?" if unit else ""
    return f"its bones are {size:.3g} times as long as the family's, expected about 1{guess}"


def _bones_text(other: ForeignBones, performer: str) -> str:
    alike = (
        f", and by {_cm(other.nearest_distance)} from those of {other.nearest_performer}"
        if other.nearest_performer
        else ""
    )
    return (
        f"its bones differ by {_cm(other.apart)} from those of {performer} elsewhere "
        f"({other.others} clips){alike}"
    )
