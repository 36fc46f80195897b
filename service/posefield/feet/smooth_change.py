"""The smoothest change of paths that stand: one system of five diagonals for each path.

A path y minimises the sum of |y - f|² + (tau r)⁴ |D² (y - f)|² and is constant in each stance. f is
the predicted path, r the rate and D² the second difference. Places over the floor are complex
numbers, so that the turn of a cycle is a factor, and a cycle closes exactly.

A cycle is cut in its first stance: its chain of frames begins there and ends two frames after it
came round, in the same stance one cycle later. The place u of that stance is the only unknown that
the ends of the chain share: with y = p + u h, where p and h are solutions for given ends, u follows
from its own equation.

The systems are solved by block cyclic reduction, in time and memory that grow linearly: two
unknowns are one block, of which every second one is eliminated at a time. All eliminations of a
round, of all systems, are a few products of arrays.
"""

from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from posefield.common.frame_groups import FrameGroups, FrameRows
from posefield.common.units import Booleans, Floats, Indices
from posefield.feet.stance_rows import FootRows, Runs, places

Bands = Annotated[Floats, "3 size systems"]
"""Diagonals of R symmetric matrices (U, U), and the two above each, by row; zeros beyond its end.
Systems that are smaller end with ones on the diagonal."""

Sides = Annotated[Floats, "columns size systems"]
"""Right sides, or solutions, (C, U, R): C for each of R systems."""

Blocks = Annotated[Floats, "2 2 blocks systems"]
BlockSides = Annotated[Floats, "2 columns blocks systems"]


def product(bands: Bands, values: Sides) -> Sides:
    """Return the products (C, U, R) of the matrices and vectors (C, U, R)."""
    products: Floats = bands[0] * values
    for offset in (1, 2):
        band = bands[offset, : max(values.shape[1] - offset, 0)]
        products[:, :-offset] += band * values[:, offset:]
        products[:, offset:] += band * values[:, :-offset]
    return products


def solve(
    bands: Bands, goal: Sides, fixed: Annotated[Booleans, "size systems"], values: Sides
) -> Sides:
    """Return the solutions (C, U, R) of positive definite systems.

    fixed: unknowns whose values (C, U, R) are given; their equations are left out.
    """
    fixed_values = np.where(fixed, values, 0.0)
    right = np.where(fixed, fixed_values, goal - product(bands, fixed_values))
    reduced = bands.copy()
    reduced[0][fixed] = 1.0
    for offset in (1, 2):
        reduced[offset][fixed] = 0.0
        reduced[offset, : max(len(fixed) - offset, 0)][fixed[offset:]] = 0.0
    _, count, systems = right.shape
    odd = count % 2
    # One more unknown makes whole blocks; it is zero.
    wide = np.pad(reduced, ((0, 0), (0, odd), (0, 0)))
    wide[0, count:] = 1.0
    diagonal, above = np.zeros((2, 2, 2, (count + odd) // 2, systems))
    diagonal[0, 0], diagonal[1, 1] = wide[0, ::2], wide[0, 1::2]
    diagonal[0, 1] = diagonal[1, 0] = wide[1, ::2]
    above[0, 0], above[1, 1], above[1, 0] = wide[2, ::2], wide[2, 1::2], wide[1, 1::2]
    sides = np.pad(right, ((0, 0), (0, odd), (0, 0)))
    blocks = np.stack([sides[:, ::2], sides[:, 1::2]])
    solution = np.empty(sides.shape)
    solution[:, ::2], solution[:, 1::2] = _reduce(diagonal, above, blocks)
    return np.where(fixed, fixed_values, solution[:, :count])


def _reduce(
    diagonal: Blocks, above: Annotated[Floats, "2 2 _ systems"], sides: BlockSides
) -> BlockSides:
    """Return the solution (2, C, B, R) of systems of blocks on the diagonal, and right above it."""
    count = diagonal.shape[2]
    if count == 1:
        return _times(_inverses(diagonal), sides)
    # Blocks 1, 3, ... are eliminated: each lies after a block that is kept, and before one unless
    # it is the last.
    inverses = _inverses(diagonal[:, :, 1::2])
    inner, outer = (count - 1) // 2, count // 2
    before, after = above[:, :, : count - 1 : 2], above[:, :, 1 : count - 1 : 2]
    down, up = _times(before, inverses), _times(after.swapaxes(0, 1), inverses[:, :, :inner])
    even_blocks, rest = diagonal[:, :, ::2].copy(), sides[:, :, ::2].copy()
    odd = sides[:, :, 1::2]
    even_blocks[:, :, :outer] -= _times(down, before.swapaxes(0, 1))
    even_blocks[:, :, 1 : inner + 1] -= _times(up, after)
    rest[:, :, :outer] -= _times(down, odd)
    rest[:, :, 1 : inner + 1] -= _times(up, odd[:, :, :inner])
    solution = np.empty_like(sides)
    solution[:, :, ::2] = even = _reduce(even_blocks, -_times(down[:, :, :inner], after), rest)
    left = odd - _times(before.swapaxes(0, 1), even[:, :, :outer])
    left[:, :, :inner] -= _times(after, even[:, :, 1 : inner + 1])
    solution[:, :, 1::2] = _times(inverses, left)
    return solution


def _times(
    a: Blocks, b: Annotated[Floats, "2 columns blocks systems"]
) -> Annotated[Floats, "2 columns blocks systems"]:
    """Return the products of blocks and blocks, or of blocks and right sides."""
    return a[:, 0, None] * b[None, 0] + a[:, 1, None] * b[None, 1]


def _inverses(blocks: Blocks) -> Blocks:
    """Return the inverses of blocks."""
    (a, b), (c, d) = blocks
    inverses = np.empty(blocks.shape)
    inverses[0, 0], inverses[0, 1], inverses[1, 0], inverses[1, 1] = d, -b, -c, a
    inverses /= a * d - b * c
    return inverses


# Time over which a change of the path is spread, s.
SPREAD = 0.1

Numbers = npt.NDArray[Any]
Paths = Annotated[Numbers, "frames"]
BENDS = (1.0, -2.0, 1.0)


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
        smoothed = path.copy()
        frames = changed[feet.rows.groups.group]
        new_rows = np.cumsum(changed) - 1
        some = Runs(new_rows[stances.rows], stances.begins, stances.ends)
        fixed_frames = None if fixed is None else fixed[frames]
        smoothed[frames] = smooth_change(
            feet.select(rows), path[frames], some, values, fixed_frames
        )
        return smoothed
    groups, firsts, unknowns, counts = _chains(feet.rows, stances)
    owner, closed, size, chains = groups.group, feet.rows.cyclic, int(counts.max()), len(counts)
    frames, level = firsts[owner] + groups.frame, not np.iscomplexobj(path)
    # Heights do not change in a cycle.
    target = path[feet.rows.flat(owner, frames)] if level else places(feet, path, owner, frames)
    within = groups.frame < feet.rows.counts[owner]
    weights, stiffness = within.astype(float), (SPREAD * feet.rows.rates) ** 4
    right = [_right(groups, weights, stiffness, numbers) for numbers in _parts(target)]
    bins = unknowns * chains + owner
    sums = [np.bincount(bins, column, size * chains) for column in (weights, *right)]
    diagonal, *sides = np.stack(sums).reshape(-1, size, chains).astype(np.float64)
    goal, ended = np.stack(sides), np.arange(size)[:, None] >= counts
    bands = _bands(groups, unknowns, diagonal, stiffness)
    bands[0][ended] = 1.0
    fixed_unknowns, fixed_values = ended.copy(), np.zeros(goal.shape)
    last, chain = counts[closed] - 1, np.flatnonzero(closed)
    if values is not None:
        row = stances.rows
        begins = groups.starts[row] + (stances.begins - firsts[row]) % feet.rows.counts[row]
        fixed_unknowns[unknowns[begins], row] = fixed_unknowns[last, chain] = True
        for column, numbers in zip(fixed_values, _parts(values), strict=True):
            column[unknowns[begins], row] = numbers
            column[last, chain] = column[0, chain]
    if fixed is not None:
        # No path with fixed frames is a cycle.
        single = unknowns[through], owner[through]
        fixed_unknowns[single] = True
        for column, numbers in zip(fixed_values, _parts(fixed[through]), strict=True):
            column[single] = numbers
    if values is None and len(chain):
        solution = _joined(feet, (last, chain), bands, goal, fixed_unknowns, fixed_values)
    else:
        solution = solve(bands, goal, fixed_unknowns, fixed_values)
    # The frames of the paths, each within one cycle.
    components = solution[:, unknowns, owner][:, within]
    row, frames = owner[within], frames[within]
    change = components[0] if level else components[0] + 1j * components[1]
    if not level:
        back = np.conj(feet.factors[row]) * (change - feet.ways[row])
        change = np.where(frames >= feet.rows.counts[row], back, change)
    paths = np.empty(len(row), change.dtype)
    paths[feet.rows.flat(row, frames)] = change
    return paths


def _chains(
    rows: FrameRows, stances: Runs
) -> tuple[
    FrameGroups,
    Annotated[Indices, "chains"],
    Annotated[Indices, "chain_frames"],
    Annotated[Indices, "chains"],
]:
    """Return chains of frames of paths, of which frames of one stance share an unknown.

    Each has a stance, or a fixed frame. Returns the groups of their frames (N,), the frame in which
    each begins (R,), the unknown of each frame (N,), and the numbers of unknowns (R,). The last
    unknown of a cycle is the first one a cycle later.
    """
    firsts = np.zeros(len(rows.counts), np.int64)
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
    return groups, firsts, unknowns, unknowns[groups.starts + groups.counts - 1] + 1


def _joined(
    feet: FootRows,
    last_unknowns: tuple[Indices, Indices],
    bands: Bands,
    goal: Sides,
    fixed_unknowns: Annotated[Booleans, "size chains"],
    fixed_values: Sides,
) -> Sides:
    """Return the solutions (2, U, R), of cycles with the first place that fits both ends.

    last_unknowns: of the cycles, and their chains. goal: (2, U, R): real and imaginary parts.
    """
    last, chain = last_unknowns
    fixed_unknowns = fixed_unknowns.copy()
    fixed_unknowns[0, chain] = fixed_unknowns[last, chain] = True
    end_values = np.zeros((4, *fixed_unknowns.shape))
    end_values[:2] = fixed_values
    end_values[0, last, chain] = feet.ways[chain].real
    end_values[1, last, chain] = feet.ways[chain].imag
    end_values[2, 0, chain], end_values[3, last, chain] = 1.0, 1.0
    goal = np.concatenate([goal, np.zeros(goal.shape)])
    solution = solve(bands, goal, fixed_unknowns, end_values)
    left = product(bands, solution) - goal
    factor = feet.factors[chain]
    first = left[:, 0, chain] + 0j, left[:, last, chain] + 0j
    begin, end = (
        (end_index[0] + 1j * end_index[1], end_index[2], end_index[3]) for end_index in first
    )
    plain = begin[0] + np.conj(factor) * end[0]
    bent = begin[1] + factor * begin[2] + np.conj(factor) * (end[1] + factor * end[2])
    shared = np.zeros(fixed_unknowns.shape[1], complex)
    shared[chain] = -plain / bent
    turned = shared * feet.factors
    solution[0] += shared.real * solution[2] + turned.real * solution[3]
    solution[1] += shared.imag * solution[2] + turned.imag * solution[3]
    return solution[:2]


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
    sides: Floats = weights * target - 2.0 * bent
    sides[1:] += bent[:-1]
    sides[:-1] += bent[1:]
    return sides


def _bands(
    groups: FrameGroups,
    unknowns: Annotated[Indices, "chain_frames"],
    diagonal: Annotated[Floats, "size chains"],
    stiffness: Annotated[Floats, "chains"],
) -> Bands:
    """Return the diagonals (3, U, R) of the matrices; diagonal: sums (U, R) of the weights.

    Unknowns are in the order of their frames, so a second difference couples neighbours alone.
    """
    size, count = diagonal.shape
    bands = np.zeros((3, size, count))
    bands[0] = diagonal
    inner = (groups.frame > 0) & (groups.frame < groups.counts[groups.group] - 1)
    middle = np.flatnonzero(inner)
    chain = groups.group[middle]
    columns = [unknowns[middle + offset] for offset in (-1, 0, 1)]
    for row in range(3):
        for column in range(row, 3):
            distance = columns[column] - columns[row]
            # A product off the diagonal of the frames counts twice on that of a stance.
            share = np.where((distance == 0) & (row != column), 2.0, 1.0)
            value = stiffness[chain] * share * (BENDS[row] * BENDS[column])
            bins = (distance * size + columns[row]) * count + chain
            bands += np.bincount(bins, value, 3 * size * count).reshape(3, size, count)
    return bands
