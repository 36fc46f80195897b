"""Tests of the documents: targets of links, and files and modules that they name, exist."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = [
    *ROOT.glob("*.md"),
    *(ROOT / "clients").glob("*/README.md"),
    ROOT / "tests/README.md",
    *(ROOT / "docs").rglob("*.md"),
]
# The change log names files and modules of its versions.
CURRENT = [path for path in DOCUMENTS if path.name != "CHANGELOG.md"]
SOURCES = {
    "posefield": ROOT / "service/posefield",
    "posefield_train": ROOT / "model_export/posefield_train",
}
# Folders that paths may be relative to, besides the document's own.
BASES = (
    ROOT,
    *SOURCES.values(),
    SOURCES["posefield"] / "http",
    ROOT / "tests",
    ROOT / "clients/python",
)
# Words that begin with one of FOLDERS or end in one of ENDINGS are paths, unlike media types.
ENDINGS = {"conf", "css", "html", "json", "md", "py", "sh", "toml", "ts", "yaml"}
FOLDERS = {
    *(path.name for base in BASES for path in base.iterdir() if path.is_dir()),
    # Folders of earlier versions.
    *("exact", "export", "walk", "web"),
}
MODULE = re.compile(r"(posefield(?:_train)?)((?:\.\w+)+(?::\w+)?)")
CODE = (*SOURCES.values(), *(ROOT / name for name in ("benchmarks", "clients/python", "tests")))
FILES = {path.name for folder in CODE for path in folder.rglob("*.py")}


def missing(text: str, folder: Path) -> list[str]:
    """Files of the project that a text links to or shows, and that are not there."""
    linked = re.findall(r"\]\(([^)#\s]+)[^)]*\)", text)
    own = [link for link in linked if not re.match(r"[a-z]+:", link)]
    return [link for link in own if not (folder / link).exists()]


def unknown_names(text: str, folder: Path) -> list[str]:
    """Paths and modules that a text names in backticks, and that do not exist."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    words = [word for span in re.findall(r"`([^`]+)`", text) for word in span.split()]
    paths = [word for word in words if is_path(word) and not path_exists(word, folder)]
    modules = [word for word in words if MODULE.fullmatch(word) and not module_exists(word)]
    return paths + modules


def is_path(word: str) -> bool:
    """True for the name of a Python file, and for a path relative to one of BASES."""
    if not re.fullmatch(r"[\w.-][\w./*-]*/[\w./*-]*", word):
        return bool(re.fullmatch(r"\w+\.py", word))
    return word.partition("/")[0] in FOLDERS or word.rpartition(".")[2] in ENDINGS


def path_exists(word: str, folder: Path) -> bool:
    """True for files, modules without their ending, and files that git ignores, as built ones."""
    if "/" not in word:
        return word in FILES
    endings = ("", ".*") if "." not in Path(word).name else ("",)
    if any(any(base.glob(word + ending)) for base in (folder, *BASES) for ending in endings):
        return True
    ignored = subprocess.run(["git", "check-ignore", "--quiet", word], cwd=ROOT, check=False)
    return ignored.returncode == 0


def module_exists(word: str) -> bool:
    """True for a package, a module, or a name that is defined at the top of one."""
    matched = MODULE.fullmatch(word)
    assert matched
    place = SOURCES[matched[1]]
    parts = re.split("[.:]", matched[2])[1:]
    while parts and (place / parts[0]).is_dir():
        place /= parts.pop(0)
    if parts and (module := place / f"{parts[0]}.py").exists():
        place = module
        parts.pop(0)
    file = place / "__init__.py" if place.is_dir() else place
    names = rf"^(?:(?:async )?def |class )?{parts[0]}\b" if parts else ""
    return len(parts) < 2 and bool(re.search(names, file.read_text(), re.MULTILINE))


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_what_is_linked_is_there(path):
    assert missing(path.read_text(), path.parent) == []


def test_a_file_that_is_not_there_would_be_missed():
    text = "![a](docs/none.png) and [b](README.md#install), [c](https://a.example/none)"
    assert missing(text, ROOT) == ["docs/none.png"]


@pytest.mark.parametrize("path", CURRENT, ids=lambda path: str(path.relative_to(ROOT)))
def test_files_and_modules_in_backticks_exist(path):
    assert unknown_names(path.read_text(), path.parent) == []


@pytest.mark.parametrize(
    ("text", "unknown"),
    [
        ("`service/posefield/none.py` and `http/app.py`", "service/posefield/none.py"),
        ("`keeper.py` beside `quat.py`", "keeper.py"),
        ("`posefield.http.app.none`, `posefield.http.app.build_app`", "posefield.http.app.none"),
        ("`posefield.cli:none`, `posefield.cli:main`", "posefield.cli:none"),
        ("`application/x-bvh`, `s3://bucket`, `a / b`, `read:*`, `build/models/a.onnx`", None),
        ("```sh\nposefield train `none/recipe.toml`\n```", None),
    ],
)
def test_a_name_that_does_not_exist_is_found(text, unknown):
    """Negative control of the test above."""
    assert unknown_names(text, ROOT) == ([unknown] if unknown else [])


def test_the_index_of_decisions_lists_every_record():
    folder = ROOT / "docs/decisions"
    index = (folder / "README.md").read_text()
    listed = re.findall(r"\]\((\d{4}-[^)]*)\)", index)
    records = sorted(folder.glob("[0-9]*.md"))
    assert sorted(listed) == [path.name for path in records]
    assert [path.name for path in records if len(path.read_text().splitlines()) > 40] == []
    hidden = [
        path for path in records if path.read_text().startswith("---\nsearch:\n  exclude: true\n")
    ]
    assert hidden == records
