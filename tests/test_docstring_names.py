"""Test that functions and classes which docstrings and comments name in backticks exist."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
DISTRIBUTIONS = ("service/posefield", "model_export/posefield_train")
DOTTED = re.compile(r"`([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+)(?:\(\))?`")
# `recipe.toml` is a file and `asset.extras` a part of one, no name of the code.
NOT_CODE = re.compile(r"\.(py|toml|csv|jsonl?|onnx|proto|usda|usdc|html)$|^asset\.|^bpy\.")


def defined(files):
    """Names that stand in each module and class, by the module's or class's own name."""
    names = {}
    for text in files.values():
        lines = text.splitlines()
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ClassDef):
                body = "\n".join(lines[node.lineno - 1 : node.end_lineno])
                names.setdefault(node.name, set()).update(words(body))
    for path, text in files.items():
        name = path.parent.name if path.name == "__init__.py" else path.stem
        names.setdefault(name, set()).update(words(text))
        names.setdefault(path.parent.name, set()).add(path.stem)
    return names


def words(text):
    return set(re.findall(r"\w+", text))


def unknown(files):
    """Each dotted name in backticks whose parts are not found where it says they are."""
    names = defined(files)
    for path, text in files.items():
        dotted = [found for found in DOTTED.findall(text) if not NOT_CODE.search(found)]
        code = words(DOTTED.sub("", text)) if dotted else set()
        for found in dotted:
            owner, _, last = found.rpartition(".")
            owner = owner.rpartition(".")[2]
            if not (last in names[owner] if owner in names else owner in code):
                yield f"{path.name}: {found}"


def sources():
    files = [path for folder in DISTRIBUTIONS for path in (ROOT / folder).rglob("*.py")]
    return {path: path.read_text() for path in sorted(files)}


def test_docstrings_name_what_exists():
    assert list(unknown(sources())) == []


def test_a_name_that_does_not_exist_is_found():
    text = '"""See `goals.read_all`, `Goals.read` and `numpy.cross`."""\nimport numpy\n'
    goals = "class Goals:\n    def read(self): ...\n"
    files = {Path("a/steps.py"): text, Path("a/goals.py"): goals}
    assert list(unknown(files)) == ["steps.py: goals.read_all"]
