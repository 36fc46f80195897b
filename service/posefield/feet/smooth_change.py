"""The smoothest change of paths that stand: one system of five diagonals for each path.

A path y minimises the sum of |y - f|² + (tau r)⁴ |D² (y - f)|² and is constant in each stance. f is
the predicted path, r the rate and D² the second difference. Places over the floor are complex
numbers, so that the turn of a cycle is a factor, and a cycle closes exactly.

A cycle is cut in its first stance: its chain of frames begins there and ends two frames after it
came round, in the same stance one cycle later. The place u of that stance is the only unknown that
the ends of the chain share: with y = p + u h, where p and h are solutions for given ends, u follows
from its own equation.
"""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from posefield.common import banded_systems
from posefield.common.banded_systems import Bands, Sides
from posefield.common.frame_groups import FrameGroups
from posefield.common.units import Booleans, Floats, Indices
from posefield.feet.stance_rows import FootRows, Runs, places

# Time over which a change of the path is spread, s.
SPREAD = 0.1

Numbers = npt.NDArray[Any]
Paths = Annotated[Numbers, "frames"]
BENDS = (1.0, -2.0, 1.0)


@dataclass(frozen=True)
class _Chains:
    """Chains of frames of paths, of which frames of one stance share an unknown.

    groups: of the chains' frames (N,). firsts: frame in which each chain begins (R,). unknowns:
    unknown of each frame (N,). counts: numbers of unknowns (R,). closed: whether the last unknown
    is the first one a cycle later (R,).
    """

    groups: FrameGroups
    firsts: Annotated[Indices, "chains"]
    unknowns: Annotated[Indices, "chain_frames"]
    counts: Annotated[Indices, "chains"]
    closed: Annotated[Booleans, "chains"]

    @property
    def frames(self) -> Annotated[Indices, "chain_frames"]:
        """Return the frames (N,) of the paths."""
        found: Indices = self.firsts[self.groups.group] + self.groups.frame
        return found

    @property
    def ends(self) -> tuple[Indices, Indices]:
        """Return the last unknown of each chain (R,), and the chains (R,), as an index."""
        return self.counts - 1, np.arange(len(self.counts))

    def sums(self, values: Annotated[Floats, "columns chain_frames"]) -> Sides:
        """Return the sums (C, U, R) over the frames of each unknown."""
        size, chains = int(self.counts.max()), len(self.counts)
        place = self.unknowns * chains + self.groups.group
        found = [np.bincount(place, own, size * chains) for own in values]
        return np.stack(found).reshape(-1, size, chains).astype(np.float64)

    def spread(self, found: Sides) -> Annotated[Floats, "columns chain_frames"]:
        """Return the values (C, N) of unknowns (C, U, R) at their frames."""
        return found[:, self.unknowns, self.groups.group]


def smooth_change(
    feet: FootRows,
    path: Paths,
    stances: Runs,
    values: Annotated[Numbers, "runs"] | None = None,
    fixed: Paths | None = None,
) -> Paths:
    """Return the paths (N,), real or complex, of smoothest change that are constant in stances.

    values: of the stances, if they are given; in cycles only for heights. fixed: values
    (N,) of single frames, and thereby of the stances that they are in; not a number in other
    frames. A path with fixed values does not repeat.
    """
    through = np.zeros(len(path), bool) if fixed is None else ~np.isnan(fixed)
    changed = np.zeros(len(feet.rows.counts), bool)
    changed[stances.rows] = True
    changed[feet.rows.groups.group[through]] = True
    rows = np.flatnonzero(changed)
    if not len(rows):
        return path
    if len(rows) < len(changed):
        found = path.copy()
        own = changed[feet.rows.groups.group]
        place = np.cumsum(changed) - 1
        some = Runs(place[stances.rows], stances.begins, stances.ends)
        part = None if fixed is None else fixed[own]
        found[own] = smooth_change(feet.select(rows), path[own], some, values, part)
        return found
    chains = _chains(feet, stances)
    system = _System.of(feet, chains, path, level=not np.iscomplexobj(path))
    known, given = _known(chains, system.goal.shape, stances, values)
    if fixed is not None:
        # No path with fixed frames is a cycle.
        single = chains.unknowns[through], chains.groups.group[through]
        known[single] = True
        for column, numbers in zip(given, _parts(fixed[through]), strict=True):
            column[single] = numbers
    return system.path(known, given, values is None and bool(chains.closed.any()))


def _chains(feet: FootRows, stances: Runs) -> _Chains:
    """Return the chains of paths, each of which has a stance, or a fixed frame."""
    rows, count = feet.rows, len(feet.rows.counts)
    firsts = np.zeros(count, np.int64)
    # The first stance of each row comes last in this assignment.
    firsts[stances.rows[::-1]] = stances.begins[::-1]
    firsts = np.where(rows.cyclic, firsts, 0)
    groups = FrameGroups(rows.counts + 2 * rows.cyclic)
    fresh = np.ones(len(groups.group), bool)
    run, frames = stances.frames()
    inner = frames > stances.begins[run]
    row = stances.rows[run][inner]
    fresh[groups.starts[row] + (frames[inner] - firsts[row]) % rows.counts[row]] = False
    fresh[(groups.starts + groups.counts - 1)[rows.cyclic]] = False
    unknowns = np.cumsum(fresh) - 1
    unknowns -= unknowns[groups.starts][groups.group]
    counts = unknowns[groups.starts + groups.counts - 1] + 1
    return _Chains(groups, firsts, unknowns, counts, rows.cyclic)


def _known(
    chains: _Chains,
    shape: tuple[int, ...],
    stances: Runs,
    values: Annotated[Numbers, "runs"] | None,
) -> tuple[Annotated[Booleans, "size chains"], Sides]:
    """Return which unknowns are known, and their values (C, U, R)."""
    given = np.zeros(shape)
    known = np.zeros(shape[1:], bool)
    known[np.arange(shape[1])[:, None] >= chains.counts] = True
    if values is not None:
        row = stances.rows
        begins = chains.groups.starts[row] + (stances.begins - chains.firsts[row]) % (
            chains.groups.counts[row] - 2 * chains.closed[row]
        )
        known[chains.unknowns[begins], row] = True
        last, chain = (own[chains.closed] for own in chains.ends)
        known[last, chain] = True
        for column, part in zip(given, _parts(values), strict=True):
            column[chains.unknowns[begins], row] = part
            column[last, chain] = column[0, chain]
    return known, given


@dataclass(frozen=True)
class _System:
    """Systems of the unknowns of paths. turned: the cycle of each, its turn left out for heights.

    bands: (3, U, R). goal: (C, U, R): the columns are real and imaginary parts.
    """

    feet: FootRows
    chains: _Chains
    bands: Bands
    goal: Sides

    @classmethod
    def of(cls, feet: FootRows, chains: _Chains, path: Paths, level: bool) -> "_System":
        """Return the systems of paths (N,); level: heights, which do not change in a cycle."""
        groups, rows = chains.groups, chains.groups.group
        if level:
            target = path[feet.rows.flat(rows, chains.frames)]
        else:
            target = places(feet, path, rows, chains.frames)
        weights = (groups.frame < feet.rows.counts[rows]).astype(float)
        stiffness = (SPREAD * feet.rows.rates) ** 4
        right = np.stack([_right(groups, weights, stiffness, own) for own in _parts(target)])
        return cls(feet, chains, _bands(chains, weights, stiffness), chains.sums(right))

    def path(self, known: Annotated[Booleans, "size chains"], given: Sides, joined: bool) -> Paths:
        """Return the paths (N,). joined: the places of first stances of cycles are unknown."""
        if joined:
            found = self._joined(known, given)
        else:
            found = banded_systems.solve(self.bands, self.goal, known, given)
        whole = self.chains.spread(found)
        path = whole[0] + 1j * whole[1] if len(whole) > 1 else whole[0]
        return self._in_cycle(path)

    def _joined(self, known: Annotated[Booleans, "size chains"], given: Sides) -> Sides:
        """Return the solutions (2, U, R), of cycles with the first place that fits both ends."""
        chains, feet = self.chains, self.feet
        last, chain = (own[chains.closed] for own in chains.ends)
        known = known.copy()
        known[0, chain] = known[last, chain] = True
        ends = np.zeros((4, *known.shape))
        ends[:2] = given
        ends[0, last, chain], ends[1, last, chain] = (
            feet.ways[chain].real,
            feet.ways[chain].imag,
        )
        ends[2, 0, chain], ends[3, last, chain] = 1.0, 1.0
        goal = np.concatenate([self.goal, np.zeros(self.goal.shape)])
        found = banded_systems.solve(self.bands, goal, known, ends)
        left = banded_systems.product(self.bands, found) - goal
        factor = feet.factors[chain]
        first = left[:, 0, chain] + 0j, left[:, last, chain] + 0j
        begin, end = ((own[0] + 1j * own[1], own[2], own[3]) for own in first)
        plain = begin[0] + np.conj(factor) * end[0]
        bent = begin[1] + factor * begin[2] + np.conj(factor) * (end[1] + factor * end[2])
        place = np.zeros(known.shape[1], complex)
        place[chain] = -plain / bent
        turned = place * feet.factors
        found[0] += place.real * found[2] + turned.real * found[3]
        found[1] += place.imag * found[2] + turned.imag * found[3]
        return found[:2]

    def _in_cycle(self, path: Annotated[Numbers, "chain_frames"]) -> Paths:
        """Return the paths of chains in the frames of the paths, within one cycle."""
        chains, feet = self.chains, self.feet
        rows = chains.groups.group
        own = chains.groups.frame < feet.rows.counts[rows]
        row, frames = rows[own], chains.frames[own]
        found = np.empty(len(row), path.dtype)
        values = path[own]
        if np.iscomplexobj(values):
            after = frames >= feet.rows.counts[row]
            back = np.conj(feet.factors[row]) * (values - feet.ways[row])
            values = np.where(after, back, values)
        found[feet.rows.flat(row, frames)] = values
        return found


def _parts(values: Numbers) -> list[Floats]:
    """Return the real parts of numbers, and the imaginary ones of complex numbers."""
    return [values.real, values.imag] if np.iscomplexobj(values) else [values]


def _right(
    groups: FrameGroups,
    weights: Annotated[Floats, "chain_frames"],
    stiffness: Annotated[Floats, "chains"],
    target: Annotated[Floats, "chain_frames"],
) -> Annotated[Floats, "chain_frames"]:
    """Return the right sides (N,) of the equations of frames."""
    # Stiffness times the second differences, zero at the ends.
    bent = np.zeros(len(target))
    bent[1:-1] = target[:-2] - 2.0 * target[1:-1] + target[2:]
    bent[groups.starts] = bent[groups.starts + groups.counts - 1] = 0.0
    bent *= stiffness[groups.group]
    found: Floats = weights * target - 2.0 * bent
    found[1:] += bent[:-1]
    found[:-1] += bent[1:]
    return found


def _bands(
    chains: _Chains,
    weights: Annotated[Floats, "chain_frames"],
    stiffness: Annotated[Floats, "chains"],
) -> Bands:
    """Return the diagonals (3, U, R) of the matrices.

    Unknowns are in the order of their frames, so a second difference couples neighbours alone.
    """
    size, count = int(chains.counts.max()), len(chains.counts)
    found = np.zeros((3, size, count))
    found[0] = chains.sums(weights[None])[0]
    inner = (chains.groups.frame > 0) & (
        chains.groups.frame < chains.groups.counts[chains.groups.group] - 1
    )
    middle = np.flatnonzero(inner)
    chain = chains.groups.group[middle]
    own = [chains.unknowns[middle + offset] for offset in (-1, 0, 1)]
    for row in range(3):
        for column in range(row, 3):
            apart = own[column] - own[row]
            # A product off the diagonal of the frames counts twice on that of a stance.
            share = np.where((apart == 0) & (row != column), 2.0, 1.0)
            value = stiffness[chain] * share * (BENDS[row] * BENDS[column])
            place = (apart * size + own[row]) * count + chain
            found += np.bincount(place, value, 3 * size * count).reshape(3, size, count)
    found[0][np.arange(size)[:, None] >= chains.counts] = 1.0
    return found
