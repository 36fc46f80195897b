"""Write the pages of the documentation that repeat what the code, the contract or a JSON file says.

python docs/generate.py writes them; with --check it prints the pages that differ, and exits 1.
"""

import ast
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import code_pages
import data_pages
import runtime_parts
from page_parts import code, table

DOCS = Path(__file__).parent
OVERVIEW = "architecture/00-overview.md"
DISTRIBUTIONS = ("service/posefield", "model_export/posefield_train")
PAGES: dict[str, Callable[[], str]] = {
    OVERVIEW: lambda: overview(),
    "../clients/runtime/src/constants.ts": runtime_parts.constants,
    "guide/run-time.md": lambda: data_pages.client("runtime"),
    "operate/settings.md": code_pages.settings,
    "reference/cli.md": code_pages.commands,
    "reference/problems.md": code_pages.problems,
    "reference/table-columns.md": code_pages.columns,
    "reference/recipe-keys.md": data_pages.recipe_keys,
    "reference/api.md": data_pages.api,
    "reference/python.md": lambda: data_pages.client("python"),
    "reference/typescript.md": lambda: data_pages.client("typescript"),
    "results/quality.md": lambda: data_pages.results("quality"),
    "results/targets.md": lambda: data_pages.results("targets"),
    "results/feet.md": lambda: data_pages.results("feet"),
    "results/support.md": lambda: data_pages.results("support"),
    "results/performances.md": lambda: data_pages.results("performances"),
    "results/pedestrians.md": lambda: data_pages.results("pedestrians"),
    "results/discovery.md": lambda: data_pages.results("discovery"),
    "results/scale.md": lambda: data_pages.results("scale"),
    "results/robots.md": lambda: data_pages.results("robots"),
    "results/speed.md": lambda: data_pages.results("speed"),
}


def main() -> None:
    """Write all pages, or check that they are up to date."""
    texts = {name: text() for name, text in PAGES.items()}
    stale = [name for name, text in texts.items() if content(DOCS / name) != text]
    if "--check" in sys.argv[1:]:
        for name in stale:
            print(f"docs/{name} differs: run docs/generate.py")
        sys.exit(bool(stale))
    for name in stale:
        (DOCS / name).write_text(texts[name], encoding="utf-8")
        print(f"docs/{name} written")


def overview() -> str:
    """Return the overview of the architecture with its table of packages made anew."""
    text = (DOCS / OVERVIEW).read_text(encoding="utf-8")
    rows = table(("package", "purpose"), packages())
    return re.sub(
        r"(<!-- packages -->\n).*(<!-- end of packages -->)",
        lambda block: f"{block[1]}\n{rows}\n\n{block[2]}",
        text,
        flags=re.DOTALL,
    )


def packages() -> Iterator[tuple[str, str]]:
    """Yield path and purpose of each package of both distributions."""
    for root in DISTRIBUTIONS:
        for file in sorted((DOCS.parent / root).glob("*/__init__.py")):
            said = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8")))
            if not said:
                raise SystemExit(f"{file} has no docstring")
            path = file.parent.relative_to((DOCS.parent / root).parent)
            yield code(path), " ".join(said.split("\n\n")[0].split())


def content(file: Path) -> str | None:
    """Return the text of a file, None if it does not exist."""
    return file.read_text(encoding="utf-8") if file.exists() else None


if __name__ == "__main__":
    main()
