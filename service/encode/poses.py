"""Poses as a table, one row a time."""

from typing import Any

from service.encode.tables import Table, single
from service.motion.answer import PoseAnswer


def table(answer: PoseAnswer[Any]) -> Table:
    """Table of S rows; bone offsets hold for all times."""
    return Table(
        {
            "times": answer.times,
            "rotations": single(answer.rotations),
            "root_position": single(answer.root_position),
        },
        {"trust": answer.trust.facts()},
        {"bone_offsets": single(answer.bone_offsets)},
    )
