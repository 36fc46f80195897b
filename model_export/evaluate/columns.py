"""Tables in Markdown that are even for who reads them as they are."""

from collections.abc import Sequence


def even(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table with all cells of a column of one width."""
    listed = [head, *rows]
    widths = [max(len(row[i]) for row in listed) for i in range(len(head))]
    lines = [
        "| " + " | ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)) + " |"
        for row in listed
    ]
    rule = "|" + "|".join("-" * (width + 2) for width in widths) + "|"
    return "\n".join([lines[0], rule, *lines[1:]])
