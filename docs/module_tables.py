"""Tables of modules in the architecture pages, made of the first line of each module's docstring.

A page holds `<!-- modules: FOLDER... -->` and `<!-- end of modules -->`; the lines between are
written again. A folder is a path such as posefield/motion; its subfolders follow it.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from page_parts import code, table

ROOT = Path(__file__).resolve().parents[1]
DISTRIBUTIONS = {
    "posefield": ROOT / "service/posefield",
    "posefield_train": ROOT / "model_export/posefield_train",
}
BLOCK = re.compile(r"(<!-- modules: ([\w/ ]+) -->\n).*?(<!-- end of modules -->)", re.DOTALL)


def updated(text: str) -> str:
    """Return the text of a page with the tables of its blocks."""

    def block(found: re.Match[str]) -> str:
        return "\n\n".join([found[1].rstrip("\n"), *_tables(found[2].split()), found[3]])

    return BLOCK.sub(block, text)


def _tables(names: list[str]) -> Iterator[str]:
    for folder in (each for name in names for each in _packages(name)):
        yield f"**`{_name(folder)}`**: {_purpose(folder / '__init__.py')}"
        modules = sorted(each for each in folder.glob("*.py") if each.name != "__init__.py")
        if modules:
            yield table(
                ("module", "purpose"), [(code(each.stem), _purpose(each)) for each in modules]
            )


def _packages(name: str) -> list[Path]:
    """Return a package and all packages in it, outer ones first."""
    distribution, _, rest = name.partition("/")
    inner = (DISTRIBUTIONS[distribution] / rest).rglob("__init__.py")
    return sorted(file.parent for file in inner)


def _name(folder: Path) -> str:
    """Return the path of a package from its distribution on, posefield/motion."""
    (root,) = (root for root in DISTRIBUTIONS.values() if folder.is_relative_to(root))
    return str(folder.relative_to(root.parent))


def _purpose(file: Path) -> str:
    """Return the first paragraph of a module's docstring."""
    found = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8")))
    if not found:
        raise SystemExit(f"{file} has no docstring")
    return " ".join(found.split("\n\n")[0].split())
