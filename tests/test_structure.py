"""Tests of the structure of both distributions: folders, their arrows, and names of modules."""

import ast
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DISTRIBUTIONS = ("service/posefield", "model_export/posefield_train")
MOST_MODULES = 14
MOST_PARAMETERS = 6
SMALL = 60
"""Lines below which a module with one importer belongs into that importer."""
COMMANDS = "cli"
"""Folder with one module for each command, however small."""
# `posefield train` imports it late: SciPy takes a second, and one recipe does not need it.
LATE = {"posefield_train.sweep"}


@dataclass
class Code:
    """Modules by dotted name, and the modules that each imports."""

    files: dict[str, Path] = field(default_factory=dict)
    imports: dict[str, set[str]] = field(default_factory=dict)

    def modules(self):
        """Modules that are not packages."""
        return {name: file for name, file in self.files.items() if file.name != "__init__.py"}

    def folder(self, name):
        """Package of a module; a package's own `__init__` belongs to it."""
        return name if self.files[name].name == "__init__.py" else name.rpartition(".")[0]


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
    """A line for each breach of the rules of folders."""
    yield from crowded_folders(code)
    yield from repeated_names(code)
    yield from circles(code)
    yield from small_modules(code)


def crowded_folders(code):
    counts = Counter(map(code.folder, code.modules()))
    for folder, count in counts.items():
        if count > MOST_MODULES:
            yield f"{folder} has {count} modules, expected at most {MOST_MODULES}"


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


def small_modules(code):
    importers = defaultdict(set)
    for module, others in code.imports.items():
        for other in others - {module}:
            importers[other].add(module)
    for module, file in code.modules().items():
        lines = len(file.read_text().splitlines())
        own = importers[module]
        allowed = module in LATE or code.folder(module).endswith(f".{COMMANDS}")
        if lines < SMALL and len(own) == 1 and not allowed:
            yield f"{module} has {lines} lines and one importer, {', '.join(own)}: merge it"


@pytest.fixture(scope="module")
def own():
    return read(ROOT)


@pytest.fixture
def plant(own, tmp_path):
    """Function that returns the code with some lines at the end of a file, or with a new file."""

    def planted(file, text):
        path = tmp_path / file
        path.parent.mkdir(parents=True)
        before = (ROOT / file).read_text() if (ROOT / file).exists() else ""
        path.write_text(f"{before}{text}\n")
        name = ".".join(Path(*Path(file).parts[1:]).with_suffix("").parts)
        files = own.files | {name: path}
        return Code(files, own.imports | {name: set(imported(path, files))})

    return planted


def test_folders_names_and_arrows_follow_the_rules(own):
    assert len(own.modules()) > 200
    assert list(faults(own)) == []


@pytest.mark.parametrize(
    ("file", "text", "fault"),
    [
        ("service/posefield/batch/quat.py", "", "one name: posefield.motion.quat, posefield.batch"),
        (
            "service/posefield/motion/spin.py",
            "from posefield import synthesis",
            "circle of folders",
        ),
        (
            "service/posefield/motion/skeleton.py",
            "import posefield.motion.clip",
            "circle of modules",
        ),
        ("service/posefield/common/units.py", "from posefield.common import errors", ""),
        ("service/posefield/motion/clip.py", "import posefield.motion.blend", ""),
        ("service/posefield/kriging/alone.py", "", ""),
    ],
)
def test_a_breach_is_found(plant, file, text, fault):
    found = list(faults(plant(file, text)))
    assert any(line.startswith(fault) for line in found) if fault else found == []


@pytest.mark.parametrize(
    ("lines", "fault"),
    [(SMALL - 1, "posefield.check.piece has 59 lines and one importer"), (SMALL, "")],
)
def test_a_small_module_is_found(plant, lines, fault):
    code = plant("service/posefield/check/piece.py", "#\n" * (lines - 1) + "#")
    code.imports["posefield.check.finding"] = {"posefield.check.piece"}
    found = list(faults(code))
    assert any(line.startswith(fault) for line in found) if fault else found == []


def test_a_crowded_folder_is_found(own, plant):
    code = plant("service/posefield/common/m0.py", "")
    for number in range(MOST_MODULES):
        code.files[f"posefield.common.m{number}"] = code.files["posefield.common.m0"]
    (found,) = faults(code)
    assert found.startswith("posefield.common has ")


def long_signatures(files):
    """Public functions with more parameters than a reader keeps in mind; self counts for none."""
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                own = node.args.posonlyargs + node.args.args + node.args.kwonlyargs
                names = [each.arg for each in own if each.arg not in ("self", "cls")]
                if len(names) > MOST_PARAMETERS and not node.name.startswith("_"):
                    yield f"{file.name}: {node.name}"


def test_public_functions_have_few_parameters(own, tmp_path):
    assert list(long_signatures(own.files.values())) == []
    planted = tmp_path / "long.py"
    planted.write_text(
        "def seven(a, b, c, /, d, e, *, f, g): ...\ndef six(self, a, b, c, d, e, f): ..."
    )
    assert list(long_signatures([planted])) == ["long.py: seven"]


def test_a_boolean_of_a_question_stands_in_few_files():
    """`as_predicted`: type, contract, Python signatures, Blender's values, the page's question."""
    folders = (ROOT / folder for folder in ("service", "model_export", "clients", "api"))
    kinds = {".py", ".ts", ".yaml", ".json"}
    files = (path for folder in folders for path in folder.rglob("*") if path.suffix in kinds)
    made = {"generated.py", "schema.ts", "schema.d.ts", "request.json"}
    own = [
        path
        for path in files
        if path.name not in made and not {"node_modules", "test"} & {*path.parts}
    ]
    found = {
        path.relative_to(ROOT).as_posix()
        for path in own
        if not path.is_symlink() and "as_predicted" in path.read_text()
    }
    assert found == {
        "api/openapi.yaml",
        "clients/blender/addon/without_blender/variation.py",
        "clients/python/posefield_client/files.py",
        # Scripts have a form of their own on the page.
        "clients/viewer/src/performance/script.ts",
        "clients/viewer/src/performance/whole.ts",
        "clients/viewer/src/takes.ts",
        # The evaluation compares both.
        "model_export/posefield_train/evaluate/footing/standing_answers.py",
        "service/posefield/question/motion_question.py",
    }
