"""Checks of bone lengths: unit of a file, and clips with another performer's bones."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats

# Adults differ by less than this factor in size.
SIZE_LIMIT = 1.5
# Names of the units that files use, and their length in metres.
UNITS = {
    "millimetres": 0.001,
    "centimetres": 0.01,
    "inches": 0.0254,
    "ASF units": 0.0564444,
    "decimetres": 0.1,
    "feet": 0.3048,
    "metres": 1.0,
}
# Largest ratio between the factor found and a unit's factor.
UNIT_TOLERANCE = 1.15
# Bones of one performer differ by less than SAME, m, between clips, and from those of another
# performer by more than CLEAR times that spread.
SAME, CLEAR = 0.002, 3.0


@dataclass(frozen=True)
class ForeignBones:
    """A clip whose bones differ from those of its performer's other clips.

    apart: root mean square distance, m. others: number of the performer's other clips. alike:
    another performer with matching bones, or "". within: distance from that performer's bones, m.
    """

    apart: float
    others: int
    nearest_performer: str
    nearest_distance: float


def relative_sizes(offsets: Floats) -> Floats:
    """Return the total bone length (N,) of offsets (N, J, 3) relative to the family's median.

    A single joint has no bones: its clips are alike.
    """
    lengths = np.linalg.norm(offsets, axis=-1).sum(axis=-1)
    usual = np.median(lengths)
    return np.asarray(lengths / usual) if usual > 0.0 else np.ones(len(lengths))


def guess_unit(metres_per_unit: float, size: float) -> str:
    """Return the unit of a file whose skeleton is `size` times too large; "" if none fits."""
    fits = {name: abs(np.log(metres_per_unit / size / m)) for name, m in UNITS.items()}
    name = min(fits, key=lambda name: fits[name])
    return name if fits[name] < np.log(UNIT_TOLERANCE) else ""


def find_foreign_bones(
    offsets: Floats, performers: tuple[str, ...], clip: int
) -> ForeignBones | None:
    """Return how a clip's bones (N, J, 3) differ from its performer's; None if they match.

    If a performer has only two clips and they differ, neither is reported unless it matches another
    performer's bones.
    """
    whose = np.array(performers)
    own = np.flatnonzero((whose == whose[clip]) & (np.arange(len(whose)) != clip))
    if not whose[clip] or not len(own):
        return None
    usual = np.median(offsets[own], axis=0)
    gap = apart(offsets[clip], usual)
    spread = float(np.median([apart(one, usual) for one in offsets[own]]))
    if gap < max(SAME, CLEAR * spread):
        return None
    near = _nearest(offsets, whose, clip)
    if near[0] < gap / CLEAR:
        return ForeignBones(gap, len(own), near[1], near[0])
    return ForeignBones(gap, len(own), "", 0.0) if len(own) > 1 else None


def _nearest(offsets: Floats, whose: npt.NDArray[np.str_], clip: int) -> tuple[float, str]:
    """Return the distance, m, and name of the other performer with the most similar bones."""
    names = sorted(set(whose.tolist()) - {whose[clip], ""})
    means = [np.median(offsets[whose == name], axis=0) for name in names]
    gaps = [(apart(offsets[clip], mean), name) for mean, name in zip(means, names, strict=True)]
    return min(gaps, default=(np.inf, ""))


def apart(a: Floats, b: Floats) -> float:
    """Return the root mean square distance of points (..., 3)."""
    return float(np.sqrt(np.mean(np.sum(np.square(a - b), axis=-1))))
