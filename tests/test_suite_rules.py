"""Rules of the test suite: patches, marks, assertions and imports."""

import ast
import builtins
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
TESTS = sorted(path for path in (ROOT / "tests").rglob("*.py") if "interop" not in path.parts)
# Plants a fault in a process of its own, to prove that it is noticed there.
PLANTS = {ROOT / "tests/contract/watched_serve.py"}
OWN = {"posefield", "posefield_train", "posefield_client", "without_blender"}
# Of other libraries: they raise where something is not as it should be.
RAISING = {"raises", "warns", "fail", "validate", "check_schema"}


def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(), str(path))


def imported(tree: ast.Module) -> dict[str, str]:
    """Names that a module imports, anywhere in it, and the package that each comes from."""
    found = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                name = alias.asname or alias.name.partition(".")[0]
                found[name] = alias.name.partition(".")[0]
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                found[alias.asname or alias.name] = (node.module or "").partition(".")[0]
    return found


def root(node: ast.expr) -> str:
    """The name that an expression of attributes begins with; empty for any other expression."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def called(node: ast.Call) -> str:
    """The last name of what is called."""
    return node.func.attr if isinstance(node.func, ast.Attribute) else root(node.func)


def patches(tree: ast.Module) -> Iterator[int]:
    """Lines that replace something of the project's own modules, or import mocks."""
    names = imported(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and called(node) in ("setattr", "delattr"):
            # Of pytest's monkeypatch, whatever it is called. Anything is refused but an attribute
            # of another library's module: strings and calls, too.
            of_pytest = isinstance(node.func, ast.Attribute)
            if of_pytest and names.get(root(node.args[0]), "posefield") in OWN:
                yield node.lineno
        if isinstance(node, ast.Assign | ast.AugAssign):
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                if isinstance(target, ast.Attribute) and names.get(root(target)) in OWN:
                    yield node.lineno
        if isinstance(node, ast.Import | ast.ImportFrom):
            modules = [alias.name for alias in node.names]
            if "mock" in modules or "unittest.mock" in [*modules, getattr(node, "module", "")]:
                yield node.lineno


def asserts(test: ast.AST) -> bool:
    """Return whether a test asserts, or calls a function whose name says that it does."""
    for node in ast.walk(test):
        if isinstance(node, ast.Assert):
            return True
        if isinstance(node, ast.Call):
            name = called(node)
            if name.startswith("assert_") or name in RAISING:
                return True
    return False


def functions(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            yield node


def places(path: Path, lines: Iterator[int]) -> list[str]:
    return [f"{path.relative_to(ROOT)}:{line}" for line in lines]


def test_nothing_of_our_own_is_patched():
    checked = [path for path in TESTS if path not in PLANTS]
    found = [place for path in checked for place in places(path, patches(parsed(path)))]
    assert found == []


def test_every_test_asserts_by_name_or_itself():
    found = [
        f"{path.relative_to(ROOT)}::{test.name}"
        for path in TESTS
        for test in functions(parsed(path))
        if not asserts(test)
    ]
    assert found == []


def test_every_file_of_tests_has_a_name_of_its_own():
    """They are imported by their names alone, and a helper's must hide no library."""
    names = [path.stem for path in TESTS if path.stem != "conftest"]
    assert sorted(names) == sorted(set(names))
    assert not set(names) & (sys.stdlib_module_names | set(dir(builtins)))
