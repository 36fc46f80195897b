"""Whose bones a clip has, and in which unit."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from service.motion.conventions import Floats

# Grown people are told apart by less than this factor in size.
SIZE = 1.5
# Units that files come in, m, and the word for them.
UNITS = {
    "millimetres": 0.001,
    "centimetres": 0.01,
    "inches": 0.0254,
    "ASF units": 0.0564444,
    "decimetres": 0.1,
    "feet": 0.3048,
    "metres": 1.0,
}
# As near as a unit's factor has to be to the one found.
NEAR = 1.15
# Bones of one performer differ by less than this from clip to clip, m, and from those of another
# by so much more.
SAME, CLEAR = 0.002, 3.0


@dataclass(frozen=True)
class Foreign:
    """A clip whose bones differ by `apart` from those of its performer's other clips, m.

    alike: another performer who has them, within `within`, m, where there is one.
    """

    apart: float
    others: int
    alike: str
    within: float


def sizes(offsets: Floats) -> Floats:
    """Length (N,) of all bones (N, J, 3) together, over the family's median."""
    lengths = np.linalg.norm(offsets, axis=-1).sum(axis=-1)
    return np.asarray(lengths / np.median(lengths))


def unit(metres_per_unit: float, size: float) -> str:
    """The unit that a file must be in to come out so many times too large, if there is one."""
    fits = {name: abs(np.log(metres_per_unit / size / m)) for name, m in UNITS.items()}
    name = min(fits, key=lambda name: fits[name])
    return name if fits[name] < np.log(NEAR) else ""


def foreign(offsets: Floats, performers: tuple[str, ...], clip: int) -> Foreign | None:
    """Whether a clip's bones (N, J, 3) are not its performer's.

    Of two clips that differ neither is believed, but for one that has another performer's bones.
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
        return Foreign(gap, len(own), near[1], near[0])
    return Foreign(gap, len(own), "", 0.0) if len(own) > 1 else None


def _nearest(offsets: Floats, whose: npt.NDArray[np.str_], clip: int) -> tuple[float, str]:
    """The other performer whose bones are most like a clip's, and how far they are, m."""
    names = sorted(set(whose.tolist()) - {whose[clip], ""})
    means = [np.median(offsets[whose == name], axis=0) for name in names]
    gaps = [(apart(offsets[clip], mean), name) for mean, name in zip(means, names, strict=True)]
    return min(gaps, default=(np.inf, ""))


def apart(a: Floats, b: Floats) -> float:
    """Root mean square distance of points (..., 3)."""
    return float(np.sqrt(np.mean(np.sum(np.square(a - b), axis=-1))))
