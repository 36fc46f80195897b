"""Check of USD characters for defects that make readers show a wrong motion or none.

USD's own validators run too, but detect few of these defects: a file that passes them may still
show its rest pose, or have no skeleton at all, in Blender or in a browser.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pxr import Tf, Usd, UsdUtils

from service.check import joints, mesh, motion, official, rig, scene
from service.check.finding import Finding, error
from service.check.rig import Rig
from service.motion.errors import UsdError

__all__ = ["Finding", "check"]


def check(path: Path) -> list[Finding]:
    """Return all findings of a file.

    Raises UsdError if the file does not open.
    """
    # Suppresses pxr's output, which repeats the findings.
    quiet = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        stage = _open(path)
        return [*_stage(stage), *official.findings(stage)]
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


def _stage(stage: Any) -> Iterator[Finding]:
    yield from scene.metadata(stage)
    found = rig.rigs(stage)
    if not found:
        yield error("no-skeleton", stage.GetPseudoRoot(), "no Skeleton, expected at least one")
    for each in found:
        yield from _rig(each)


def _rig(each: Rig) -> Iterator[Finding]:
    for look in (scene.bindings, joints.names, joints.order, joints.transforms, mesh.extents):
        yield from look(each)
    for skinned in scene.meshes(each):
        yield from mesh.influences(each, skinned)
    if each.animation is not None:
        for look in (motion.joints, motion.components, motion.times, motion.values):
            yield from look(each)
