"""Tests of the structure of both distributions: folders, their arrows, and names of modules."""

import ast
import re
from collections import defaultdict
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DISTRIBUTIONS = ("service/posefield", "model_export/posefield_train")

BUDGETS = {
    "service/posefield": 49_930,
    "model_export/posefield_train": 27_800,
    "clients/python": 2_160,
    "clients/blender": 1_280,
    "clients/viewer/src": 7_870,
    "clients/typescript/src": 1_350,
    "clients/runtime/src": 2_600,
    "clients/page/src": 600,
}
"""Most lines of each part, without generated ones: who needs more takes lines away elsewhere."""
VAGUE = set(
    "own found made said given asked told laid moved judge held missed every each apart seen "
    "wanted least most known named place places others whom who kept taken part parts shown drawn "
    "written usual beside ends whole begun way ahead bench rung shop".split()
)
MOST_VAGUE = 0.004
"""Share of the bindings of what ships whose names say nothing of the thing."""
GENERATED = {"generated.py", "client.py", "schema.ts", "constants.ts"}
MOST_TESTS = 0.725
"""Lines of Python under tests for each line that ships."""


@dataclass
class Code:
    """Modules by dotted name, and the modules that each imports."""

    files: dict[str, Path] = field(default_factory=dict)
    imports: dict[str, set[str]] = field(default_factory=dict)

    def modules(self):
        """Modules that are not packages."""
        return {name: file for name, file in self.files.items() if file.name != "__init__.py"}

    def folder(self, name):
        """Package of a module, with its sub-packages; the top package for its own modules."""
        parts = name.split(".")
        return ".".join(parts[:2]) if self.files[name].parent.name != parts[0] else parts[0]


def read(root):
    code = Code()
    for distribution in DISTRIBUTIONS:
        for file in sorted((root / distribution).rglob("*.py")):
            parts = file.relative_to((root / distribution).parent).with_suffix("").parts
            code.files[".".join(parts).removesuffix(".__init__")] = file
    for name, file in code.files.items():
        code.imports[name] = set(imported(file, code.files))
    return code


def imported(file, known):
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                if inner in known:
                    yield inner
                elif node.module in known:
                    yield node.module


def faults(code):
    """A line for each breach of the rules."""
    yield from repeated_names(code)
    yield from circles(code)


def repeated_names(code):
    named = defaultdict(list)
    for module in code.modules():
        named[module.rpartition(".")[2]].append(module)
    yield from (f"one name: {', '.join(own)}" for own in named.values() if len(own) > 1)


def circles(code):
    """Circles of modules, and of folders: of two that import each other, or of more."""
    between = defaultdict(set)
    for module, others in code.imports.items():
        for other in others:
            # The version stands in the top package, which every module imports anyway.
            if code.folder(module) != code.folder(other) != other.partition(".")[0]:
                between[code.folder(module)].add(code.folder(other))
    for kind, graph in (("modules", code.imports), ("folders", between)):
        try:
            TopologicalSorter({name: own - {name} for name, own in graph.items()}).prepare()
        except CycleError as error:
            yield f"circle of {kind}: {' <- '.join(error.args[1])}"


@pytest.fixture(scope="module")
def own():
    return read(ROOT)


def test_folders_names_and_arrows_follow_the_rules(own):
    assert len(own.modules()) > 200
    assert list(faults(own)) == []


def lines(folder):
    """Lines of the sources of a folder by hand."""
    files = [path for kind in ("*.py", "*.ts", "*.css") for path in (ROOT / folder).rglob(kind)]
    kept = [path for path in files if path.name not in GENERATED and "build" not in path.parts]
    return sum(path.read_bytes().count(b"\n") for path in kept)


def test_parts_keep_their_budgets_of_lines():
    counts = {folder: lines(folder) for folder in BUDGETS}
    assert {name: count for name, count in counts.items() if count > BUDGETS[name]} == {}
    shipped = sum(counts[distribution] for distribution in DISTRIBUTIONS)
    assert 0.5 < lines("tests") / shipped <= MOST_TESTS


def bindings(file):
    """Names that a module binds: variables, fields and parameters."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.arg):
            yield node.arg


def test_values_are_named_by_the_thing():
    files = [file for distribution in DISTRIBUTIONS for file in (ROOT / distribution).rglob("*.py")]
    names = {file: [name for name in bindings(file) if name != "self"] for file in files}
    vague = {str(file): VAGUE & {*names[file]} for file in files if VAGUE & {*names[file]}}
    total = sum(map(len, names.values()))
    count = sum(name in VAGUE for listed in names.values() for name in listed)
    assert total > 20_000
    assert 0 < count <= MOST_VAGUE * total, vague


# A description begins a sentence: `name: text`, `name (F, 3), m: text` or `one, other: text`.
DESCRIBED = re.compile(
    r"(?:(?<=\. )|(?<=\.\n)|(?<=\n\n))((?:[a-z_]\w*(?: \([^)]*\))?, )*[a-z_]\w*(?: \([^)]*\))?): "
)


def undeclared(tree):
    """Names that docstrings of data classes describe, which are no fields or methods of theirs."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.ClassDef):
            continue
        bases = [ast.unparse(base) for base in node.bases]
        decorated = any("dataclass" in ast.unparse(item) for item in node.decorator_list)
        fields = {item.target.id for item in node.body if isinstance(item, ast.AnnAssign)}
        fields |= {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
        if bases == ["NamedTuple"] or (decorated and not bases):
            for match in DESCRIBED.finditer(ast.get_docstring(node) or ""):
                names = {name.strip() for name in re.sub(r"\([^)]*\)", "", match[1]).split(",")}
                yield from (f"{node.name}: {name}" for name in names - fields)


def test_docstrings_of_data_classes_describe_their_fields():
    files = [file for folder in DISTRIBUTIONS for file in (ROOT / folder).rglob("*.py")]
    assert [name for file in files for name in undeclared(ast.parse(file.read_text()))] == []
    # Negative control: a field that was renamed.
    text = '"""A clip.\n\n    speed: m/s. pace (F,): s."""'
    for head in ("@dataclass\nclass Clip:", "class Clip(NamedTuple):"):
        planted = f"{head}\n    {text}\n    speed: float\n"
        assert list(undeclared(ast.parse(planted))) == ["Clip: pace"]
