"""How far each clip of a family lies from what the others predict, strangers having no say."""

from dataclasses import dataclass

import numpy as np

from model_export import kriging
from model_export.kriging import Hyper
from model_export.samples import Samples
from service.motion.conventions import Floats, Indices

# A clip is an outsider where it lies so many times as far away as is usual, measured in what
# kriging expects of each, and so many robust standard deviations beyond that. On three real
# families and the procedural one no clip is beyond 2.7 and 5.6.
TIMES, DEVIATIONS = 3.0, 6.0
# At most this share of a family can be strangers to the rest.
SHARE = 0.25
# A robust standard deviation is so many times the median absolute deviation.
ROBUST = 1.4826


@dataclass(frozen=True)
class Judged:
    """A family judged by those of it that belong.

    left_out (N, N): from values to what each clip differs by from what the others predict, without
    the outsiders among them. distances (N,): the same of whole motions, m. times (N,): distances
    as multiples of what is usual where each clip is. outside: clips, the farthest first.
    """

    left_out: Floats
    distances: Floats
    times: Floats
    outside: tuple[int, ...]

    @property
    def usual(self) -> float:
        """Median distance of the clips that belong, m."""
        return float(np.median(np.delete(self.distances, self.outside)))


def judge(hyper: Hyper, laid: Samples, motions: Floats) -> Judged:
    """Judged family of motions (N, m), whose differences are distances, m, by their field.

    The farthest is taken out before the next is sought: its neighbours, which it spoils the
    prediction of, are no strangers.
    """
    outside: list[int] = []
    judged = _judged(hyper, laid, motions, outside)
    while len(outside) < SHARE * len(motions):
        times = judged.times.copy()
        times[outside] = 0.0
        worst = int(np.argmax(times))
        if times[worst] < TIMES or deviations(np.delete(times, outside)).max() < DEVIATIONS:
            break
        outside.append(worst)
        judged = _judged(hyper, laid, motions, outside)
    return judged


def deviations(values: Floats) -> Floats:
    """Values (N,) as robust standard deviations from their median."""
    gaps = values - np.median(values)
    spread = ROBUST * float(np.median(np.abs(gaps)))
    # Where most values are equal there is no scale: what differs at all is far beyond it.
    return gaps / max(spread, 1e-12)


def _judged(hyper: Hyper, laid: Samples, motions: Floats, outside: list[int]) -> Judged:
    kept = np.delete(np.arange(len(motions)), outside)
    left_out = np.zeros((len(motions), len(motions)))
    left_out[np.ix_(kept, kept)] = _left_out(hyper, laid, kept)
    for clip in outside:
        with_it = np.append(kept, clip)
        left_out[clip, with_it] = _left_out(hyper, laid, with_it)[-1]
    distances = np.linalg.norm(left_out @ motions, axis=1)
    times = distances / np.sqrt(kriging.left_out_variances(hyper, laid.points, left_out))
    return Judged(left_out, distances, times / np.median(times[kept]), tuple(outside))


def _left_out(hyper: Hyper, laid: Samples, kept: Indices) -> Floats:
    return kriging.leave_out(hyper, laid.points[kept], laid.groups[kept])
