"""Check of USD characters for defects that make readers show a wrong motion or none.

USD's own validators run too, but detect few of these defects: a file that passes them may still
show its rest pose, or have no skeleton at all, in Blender or in a browser.
"""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from pxr import Tf, Usd, UsdUtils, UsdValidation

from posefield.check import (
    animation_checks,
    joint_checks,
    mesh_checks,
    skeleton_bindings,
    stage_checks,
)
from posefield.check.finding import Finding, Severity, error
from posefield.check.skeleton_bindings import SkeletonBinding
from posefield.common.errors import UsdError

__all__ = ["Finding", "check"]


def check(path: Path) -> list[Finding]:
    """Return all findings of a file.

    Raises UsdError if the file does not open.
    """
    # Suppresses pxr's output, which repeats the findings.
    quiet = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        stage = _open(path)
        return [*_stage_findings(stage), *validator_findings(stage)]
    finally:
        quiet.TakeUncoalescedDiagnostics()


def _open(path: Path) -> Any:
    if not path.is_file():
        raise UsdError(path, "no such file, expected a USD file")
    try:
        return Usd.Stage.Open(str(path))
    except Tf.ErrorException as fault:
        raise UsdError(path, f"expected a USD file that opens; {_reason(fault)}") from fault


def _reason(fault: Any) -> str:
    return "; ".join(str(entry.commentary).strip() for entry in fault.args) or str(fault)


def _stage_findings(stage: Any) -> Iterator[Finding]:
    yield from stage_checks.metadata(stage)
    found = skeleton_bindings.skeleton_bindings(stage)
    if not found:
        yield error("no-skeleton", stage.GetPseudoRoot(), "no Skeleton, expected at least one")
    for each in found:
        yield from _skeleton_findings(each)


def _skeleton_findings(each: SkeletonBinding) -> Iterator[Finding]:
    for look in (
        stage_checks.bindings,
        joint_checks.names,
        joint_checks.order,
        joint_checks.transforms,
        mesh_checks.extents,
    ):
        yield from look(each)
    for skinned in stage_checks.skinned_meshes(each):
        yield from mesh_checks.influences(each, skinned)
    if each.animation is not None:
        for look in (
            animation_checks.joints,
            animation_checks.components,
            animation_checks.times,
            animation_checks.values,
        ):
            yield from look(each)


def validator_findings(stage: Any) -> Iterator[Finding]:
    """Yield errors and warnings of all validators of pxr."""
    for fault in UsdValidation.ValidationContext(_validators()).Validate(stage):
        warned = fault.GetType() == UsdValidation.ValidationErrorType.Warn
        severity: Severity = "warning" if warned else "error"
        code = f"usd:{fault.GetName()}"
        yield Finding(code, _prim_path(fault), fault.GetMessage().strip(), severity)


@cache
def _validators() -> Any:
    return UsdValidation.ValidationRegistry().GetOrLoadAllValidators()


def _prim_path(fault: Any) -> str:
    sites = [site for site in fault.GetSites() if site.IsPrim()]
    return str(sites[0].GetPrim().GetPath()) if sites else "/"
