"""Tests of the documents: targets of links exist."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = [
    *ROOT.glob("*.md"),
    *(ROOT / "clients").glob("*/README.md"),
    ROOT / "tests/README.md",
]


def missing(text: str, folder: Path) -> list[str]:
    """Files of the project that a text links to or shows, and that are not there."""
    linked = re.findall(r"\]\(([^)#\s]+)[^)]*\)", text)
    own = [link for link in linked if not re.match(r"[a-z]+:", link)]
    return [link for link in own if not (folder / link).exists()]


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_what_is_linked_is_there(path):
    assert missing(path.read_text(), path.parent) == []


def test_a_file_that_is_not_there_would_be_missed():
    text = "![a](docs/none.png) and [b](README.md#two-commands), [c](https://a.example/none)"
    assert missing(text, ROOT) == ["docs/none.png"]
