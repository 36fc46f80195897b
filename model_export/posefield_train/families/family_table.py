"""Table of the clips of a family: a CSV file beside the family's recipe."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from posefield.common.errors import RecipeError
from posefield_train.source import clip_table

COLUMNS = ("file", "first_frame", "last_frame", "performer", "take", "cost", "accepted")


@dataclass(frozen=True)
class FamilyRow:
    """A clip of a family.

    file: below the folder of the takes. first_frame, last_frame: inclusive. take: clips of one are
    left out together. cost: of the match with the example, None for a stride. accepted: whether it
    is trained from.
    """

    file: str
    first_frame: int
    last_frame: int
    performer: str
    take: str
    cost: float | None = None
    accepted: bool = True

    @property
    def frames(self) -> tuple[str, int, int]:
        """Return the file with the first and the last frame."""
        return self.file, self.first_frame, self.last_frame


def table(rows: Sequence[FamilyRow]) -> bytes:
    """Return the table as CSV."""
    lines = io.StringIO(newline="")
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        cost = "" if row.cost is None else f"{row.cost:.4f}"
        told = (row.performer, row.take, cost, str(row.accepted).lower())
        writer.writerow([*row.frames, *told])
    return lines.getvalue().encode()


def read(path: Path) -> list[FamilyRow]:
    """Return the rows of a table; RecipeError names a cell that cannot be read."""
    cells = clip_table.open_table(path)
    cells.require(dict.fromkeys(COLUMNS, "the table of a family"))
    rows = []
    for line, record in cells.records:
        if record["accepted"] not in ("true", "false"):
            said = f"column 'accepted': {record['accepted']!r}, expected true or false"
            raise RecipeError(path, said, line)
        first, last = (cells.frame(line, record, key) for key in ("first_frame", "last_frame"))
        cost = cells.number(line, record, "cost") if record["cost"] else None
        accepted = record["accepted"] == "true"
        told = (record["file"], first, last, record["performer"], record["take"])
        rows.append(FamilyRow(*told, cost, accepted))
    return rows
