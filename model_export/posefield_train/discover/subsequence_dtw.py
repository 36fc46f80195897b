"""Subsequence dynamic time warping: where in a corpus a short motion is found.

Steps advance by (1, 1), (1, 2) or (2, 1) frames of query and corpus, so that a match lasts half as
long as the query to twice as long (Müller, Information Retrieval for Music and Motion, 2007,
section 4.4). No step stays in a frame of the query, so that a row depends on earlier rows only.
"""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Booleans, Floats, Indices

STEPS = ((1, 1), (1, 2), (2, 1))
"""Frames of query and corpus by which a match advances."""


@dataclass(frozen=True)
class Ends:
    """Best match for each last frame of the corpus.

    costs (F,): mean distance over the frames of the query; inf without a match. starts (F,): first
    frame of the match.
    """

    costs: Floats
    starts: Indices


@dataclass(frozen=True)
class SearchedFrames:
    """Features of a corpus as every search needs them.

    values (F, k): zero where frames stand between two takes. squares (F,): of their lengths.
    between (F,): whether a frame stands between two takes.
    """

    values: Floats
    squares: Floats
    between: Booleans


def searched_frames(corpus: Floats) -> SearchedFrames:
    """Return the features (F, k) of a corpus for searches; NaN stands between two takes."""
    known = np.nan_to_num(corpus)
    return SearchedFrames(known, np.sum(np.square(known), axis=1), np.isnan(corpus[:, 0]))


def distances(query: Floats, corpus: SearchedFrames) -> Floats:
    """Return the distances (L, F) of features (L, k) of a query from those of a corpus.

    The distance of a frame between two takes is inf.
    """
    found = np.sum(np.square(query), axis=1)[:, None] + corpus.squares
    found -= 2.0 * query @ corpus.values.T
    np.sqrt(np.maximum(found, 0.0, out=found), out=found)
    found[:, corpus.between] = np.inf
    return found


def match_ends(apart: Floats) -> Ends:
    """Return the best match that ends at each frame of the corpus.

    apart (L, F): distances of the query's frames from the corpus's; inf between two takes.
    """
    length, frames = apart.shape
    starts = np.arange(frames)
    before: tuple[Floats, Indices] | None = None
    last = apart[0], starts
    for at in range(1, length):
        own = apart[at]
        costs = np.full(frames, np.inf)
        costs[1:] = last[0][:-1] + own[1:]
        origin = np.zeros(frames, dtype=np.int64)
        origin[1:] = last[1][:-1]
        _take_better((costs, origin), last, 2, own)
        if before is not None:
            _take_better((costs, origin), before, 1, own + apart[at - 1])
        before, last = last, (costs, origin)
    costs, starts = last
    return Ends(costs / length, starts)


def _take_better(
    best: tuple[Floats, Indices], row: tuple[Floats, Indices], step: int, added: Floats
) -> None:
    """Replace the best costs and starts where those of a row, `step` frames later, cost less."""
    costs = row[0][:-step] + added[step:]
    better = costs < best[0][step:]
    np.copyto(best[0][step:], costs, where=better)
    np.copyto(best[1][step:], row[1][:-step], where=better)


def align(apart: Floats) -> Indices:
    """Return for each frame of the query (L,) the frame of a clip (F,) that is most like it.

    apart (L, F): distances. The first frames are alike, and the last ones; steps are those of a
    match. A frame of the query that a step leaves out shares the frame after. Raises ValueError
    for a clip that lasts less than half as long as the query, or more than twice.
    """
    length, frames = apart.shape
    costs = np.full((length, frames), np.inf)
    steps = np.zeros((length, frames), dtype=np.int64)
    costs[0, 0] = apart[0, 0]
    for at in range(1, length):
        choices = np.full((len(STEPS), frames), np.inf)
        choices[0, 1:] = costs[at - 1, :-1]
        choices[1, 2:] = costs[at - 1, :-2]
        if at > 1:
            choices[2, 1:] = costs[at - 2, :-1] + apart[at - 1, 1:]
        steps[at] = np.argmin(choices, axis=0)
        costs[at] = choices.min(axis=0) + apart[at]
    if not np.isfinite(costs[-1, -1]):
        raise ValueError(f"{frames} frames, expected {length // 2 + 1} to {2 * length - 1}")
    return _path(steps)


def _path(steps: Indices) -> Indices:
    """Return the frames (L,) of the best path, from the step (L, F) that led to each place."""
    row, column = steps.shape[0] - 1, steps.shape[1] - 1
    found = np.zeros(row + 1, dtype=np.int64)
    while row > 0:
        rows, columns = STEPS[steps[row, column]]
        found[row - rows + 1 : row + 1] = column
        row, column = row - rows, column - columns
    return found
