"""Values of a model's graph that hold its outputs as rows: one row for each pose or question.

The graph's own reshaping copies them; a reader that knows the number of questions shapes them for
nothing.
"""

from typing import Any

from posefield.common.units import Singles

ROW_VALUES = {
    "rotations": "rotation_rows",
    "root_position": "root_rows",
    "bone_offsets": "offset_rows",
    "duration": "duration_column",
    "sigma": "sigma_columns",
    "travel": "travel_rows",
    "curves": "curve_rows",
}
"""Name of the value with the rows, by output of the graph."""


def shape_rows(output: str, rows: Singles, questions: int, joints: int) -> Any:
    """Return an output of the graph in its shape, from its rows, without a copy.

    questions: B. Rotations are (B, S, J, 4), bone offsets (B, J, 3), durations and sigmas (B,), all
    others (B, S, n).
    """
    if output in ("duration", "sigma"):
        # Sigma has two equal columns, so that its sums have one order (`GraphBuilder.row_sums`).
        return rows[:, 0]
    if output == "rotations":
        return rows.reshape(questions, -1, joints, 4)
    if output == "bone_offsets":
        return rows.reshape(questions, joints, 3)
    return rows.reshape(questions, -1, rows.shape[1])
