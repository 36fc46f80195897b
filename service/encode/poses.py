"""Poses as tables of one row per time."""

from typing import Any

from service.encode.tables import Table, single
from service.motion.answer import PoseAnswer


def table(answer: PoseAnswer[Any]) -> Table:
    """Return a table of S rows; bone offsets are one array for all times."""
    return Table(
        {
            "times": answer.times,
            "rotations": single(answer.rotations),
            "root_position": single(answer.root_position),
        },
        {"trust": answer.trust.facts()},
        {"bone_offsets": single(answer.bone_offsets)},
    )
