"""Rows of Table 1, measured again."""

from rows import Row

from model_export.evaluate import table1_pose, table1_precompute
from model_export.evaluate.table1_measure import CORE_GOAL, SHOWN, Table1


def rows(table: Table1) -> list[Row]:
    """Precomputation and poses against every naive form, and compression at the thresholds."""
    return [
        *(
            Row(
                f"precompute at {SHOWN}: {table1_precompute.OURS}",
                1e3 * one.ours,
                "ms",
                one.words,
                one.ratio,
                one.goal,
            )
            for one in table.precompute
        ),
        *(
            Row(
                f"pose at {SHOWN}, compiled: {table1_pose.OURS}",
                1e6 * one.ours,
                "µs",
                one.words,
                one.ratio,
                one.goal,
            )
            for one in table.pose
        ),
        *(
            Row(
                f"tensor within {size.asked} of full rank, summed over joints and frames",
                float(size.ranks[0] * size.ranks[1] * size.ranks[2]),
                "numbers in the core",
                f"the raw tensor; all stored, {size.stored:.0f} times",
                size.core,
                CORE_GOAL if size.asked.startswith("500 ") else None,
            )
            for size in table.sizes
        ),
    ]
