"""Tests of the shape checks, and of their absence from what ships."""

import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shape_checks
from beartype.roar import BeartypeCallHintViolation, BeartypeDoorHintViolation

from posefield.common import array_shapes
from posefield.kriging import support
from posefield.motion import blend, quat, skeleton
from posefield.motion.crowd_clip import Placement
from posefield.motion.measures import MeasuredMotion
from posefield_train.tensor.decoder import Proportions
from posefield_train.tensor.pose_vectors import PoseChart

ROOT = Path(__file__).parents[1]
NUMERIC = [
    *(f"service/posefield/{name}" for name in ("motion", "kriging", "inference", "constraints")),
    "service/posefield/locomotion",
    *(f"model_export/posefield_train/{name}" for name in ("kriging", "align", "tensor")),
]
ARRAYS = {"Floats", "Singles", "Indices", "Booleans", "FloorVectors", "Numbers"}
ANY_RANK = {"decompose", "decompose_truncated", "mode_dot", "restored", "unfold"}
"""Of tensors with any number of axes."""
WRONG = {
    "a quaternion of three numbers": lambda: quat.mul(np.ones((5, 3)), np.ones(4)),
    "batches that do not broadcast": lambda: quat.mul(np.ones((5, 4)), np.ones((3, 4))),
    "integers": lambda: quat.conj(np.array([1, 0, 0, 0])),
    "an axis too many": lambda: quat.from_axis_angle(np.eye(3), np.zeros(3)),
    "other joints": lambda: skeleton.forward_kinematics((-1, 0), np.ones((3, 4)), np.ones((2, 3))),
    "a sample of other controls": lambda: support.covariances(np.ones((2, 3)), np.ones((2, 4))),
    "shares of other rows": lambda: blend.lerp(np.ones((2, 3)), np.ones((2, 3)), np.ones(3)),
    "a method's argument": lambda: PoseChart(np.ones((2, 4)), "stereographic").far_joints(
        np.ones((5, 2, 4))
    ),
}
POSITIONS = np.zeros((2, 2, 3))
FIELDS = {
    "headings": lambda: Placement(np.zeros((3, 3)), np.zeros(2)),
    "offsets": lambda: MeasuredMotion(POSITIONS, 1.0, np.zeros(3), (-1, 0), np.zeros((3, 3))),
    "directions": lambda: Proportions(np.zeros((3, 3)), np.zeros((1, 2, 3))),
}
# In a process of its own, as after an installation without development packages.
HIDDEN = """
import importlib, pkgutil, sys
import posefield, posefield_train

class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"jaxtyping", "beartype"}:
            raise ModuleNotFoundError(f"hidden: {name}", name=name)

sys.meta_path.insert(0, Hidden())
"""
EVERYTHING = """
names = [m.name for p in (posefield, posefield_train)
         for m in pkgutil.walk_packages(p.__path__, p.__name__ + ".")]
for name in names:
    importlib.import_module(name)
import numpy as np
from posefield.motion import quat
print(len(names) > 200, hasattr(quat.conj, "__wrapped__"), quat.conj(np.array([1, 2, 3, 4])))
"""


def bare(hint: ast.AST | None) -> bool:
    """Return whether an annotation has an array without a shape."""
    if isinstance(hint, ast.Subscript) and ast.unparse(hint.value) == "Annotated":
        return False
    if isinstance(hint, ast.Name):
        return hint.id in ARRAYS
    return any(map(bare, ast.iter_child_nodes(hint))) if hint else False


def unshaped(package: Path) -> Iterator[str]:
    """Public functions and methods with an array whose shape the signature does not give."""
    for path in sorted(package.rglob("*.py")):
        module = ast.parse(path.read_text())
        classes = [node for node in module.body if isinstance(node, ast.ClassDef)]
        for node in [each for owner in (module, *classes) for each in owner.body]:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                given = [
                    child.annotation for child in ast.walk(node.args) if isinstance(child, ast.arg)
                ]
                if any(map(bare, [*given, node.returns])):
                    yield node.name


def python(code):
    paths = os.pathsep.join(str(ROOT / part) for part in ("service", "model_export"))
    environment = {**os.environ, "PYTHONPATH": paths}
    return subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("call", WRONG.values(), ids=WRONG)
def test_a_wrong_shape_is_refused(call):
    """Negative control: all other tests pass these checks."""
    with pytest.raises(BeartypeCallHintViolation, match=r"violates type hint .*jaxtyping"):
        call()


@pytest.mark.parametrize(("name", "build"), FIELDS.items(), ids=FIELDS)
def test_a_field_of_a_wrong_shape_is_refused(name, build):
    with pytest.raises(BeartypeDoorHintViolation, match=rf"(?s)\.{name} .*violates"):
        build()


def test_the_first_calls_of_a_test_are_checked():
    """Negative control: later calls are not, as they take long."""
    call, refused = WRONG["integers"], pytest.raises(BeartypeCallHintViolation)
    for _ in range(shape_checks.CHECKED_CALLS):
        with refused:
            call()
    assert len(call()) == 4
    shape_checks.begin_test()
    with refused:
        call()


def test_replaced_fields_are_checked_too():
    placement = Placement(np.zeros((3, 3)), np.zeros(3))
    assert len(replace(placement, headings=np.ones(3))) == 3
    with pytest.raises(BeartypeDoorHintViolation):
        replace(placement, headings=np.ones(2))


def test_the_service_needs_no_checks_and_has_none():
    done = python(HIDDEN + EVERYTHING)
    assert (done.returncode, done.stdout) == (0, "True False [ 1. -2. -3. -4.]\n"), done.stderr


def test_the_checks_need_what_is_hidden():
    """Negative control of the test above."""
    paths = f"sys.path.insert(0, {str(ROOT / 'tests')!r})\n"
    checks = "import shape_checks; shape_checks.install(); import posefield.motion.quat"
    done = python(HIDDEN + paths + checks)
    assert done.returncode == 1
    assert "ModuleNotFoundError: hidden" in done.stderr


@pytest.mark.parametrize("package", NUMERIC)
def test_public_signatures_give_the_shapes_of_their_arrays(package):
    assert set(unshaped(ROOT / package)) <= ANY_RANK


def test_a_signature_without_shapes_is_found(tmp_path):
    (tmp_path / "plain.py").write_text("def norm(q: Floats | None, v: Vectors) -> float: ...")
    assert list(unshaped(tmp_path)) == ["norm"]


def test_axes_of_several_modules_are_explained():
    users: dict[str, set[Path]] = {}
    for path in (path for package in NUMERIC for path in (ROOT / package).rglob("*.py")):
        for shape in re.findall(r'Annotated\[\s*\w+,\s*"([^"]*)"', path.read_text()):
            for axis in re.findall(r"[a-z]\w*", re.sub(r"{.*?}", "", shape)):
                users.setdefault(axis, set()).add(path)
    several = {axis for axis, paths in users.items() if len(paths) > 1}
    assert several <= set(re.findall(r"\w+", array_shapes.__doc__))
    assert {"frames", "joints", "samples", "controls", "dof"} <= several
