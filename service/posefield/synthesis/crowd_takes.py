"""Takes of the characters of a crowd: their poses, computed in NumPy from the graph's values.

Durations and travel stay those of the prediction, so that characters stay where a plan puts them.
"""

from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.array_shapes import Frames, PointControls, PointLabels
from posefield.common.units import Floats
from posefield.motion import blend, curves, root_travel
from posefield.synthesis.synthesizer import NO_DETAIL, Synthesizer
from posefield.validation.crowd_validation import CharacterTakes


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
    bench = model.solver.corrector(level)
    reduced, (r2, r1, _) = bench.reduced, bench.reduced.core.shape
    coefficients, frames, travel = model.session.states(controls, times, labels, level)
    motions = coefficients @ reduced.core.reshape(r2 * r1, -1).T
    changes = model.solver.variation.changes(bench, controls, labels, takes.seeds)
    motions += takes.variety[:, None] * changes[:, : r2 * r1]
    moves = np.einsum("nt,ntd->nd", reduced.rows(frames), motions.reshape(-1, r2, r1))
    moves += _details(model, takes, frames, level)
    numbers = reduced.mean + moves @ reduced.directions
    end, rotations = 3 + 3 * len(reduced.rotations), reduced.turns(numbers)
    share = frames / (reduced.frames - 1)
    turned, path = root_travel.add_travel(rotations, numbers[:, :3], share[:, None] * travel)
    return turned, path, curves.clamp(model.session.card.curves, numbers[:, end:])


def detail_warnings(model: Synthesizer, takes: CharacterTakes | None) -> tuple[str, ...]:
    """Return a warning if characters ask for detail and the model's file has none."""
    missing = takes is not None and takes.detail.any() and not model.session.card.making.detail
    return (NO_DETAIL,) if missing else ()


def _details(
    model: Synthesizer, takes: CharacterTakes, frames: Frames, level: int
) -> Annotated[Floats, "points freedoms"]:
    """Return the details (N, r1) of the characters at their canonical frames (N,)."""
    bench = model.solver.corrector(level)
    found = np.zeros((len(frames), len(bench.reduced.directions)))
    for seed in np.unique(takes.seeds[takes.detail]):
        cancellation.check()
        rows = np.flatnonzero(takes.detail & (takes.seeds == seed))
        sampled = model.solver.variation.detail(bench, int(seed))
        found[rows] = blend.interpolate_rows(sampled, frames[rows])
    return found
