"""Poses of many characters at one time each, in a few large calls of the graph per level of detail.

All work is on whole columns, without a loop over characters. Errors name the index of a character.
"""

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.units import (
    Booleans,
    Floats,
    Frames,
    Indices,
    PointControls,
    PointLabels,
    Singles,
)
from posefield.inference import level_selection, onnx_runtime
from posefield.inference.level_selection import LevelCriteria, LevelTable
from posefield.model_file.model_card import ModelCard
from posefield.motion import curves, hinges, quat, skeleton
from posefield.motion.clip import CrowdPoses, Placement
from posefield.synthesis.synthesizer import NO_DETAIL, Synthesizer
from posefield.validation import crowd_validation
from posefield.validation.crowd_validation import Blending, CharacterTakes, CrowdQuestion


def pose_takes(
    model: Synthesizer,
    takes: CharacterTakes,
    controls: PointControls,
    times: Annotated[Floats, "points 1"],
    labels: PointLabels,
    level: int,
) -> tuple[
    Annotated[Floats, "points joints 4"],
    Annotated[Floats, "points 3"],
    Annotated[Floats, "points curves"],
]:
    """Return rotations (N, J, 4), root positions (N, 3), m, and values (N, C) of the curves.

    The characters are in their own frames.

    controls (N, d), times (N, 1), s, and labels (N, p) are those of the characters.
    """
    corrector = model.solver.corrector(level)
    reduced, (r2, r1, _) = corrector.reduced, corrector.reduced.core.shape
    names = (
        ("coefficients", "frame", "way") if model.session.card.cyclic else ("coefficients", "frame")
    )
    arrays = model.session.run(controls, times, *names, labels=labels, level=level)
    coefficients, frame_column, *ways = (array.astype(float) for array in arrays)
    frames, travel = frame_column[:, 0], ways[0] if ways else np.zeros((len(controls), 3))
    motions = coefficients @ reduced.core.reshape(r2 * r1, -1).T
    predicted = np.einsum("nt,ntd->nd", reduced.rows(frames), motions.reshape(-1, r2, r1))
    changes = model.solver.variation.changes(corrector, controls, labels, takes.seeds)
    motions += takes.variety[:, None] * changes[:, : r2 * r1]
    moves = np.einsum("nt,ntd->nd", reduced.rows(frames), motions.reshape(-1, r2, r1))
    moves += _details(model, takes, frames, level)
    numbers = reduced.mean + moves @ reduced.directions
    end, rotations = 3 + 3 * len(reduced.rotations), reduced.turns(numbers)
    limits = hinges.from_card(model.session.card.hinges)
    if len(limits):
        centres = limits.turn_angles(reduced.joint_turns(predicted, limits.joints))
        rotations = limits.within(rotations, centres)
    share = frames / (reduced.frames - 1)
    turned, path = skeleton.add_travel(rotations, numbers[:, :3], share[:, None] * travel)
    return turned, path, curves.clamp(model.session.card.curves, numbers[:, end:])


def detail_warnings(model: Synthesizer, takes: CharacterTakes | None) -> tuple[str, ...]:
    """Return a warning if characters ask for detail and the model's file has none."""
    missing = takes is not None and takes.detail.any() and not model.session.card.making.detail
    return (NO_DETAIL,) if missing else ()


def _details(
    model: Synthesizer, takes: CharacterTakes, frames: Frames, level: int
) -> Annotated[Floats, "points freedoms"]:
    """Return the details (N, r1) of the characters at their canonical frames (N,)."""
    corrector = model.solver.corrector(level)
    details = np.zeros((len(frames), len(corrector.reduced.directions)))
    for seed in np.unique(takes.seeds[takes.detail]):
        cancellation.check()
        rows = np.flatnonzero(takes.detail & (takes.seeds == seed))
        sampled = model.solver.variation.detail(corrector, int(seed))
        details[rows] = quat.interpolate_rows(sampled, frames[rows])
    return details


# Share of a clip's duration: the float32 rounding of a time that a client read from an answer.
SLACK = 1e-5
# Durations differ between levels, and a client does not know the level that its time is checked
# against where a view chooses levels or two levels are blended.
COARSE_SLACK = 0.1

# Smaller calls are dominated by their overhead and that of threads; larger ones exceed a core's
# cache between operators, and a pose of a walk costs up to eight times as much. The number of calls
# is fixed, not the number of cores: rounding depends on it.
FEWEST_ROWS, MOST_ROWS, CALLS = 512, 1536, 8

# Threads suffice: onnxruntime and NumPy release the interpreter lock while they compute.
_WORKERS = ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="crowd")


@dataclass(frozen=True)
class _GraphInputs:
    """Inputs of the graph: controls (N, d), times (N, 1) and labels (N, p); and takes.

    seeds, variety, detail (N,): of the characters' takes.
    """

    controls: Singles
    times: Singles
    labels: Singles
    seeds: Indices
    variety: Floats
    detail: Booleans

    def __len__(self) -> int:
        return len(self.times)

    def rows(self, which: Indices) -> "_GraphInputs":
        """Return the rows at these indices."""
        return _GraphInputs(*(column[which] for column in vars(self).values()))


@dataclass(frozen=True)
class _GraphOutputs:
    """Outputs of the graph for N characters, each in the frame of its own clip.

    curves: (N, C); None for a model without them.
    """

    rotations: Singles
    root_position: Singles
    bone_offsets: Singles
    duration: Singles
    sigma: Singles
    travel: Singles
    curves: Singles | None = None

    @property
    def arrays(self) -> dict[str, Singles]:
        """Return the outputs that the graph has, by name."""
        return {name: array for name, array in vars(self).items() if array is not None}


def synthesize_crowd(model: Synthesizer, question: CrowdQuestion) -> CrowdPoses:
    """Return the poses of a crowd, placed where its characters stand.

    With a view, distances are measured to the characters' placements. Raises InvalidField and
    OutsideSamples as `poses.synthesize_poses` does for one character, with the index of the first
    character at fault.
    """
    card = model.session.card
    controls, supported, warnings = crowd_validation.check_controls(
        card, model.validator.support, question
    )
    labels = crowd_validation.labels(question, card)
    crowd_validation.check_levels(question, len(card.levels))
    early = question.times < 0.0
    crowd_validation.raise_for_first("time", question.times, early, "s, expected 0 s or later")
    levels, error_px, budget_warnings = _levels(model, question)
    takes = crowd_validation.check_takes(card, question)
    inputs = _GraphInputs(
        controls.astype(np.float32),
        question.times.astype(np.float32)[:, None],
        labels,
        *vars(takes).values(),
    )
    block = _run_graph(model, inputs, levels)
    if question.blending is not None:
        _blend(model, inputs, block, levels, question.blending)
    crowd_validation.check_durations(card, block.duration)
    exact = (
        (levels == 0)
        & (not isinstance(question.detail, LevelCriteria))
        & (question.blending is None)
    )
    slack = np.where(exact, SLACK, COARSE_SLACK)
    crowd_validation.check_times(question.times, block.duration, slack)
    if question.root == "in_place":
        block.root_position[:, [0, 2]] -= block.travel[:, :2]
        _turn_roots(block, -block.travel[:, 2])
    _place(block, question.placement)
    return CrowdPoses(
        model.identity,
        card.skeleton,
        block.rotations,
        block.root_position,
        block.bone_offsets,
        levels,
        error_px,
        block.duration,
        block.sigma,
        supported,
        (*warnings, *budget_warnings, *detail_warnings(model, question.takes)),
        tuple(curve.name for curve in card.curves),
        block.curves,
    )


def _levels(
    model: Synthesizer, question: CrowdQuestion
) -> tuple[Indices, Singles | None, tuple[str, ...]]:
    """Return levels (N,), the pixels (N,) of their errors (None without a view), and warnings."""
    if not isinstance(question.detail, LevelCriteria):
        return question.detail, None, ()
    ladder, view = model.level_table, question.detail
    middle = question.placement.positions + model.rest_position
    scale = level_selection.pixels_per_metre(view.camera, middle, model.radius)
    if question.blending is None or view.previous is None:
        choice = level_selection.select_levels(ladder, scale, view)
        levels, warnings = choice.levels, level_selection.budget_warnings(choice, ladder, view)
    else:
        levels, warnings = _levels_in_transition(
            ladder, scale, view, view.previous, question.blending
        )
    return levels, (ladder.errors[levels] * scale).astype(np.float32), warnings


def _levels_in_transition(
    ladder: LevelTable, scale: Floats, view: LevelCriteria, previous: Indices, blending: Blending
) -> tuple[Indices, tuple[str, ...]]:
    """Return levels (N,) and warnings where some characters are in a transition between two levels.

    Characters in transition keep their level; the costs of their two poses are subtracted from the
    budget of the others.
    """
    free = blending.shares >= 1.0
    levels, budget = previous.copy(), view.budget
    if budget is not None:
        spent = ladder.costs[previous[~free]] + ladder.costs[blending.levels[~free]]
        budget = max(budget - float(spent.sum()), 0.0)
    if not free.any():
        return levels, ()
    rest = replace(view, previous=previous[free], budget=budget)
    choice = level_selection.select_levels(ladder, scale[free], rest)
    levels[free] = choice.levels
    return levels, level_selection.budget_warnings(choice, ladder, rest)


def _run_graph(model: Synthesizer, inputs: _GraphInputs, levels: Indices) -> _GraphOutputs:
    block = _empty_outputs(model.session.card, len(inputs))

    def fill(call: tuple[int, Indices | slice]) -> None:
        level, rows = call
        columns, labels = (inputs.controls[rows], inputs.times[rows]), inputs.labels[rows]
        answers = model.session.run(*columns, *block.arrays, labels=labels, level=level)
        for (name, column), answer in zip(block.arrays.items(), answers, strict=True):
            column[rows] = answer[:, 0] if name in _PER_TIME else answer
        _pose_takes(model, inputs, block, level, np.arange(len(inputs))[rows])

    # A list first: workers do not wait for parts. Reading the results raises the workers' errors.
    calls = list(_calls(levels))
    run = _WORKERS.map if len(calls) > 1 else map
    list(run(cancellation.bind_context(fill), calls))
    return block


def _pose_takes(
    model: Synthesizer, inputs: _GraphInputs, block: _GraphOutputs, level: int, rows: Indices
) -> None:
    """Replace the poses of those of the characters that have a take, in place."""
    varied = rows[(inputs.seeds[rows] > 0) | inputs.detail[rows]]
    if len(varied):
        rows_inputs = inputs.rows(varied)
        takes = CharacterTakes(rows_inputs.seeds, rows_inputs.variety, rows_inputs.detail)
        columns = (
            rows_inputs.controls.astype(float),
            rows_inputs.times.astype(float),
            rows_inputs.labels.astype(float),
        )
        turned, path, values = pose_takes(model, takes, *columns, level)
        block.rotations[varied], block.root_position[varied] = turned, path
        if block.curves is not None:
            block.curves[varied] = values


def _empty_outputs(card: ModelCard, count: int) -> _GraphOutputs:
    joints = len(card.skeleton)
    shapes = [(joints, 4), (3,), (joints, 3), (), (), (3,)]
    shapes += [(len(card.curves),)] if card.curves else []
    return _GraphOutputs(*(np.empty((count, *shape), np.float32) for shape in shapes))


def _blend(
    model: Synthesizer,
    inputs: _GraphInputs,
    block: _GraphOutputs,
    levels: Indices,
    blending: Blending,
) -> None:
    """Blend poses of the previous levels into those of characters in transition, in place."""
    rows = np.flatnonzero((blending.shares < 1.0) & (blending.levels != levels))
    if len(rows):
        before = _run_graph(model, inputs.rows(rows), blending.levels[rows])
        shares = blending.shares[rows].astype(np.float32)
        for name, column in block.arrays.items():
            mixing = quat.nlerp if name == "rotations" else quat.lerp
            column[rows] = mixing(getattr(before, name), column[rows], shares)
        if block.curves is not None:
            # Rounding of the blend may leave the limits.
            blended = block.curves[rows].astype(np.float64)
            block.curves[rows] = curves.clamp(model.session.card.curves, blended)


_PER_TIME = ("rotations", "root_position", "travel", onnx_runtime.CURVES)


def _calls(levels: Indices) -> Iterator[tuple[int, Indices | slice]]:
    """Yield the level and rows of each call; contiguous rows as a slice."""
    largest = min(max(len(levels) // CALLS, FEWEST_ROWS), MOST_ROWS)
    for level in np.unique(levels).tolist():
        rows = np.flatnonzero(levels == level)
        for batch in np.array_split(rows, -(-len(rows) // largest)):
            together = batch[-1] - batch[0] + 1 == len(batch)
            yield level, slice(batch[0], batch[-1] + 1) if together else batch


def _place(block: _GraphOutputs, placement: Placement) -> None:
    """Move the poses to the characters' positions and headings, in place."""
    # Within one turn, where float32 still resolves small angles.
    angles = np.remainder(placement.headings, 2.0 * np.pi).astype(np.float32)
    _turn_roots(block, angles)
    _turn_paths(block, angles)
    np.add(block.root_position, placement.positions, out=block.root_position, casting="same_kind")


def _turn_paths(block: _GraphOutputs, angles: Singles) -> None:
    """Rotate the root positions about the vertical through each origin, in place."""
    cos, sin = np.cos(angles), np.sin(angles)
    x, z = block.root_position[:, 0].copy(), block.root_position[:, 2].copy()
    block.root_position[:, 0], block.root_position[:, 2] = cos * x + sin * z, cos * z - sin * x


def _turn_roots(block: _GraphOutputs, angles: Singles) -> None:
    """Rotate the root orientations about the vertical, in place."""
    cos, sin = np.cos(0.5 * angles)[:, None], np.sin(0.5 * angles)[:, None]
    root = block.rotations[:, 0]
    # The quaternion product of (cos, 0, sin, 0) with (w, x, y, z).
    across = np.stack([-root[:, 2], root[:, 3], root[:, 0], -root[:, 1]], axis=1)
    block.rotations[:, 0] = cos * root + sin * across
