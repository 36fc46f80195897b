"""Pages of the documentation, and their code blocks."""

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
# Their examples are those of the clients' READMEs, which tests/clients runs.
CLIENT_PAGES = {
    DOCS / name for name in ("reference/python.md", "reference/typescript.md", "guide/run-time.md")
}
FENCE = re.compile(r"^( *)```(\w+)\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)


class Block(NamedTuple):
    """A code block: the word after its fence, and its text without indentation."""

    language: str
    text: str


def pages() -> list[Path]:
    """README.md and all pages of the site, except records of decisions and client READMEs."""
    found = sorted(DOCS.rglob("*.md"))
    own = [path for path in found if path.parent.name != "decisions" and path not in CLIENT_PAGES]
    return [ROOT / "README.md", *own]


def blocks(text: str) -> list[Block]:
    """Return the code blocks of a page."""
    found = []
    for indent, language, body in FENCE.findall(text):
        lines = [line.removeprefix(indent) for line in body.splitlines()]
        found.append(Block(language, "\n".join(lines) + "\n"))
    return found


def identifier(path: Path) -> str:
    """Return the name of a page in test reports."""
    return str(path.relative_to(ROOT))
