"""Tests of the shape checks, and that public signatures give shapes."""

import ast
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shape_checks
from beartype.roar import BeartypeCallHintViolation, BeartypeDoorHintViolation

from posefield.motion import quat
from posefield.motion.clip import Placement
from posefield_train.tensor.pose_vectors import PoseChart

ROOT = Path(__file__).parents[1]
NUMERIC = [
    *(f"service/posefield/{name}" for name in ("motion", "kriging", "inference", "constraints")),
    "service/posefield/locomotion",
    *(f"model_export/posefield_train/{name}" for name in ("kriging", "align", "tensor")),
]
ARRAYS = {"Floats", "Singles", "Indices", "Booleans", "FloorVectors", "Numbers"}
ANY_RANK = {"decompose", "mode_dot", "restored", "unfold"}
"""Of tensors with any number of axes."""
WRONG = {
    "a quaternion of three numbers": lambda: quat.mul(np.ones((5, 3)), np.ones(4)),
    "integers": lambda: quat.conj(np.array([1, 0, 0, 0])),
    "a method's argument": lambda: PoseChart(np.ones((2, 4)), "stereographic").far_joints(
        np.ones((5, 2, 4))
    ),
}


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


@pytest.mark.parametrize("call", WRONG.values(), ids=WRONG)
def test_a_wrong_shape_is_refused(call):
    """Negative control: all other tests pass these checks."""
    with pytest.raises(BeartypeCallHintViolation, match=r"violates type hint .*jaxtyping"):
        call()


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


@pytest.mark.parametrize("package", NUMERIC)
def test_public_signatures_give_the_shapes_of_their_arrays(package):
    assert set(unshaped(ROOT / package)) <= ANY_RANK
