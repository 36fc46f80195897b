"""Comparisons in which every method knows the performer, or none does.

A method with the performer's name has an advantage over one without it, so they are compared in
two tables. The table with performers also has peers that ignore the performer. Standard errors are
over takes, because clips of one take resemble each other.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from evaluation.methods import NO_PERFORMER, OPEN
from posefield_train.evaluate import summary
from posefield_train.evaluate.motion_errors import MotionErrors
from posefield_train.evaluate.predictions import OURS
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.report.significant_digits import round_number

KNOWN, LEFT_OPEN = "known", "open"
"""Names of the tables in which every method knows the performer, and none does."""
BETTER, WITHIN, WORSE = "better", "within one standard error", "worse"
DURATION = "duration"
"""Measure whose means are root mean squares."""
MEASURES: dict[str, Callable[[MotionErrors], float]] = {
    "relative": lambda error: error.relative.mean,
    "global": lambda error: error.absolute.mean,
    "effector": lambda error: error.effector,
    DURATION: lambda error: error.duration**2,
}
"""Error of one clip by each measure, m; of the duration the square of its share."""
SCALE = 100.0
"""Factor from metres to centimetres, and from shares to percent."""


def facts(result: EvaluationResult) -> dict[str, Any]:
    """Return the figures of each table: best peers, and the differences from every peer."""
    tables = {}
    for information in (KNOWN, LEFT_OPEN):
        ours, peers = rivals(result, information)
        if not peers:
            continue
        rows = {name: _differences(result, ours, name) for name in peers}
        best = {}
        for measure in MEASURES:
            defined = [row[measure] for row in rows.values() if measure in row]
            if defined:
                best[measure] = min(defined, key=lambda one: one["error"])
        tables[information] = {
            "posefield": ours,
            "takes": len(set(result.recordings)),
            "best": {measure: _rounded(one) for measure, one in best.items()},
            "peers": {
                name: {measure: _rounded(one) for measure, one in row.items()}
                for name, row in rows.items()
            },
        }
    return tables


def rivals(result: EvaluationResult, information: str) -> tuple[str, list[str]]:
    """Return posefield's row and the peers of a table; no peers where the table does not exist."""
    peers = [name for name in result.errors if not name.startswith(OURS)]
    alone = [name for name in peers if name.endswith(OPEN)]
    if information == LEFT_OPEN:
        return (NO_PERFORMER if NO_PERFORMER in result.errors else OURS), alone or peers
    return OURS, peers if alone and NO_PERFORMER in result.errors else []


def _differences(result: EvaluationResult, ours: str, name: str) -> dict[str, dict[str, Any]]:
    compared = {measure: compare(result, measure, ours, name) for measure in MEASURES}
    return {measure: one for measure, one in compared.items() if one}


def compare(result: EvaluationResult, measure: str, ours: str, name: str) -> dict[str, Any] | None:
    """Return the difference of a method from posefield's row `ours` on the clips of both.

    None where the measure is undefined. The verdict is that of posefield.
    """
    clips = sorted(set(result.predicted(ours)) & set(result.predicted(name)))
    squared = measure == DURATION
    mine, theirs = (
        np.array([MEASURES[measure](error) for error in result.of(row, clips)])
        for row in (ours, name)
    )
    if not clips or np.isnan(mine).any() or np.isnan(theirs).any():
        return None
    difference = theirs - mine
    mean = float(difference.mean())
    error = summary.clustered_standard_error(difference, np.array(result.recordings)[clips])
    averages = [float(np.mean(errors)) for errors in (mine, theirs)]
    means = [SCALE * (np.sqrt(average) if squared else average) for average in averages]
    # The difference of squares, given as that of their roots.
    slope = sum(means) / SCALE**2 if squared else 1.0 / SCALE
    return {
        "posefield": means[0],
        "peer": name,
        "error": means[1],
        "difference": means[1] - means[0],
        "standard_error": error / slope if slope > 0.0 else 0.0,
        "verdict": BETTER if mean > error else WORSE if mean < -error else WITHIN,
    }


def _rounded(one: dict[str, Any]) -> dict[str, Any]:
    return {
        key: value if isinstance(value, str) else round_number(value) for key, value in one.items()
    }
