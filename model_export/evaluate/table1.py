"""Table 1 of the paper, measured again: what to call. Needs the `evaluate` extra."""

from dataclasses import asdict
from typing import Any

from model_export.evaluate.table1_measure import Table1, measure
from model_export.evaluate.table1_text import text

__all__ = ["Table1", "facts", "measure", "text"]


def facts(table: Table1) -> dict[str, Any]:
    """The table as plain numbers, lists and dictionaries, seconds and metres."""
    return asdict(table)
