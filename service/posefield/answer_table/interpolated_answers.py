"""Table of a model's answers on a grid of the controls, for every level and name of a set."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from posefield.answer_table import answer_gaps, control_grid, row_compression, samples
from posefield.answer_table.control_grid import ControlGrid
from posefield.answer_table.row_compression import Block
from posefield.answer_table.samples import TURNS, Answers, Queries
from posefield.common.units import Floats, Singles
from posefield.inference.session import Session
from posefield.kriging.support import Support, fit_support
from posefield.model_file.model_card import ModelCard
from posefield.motion import quat

FRAMES = 40
"""Frames of an answer."""
PROBES = 48
"""Random points at which the interpolation along a control is measured."""
TOLERANCE = 0.01
"""Error of a joint, m, below which the grid is not refined."""
CURVE_RANGE = 0.2
"""Error of a joint, m, that the refinement takes for an error by the range of a curve."""
MAX_ROWS = 10_000
"""Largest number of rows of a level: points of the grid times names."""
BASIS_ROWS = 1000
"""Rows from which a level's components are computed; then as many of the furthest are added."""
COMPONENT = 0.008
"""Distance along a component below which it is left out: a few tenths of a millimetre a number."""
COEFFICIENT_STEP = 2e-3
"""Step of a coefficient; the components of a row of some thousand numbers are orthonormal."""
NUMBER_STEP = 2e-4
"""Largest step of a number, in metres or of a quaternion, that a component contributes."""
SUPPORT_ROWS = 200_000
"""Largest number of points at which support is tabulated."""
SUPPORT_STEPS = (61, 31, 21, 11, 7, 4, 3)
"""Numbers of values of a control from which that of the support's grid is taken.

The first four have a value where support ends outside the sampled range.
"""


@dataclass(frozen=True)
class LevelTable:
    """Answers at one level, a row for each name and point of the grid; first those of no name.

    coefficients (N, R), basis (W, R) and mean (W, 1): rows of poses, W numbers as in `layout`.
    trust (N, 2): duration, s, and sigma, m.
    """

    coefficients: Block
    basis: Block
    mean: Block
    trust: Block

    @property
    def blocks(self) -> tuple[Block, ...]:
        """All blocks, in the order of the file."""
        return self.coefficients, self.basis, self.mean, self.trust


@dataclass(frozen=True)
class AnswerTable:
    """Answers between which a reader interpolates.

    grid: of the controls. levels: one table for each level of detail. card: of the model.
    support_grid: of `support` (points, 1), 1 where similar clips were captured.
    """

    grid: ControlGrid
    levels: tuple[LevelTable, ...]
    card: ModelCard
    support_grid: ControlGrid
    support: Block

    @property
    def answers(self) -> int:
        """Number of computed answers."""
        return len(self.levels) * (len(samples.names(self.card)) + 1) * len(self.grid)

    def interpolate(self, asked: Queries) -> Answers:
        """Return the interpolated answers to queries within the grid, as a reader does."""
        own = self.levels[asked.level]
        indices, weights = self.grid.corners(asked.controls)
        rows = indices + (asked.who[:, None] + 1) * len(self.grid)

        def mixed(values: Block) -> Floats:
            return np.asarray(np.einsum("bc,bcn->bn", weights, values.numbers[rows]))

        found = own.mean.numbers[:, 0] + mixed(own.coefficients) @ own.basis.numbers.T
        poses = _split(found.astype(np.float32), layout(FRAMES, self.card))
        for name in TURNS:
            poses[name] = quat.normalize(poses[name])
        durations, sigmas = mixed(own.trust).T.astype(np.float32)
        return Answers(**poses, durations=durations, sigmas=sigmas)

    def supported(self, points: Annotated[Floats, "points controls"]) -> Any:
        """Return whether points (B, d) are supported, as a reader does."""
        indices, weights = self.support_grid.corners(points)
        return np.sum(weights * self.support.numbers[indices, 0], axis=1) >= 0.5

    @property
    def blocks(self) -> tuple[Block, ...]:
        """All blocks, in the order of the file."""
        return (*(part for level in self.levels for part in level.blocks), self.support)

    @property
    def contents(self) -> list[bytes]:
        """The bytes of all blocks."""
        return [part.content for part in self.blocks]

    @property
    def head(self) -> dict[str, Any]:
        """The numbers that are not in blocks, and the heads of the blocks with their offsets."""
        heads, first = [], 0
        for part in self.blocks:
            heads.append({**part.head, "offset": first})
            first += 2 * part.integers.size
        *levels, support = heads
        count = len(levels) // len(self.levels)
        starts = range(0, len(levels), count)
        named = samples.named_set(self.card)
        return {
            "named": named.name if named else None,
            "axes": [axis.tolist() for axis in self.grid.axes],
            "layout": {name: list(shape) for name, shape in layout(FRAMES, self.card).items()},
            "levels": [{own["name"]: own for own in levels[at : at + count]} for at in starts],
            "support_axes": [axis.tolist() for axis in self.support_grid.axes],
            "support": support,
            "answers": self.answers,
        }


def layout(frames: int, card: ModelCard) -> Mapping[str, tuple[int, ...]]:
    """Return names and shapes of the arrays in a row, in order."""
    joints = len(card.skeleton)
    return {
        "rotations": (frames, joints, 4),
        "roots": (frames, 3),
        "placed_turns": (frames, 4),
        "placed_roots": (frames, 3),
        "curves": (frames, len(card.curves)),
        "bones": (joints, 3),
    }


def build(
    session: Session, most: int = MAX_ROWS, finished: Callable[[int], None] = lambda _: None
) -> AnswerTable:
    """Return the table of a model's answers.

    most: largest number of rows of a level; the grid is refined up to it, or until interpolation
    along one control errs by at most TOLERANCE. finished: called with the number of levels so far.
    """
    card = session.card
    error = _interval_error(session)
    size = most // (len(samples.names(card)) + 1)
    grid = control_grid.refined(session.bounds, error, TOLERANCE, size)
    levels = []
    for level in range(len(card.levels)):
        levels.append(_level(session, grid, level))
        finished(level + 1)
    own = _support_grid(session)
    known: Support = fit_support(np.array(card.examples))
    held = row_compression.block("support", known.supported(own.points)[:, None].astype(float), 1.0)
    return AnswerTable(grid, tuple(levels), card, own, held)


def _level(session: Session, grid: ControlGrid, level: int) -> LevelTable:
    rows, trust = _rows(session, grid, level)
    found = row_compression.robust_components(rows, COMPONENT, BASIS_ROWS)
    coefficients = found.coefficients(rows)
    largest = np.maximum(np.abs(coefficients).max(axis=0), COEFFICIENT_STEP)
    return LevelTable(
        row_compression.block("coefficients", coefficients, COEFFICIENT_STEP),
        row_compression.block("basis", found.basis.T, NUMBER_STEP / largest),
        row_compression.block("mean", found.mean[:, None], 0.1 * NUMBER_STEP),
        row_compression.block("trust", trust),
    )


def _rows(
    session: Session, grid: ControlGrid, level: int
) -> tuple[Annotated[Singles, "rows numbers"], Annotated[Singles, "rows 2"]]:
    """Return a level's poses and its trust, a row for each name and point."""
    points, names = grid.points, len(samples.names(session.card))
    shapes = layout(FRAMES, session.card)
    width = sum(int(np.prod(shape)) for shape in shapes.values())
    rows = np.empty(((names + 1) * len(points), width), np.float32)
    trust = np.empty((len(rows), 2), np.float32)
    for who in range(-1, names):
        asked = Queries(points, np.full(len(points), who), level)
        found = samples.sample(session, asked, FRAMES)
        block = slice((who + 1) * len(points), (who + 2) * len(points))
        for name, part in _split(rows[block], shapes).items():
            values = getattr(found, name)
            part[:] = _steady(values) if name in TURNS else values
        trust[block] = np.stack([found.durations, found.sigmas], axis=1)
    for name in TURNS:
        _align_signs(_split(rows, shapes)[name], (names + 1, *grid.shape))
    return rows, trust


def _split(
    rows: Annotated[Singles, "rows numbers"], shapes: Mapping[str, tuple[int, ...]]
) -> dict[str, Any]:
    """Return views of the arrays in rows."""
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes.values()])[:-1]
    parts = np.split(rows, ends, axis=1)
    return {
        name: part.reshape(len(rows), *shape)
        for (name, shape), part in zip(shapes.items(), parts, strict=True)
    }


def _steady(turns: Any) -> Any:
    """Return equal rotations (B, F, ..., 4) with signs such that neighbouring frames lie close."""
    return np.moveaxis(quat.unroll(np.moveaxis(turns, 1, 0)), 0, 1)


def _align_signs(turns: Any, shape: tuple[int, ...]) -> None:
    """Give equal rotations signs such that neighbouring rows lie close, in place.

    turns: (N, F, ..., 4), with steady signs over the frames. shape: of the N rows, names and grid.
    """
    first = turns[:, 0].reshape(*shape, -1, 4).copy()
    signs = np.ones((*shape, first.shape[-2], 1), np.float32)
    for axis in reversed(range(len(shape))):
        # Along this axis at the first place of those after it, which are consistent already.
        ends = (*(slice(None),) * (axis + 1), *(slice(1),) * (len(shape) - axis - 1))
        line = np.moveaxis(first[ends], axis, 0)
        flips = np.where(np.sum(quat.unroll(line) * line, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
        found = np.moveaxis(flips, 0, axis).astype(np.float32)
        first *= found
        signs *= found
    turns *= signs.reshape(len(turns), 1, *turns.shape[2:-1], 1)


def _interval_error(session: Session) -> control_grid.IntervalError:
    """Return a function that measures interpolation over an interval, with its ends exact, m."""
    bounds, rng = session.bounds, np.random.default_rng(0)
    base = rng.uniform(bounds.low, bounds.high, (PROBES, len(bounds.low)))
    who = np.repeat(rng.integers(-1, len(samples.names(session.card)), PROBES), 3)

    def error(axis: int, lower: float, upper: float) -> float:
        points = np.repeat(base, 3, axis=0)
        points[:, axis] = np.tile([lower, 0.5 * (lower + upper), upper], PROBES)
        found = vars(samples.sample(session, Queries(points, who), FRAMES // 2))
        ends = [Answers(*(part[row::3] for part in found.values())) for row in range(3)]
        between = session.card, answer_gaps.midway(ends[0], ends[2]), ends[1]
        shares = CURVE_RANGE * answer_gaps.curve_gaps(*between)
        return float(np.maximum(answer_gaps.gaps(*between), shares).max())

    return error


def _support_grid(session: Session) -> ControlGrid:
    controls = len(session.card.controls)
    count = next(n for n in SUPPORT_STEPS if n**controls <= SUPPORT_ROWS or n == SUPPORT_STEPS[-1])
    return control_grid.even(session.bounds, count)
