"""Detection of clips that do not fit their family, with the evidence.

The clips stay in the training data: an outlier can be the only clip in a part of the control space.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from model_export import bones, disguise, leaps, outsiders
from model_export.bones import Foreign
from model_export.disguise import Disguise
from model_export.ingest import Example
from model_export.leaps import Leap
from model_export.outsiders import Judged
from model_export.recipe import Recipe
from service.motion import skeleton
from service.motion.conventions import Floats

if TYPE_CHECKING:
    from model_export.train import Trained

# Multiple of the median distance above which a clip is tested for mirroring, turns and swaps.
SUSPECT = 1.5
# A duration or travel is an outlier beyond STRANGE robust standard deviations, and by at least the
# factor FACTOR, or WAY, m.
STRANGE, FACTOR, WAY = 8.0, 1.5, 0.3


@dataclass(frozen=True)
class Stranger:
    """Evidence against one clip, as part of a sentence.

    kind: "far" from the prediction, "disguise", "leap", "size", "bones", "duration" or "travel".
    """

    clip: int
    kind: str
    said: str


def find(recipe: Recipe, trained: "Trained") -> tuple[Stranger, ...]:
    """Return the evidence against the clips of a trained family, sorted by clip."""
    own = _Family(recipe, trained)
    parts = (own.sized(), own.far(), own.disguised(), own.leaping(), own.late(), own.astray())
    return tuple(sorted((one for part in parts for one in part), key=lambda one: one.clip))


def notes(trained: "Trained") -> list[str]:
    """Return one note per clip with evidence against it."""
    said: dict[int, list[str]] = {}
    for one in trained.strangers:
        said.setdefault(one.clip, []).append(one.said)
    return [f"{trained.examples[i].row.named}: {'; '.join(parts)}" for i, parts in said.items()]


@dataclass(frozen=True)
class _Family:
    recipe: Recipe
    trained: "Trained"

    @cached_property
    def judged(self) -> Judged:
        return outsiders.judge(self.trained.pose.hyper, self.trained.laid, self.motions)

    @cached_property
    def motions(self) -> Floats:
        """Return motions (N, m) whose differences are root mean square joint distances, m."""
        whole = self.trained.tensor
        return self.trained.values["pose"] / np.sqrt(whole.weight * whole.values.shape[1])

    def far(self) -> Iterator[Stranger]:
        for clip in self.judged.outside:
            said = (
                f"lies {_cm(self.judged.distances[clip])} from what the others predict, "
                f"{self.judged.times[clip]:.0f} times as far as is usual "
                f"({_cm(self.judged.usual)}); {self._nearest(clip)}"
            )
            yield Stranger(clip, "far", said)

    def _nearest(self, clip: int) -> str:
        apart = np.linalg.norm(self.motions - self.motions[clip], axis=1)
        apart[clip] = np.inf
        nearest = int(np.argmin(apart))
        named = self.trained.examples[nearest].row.named
        return f"most like it is {named}, {_cm(apart[nearest])} away"

    def disguised(self) -> Iterator[Stranger]:
        """Yield clips that would fit better mirrored, turned or with sides exchanged."""
        suspects = np.flatnonzero(self.judged.times > SUSPECT)
        if not len(suspects):
            return
        names, whole = self.trained.skeleton.names, self.trained.tensor.values
        offsets = np.stack([example.offsets for example in self.trained.examples])
        usual = np.median(offsets, axis=0)
        left = disguise.leftwards(self._around(whole, usual), names)
        for clip, size in zip(suspects, bones.sizes(offsets)[suspects], strict=True):
            expected = whole[:, :, clip] - whole @ self.judged.left_out[clip]
            own = self._around(whole[:, :, [clip]], offsets[clip] / size)[0]
            there = self._around(expected[:, :, None], usual)[0]
            worn = disguise.found(own, there, names, left)
            if worn:
                yield Stranger(int(clip), "disguise", _worn(worn))

    def _around(self, values: Floats, offsets: Floats) -> Floats:
        """Return joint positions (B, T, J, 3), m, relative to the root, of slices (D', T, B).

        offsets: bone offsets (J, 3), m.
        """
        whole = self.trained.tensor
        rotations, _ = whole.chart.poses(whole.numbers(values))
        translations = np.broadcast_to(offsets, (*rotations.shape[:-1], 3))
        return skeleton.positions(self.trained.skeleton.parents, rotations, translations)

    def leaping(self) -> Iterator[Stranger]:
        for clip, example in enumerate(self.trained.examples):
            leap = leaps.worst(example.clip)
            if leap:
                yield Stranger(clip, "leap", _leapt(leap, example))

    def sized(self) -> Iterator[Stranger]:
        """Yield clips with bones of another size, or another performer's."""
        offsets = np.stack([example.offsets for example in self.trained.examples])
        performers = tuple(example.row.performer for example in self.trained.examples)
        for clip, size in enumerate(bones.sizes(offsets)):
            other = bones.foreign(offsets, performers, clip)
            if not 1.0 / bones.SIZE < size < bones.SIZE:
                yield Stranger(clip, "size", _sized(size, self.recipe.source.metres_per_unit))
            elif other:
                yield Stranger(clip, "bones", _boned(other, performers[clip]))

    def late(self) -> Iterator[Stranger]:
        """Yield clips with a duration far from the prediction."""
        gaps = self.trained.residuals["duration"][:, 0]
        for clip in _strange(np.abs(gaps), np.log(FACTOR)):
            lasts = self.trained.aligned.durations[clip]
            said = f"lasts {lasts:.2f} s, expected about {lasts / np.exp(gaps[clip]):.2f} s"
            yield Stranger(clip, "duration", said)

    def astray(self) -> Iterator[Stranger]:
        """Yield cycles with travel far from the prediction."""
        gaps = self.trained.residuals.get("travel", np.zeros((1, 2)))[:, :2]
        lost = np.linalg.norm(gaps, axis=1)
        for clip in _strange(lost, WAY):
            said = f"its cycle ends {lost[clip]:.2f} m from where the others predict"
            yield Stranger(clip, "travel", said)


def _strange(gaps: Floats, least: float) -> list[int]:
    strange = (outsiders.deviations(gaps) > STRANGE) & (gaps > least)
    return [int(clip) for clip in np.flatnonzero(strange)]


def _cm(metres: float) -> str:
    return f"{100 * metres:.1f} cm" if metres < 0.1 else f"{100 * metres:.0f} cm"


def _worn(worn: Disguise) -> str:
    return (
        f"{worn.said} its joints would lie {_cm(worn.after)} from what is expected, seen from the "
        f"root, not {_cm(worn.before)}"
    )


def _leapt(leap: Leap, example: Example) -> str:
    cycle = len(example.clip) - 1
    frame = example.row.first_frame + (leap.frame + round(example.shift * cycle)) % cycle
    what = "its whole body" if leap.whole else example.clip.skeleton.names[leap.joint]
    return (
        f"{what} leaps {_cm(leap.distance)} between frames {frame} and {frame + 1}, "
        f"{leap.times:.0f} times the pace around them"
    )


def _sized(size: float, given: float) -> str:
    unit = bones.unit(given, size)
    guess = f": is the file in {unit}, not in units of {given:g} m?" if unit else ""
    return f"its bones are {size:.3g} times as long as the family's, expected about 1{guess}"


def _boned(other: Foreign, performer: str) -> str:
    alike = f", and by {_cm(other.within)} from those of {other.alike}" if other.alike else ""
    return (
        f"its bones differ by {_cm(other.apart)} from those of {performer} elsewhere "
        f"({other.others} clips){alike}"
    )
