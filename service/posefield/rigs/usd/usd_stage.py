"""USD stage with its prims and the bindings of its skeletons."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pxr import Tf, Usd, UsdSkel

from posefield.common.errors import MotionFileError


@dataclass(frozen=True)
class SkelStage:
    """An open stage. cache: of UsdSkel, with the bindings of all its skeletons."""

    source: str
    stage: Any
    cache: Any

    def error(self, message: str) -> MotionFileError:
        """Return an error that names the file."""
        return MotionFileError(self.source, message)

    def prims(self, schema: Any) -> list[Any]:
        """Return the prims of a schema, those within instances too."""
        seen = Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies())
        return [prim for prim in seen if prim.IsA(schema)]


def open_stage(path: Path, source: str) -> SkelStage:
    """Return the stage of a file; MotionFileError if it does not open whole.

    source: name of the file in messages.
    """
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as fault:
        said = str(fault).rpartition(" : ")[2].strip().strip("'")[:200]
        raise MotionFileError(source, f"does not open as USD: {said}") from fault
    faults = stage.GetCompositionErrors()
    if faults:
        said = " ".join(str(faults[0]).split())[:200]
        raise MotionFileError(source, f"refers to what cannot be read: {said}")
    cache = UsdSkel.Cache()
    opened = SkelStage(source, stage, cache)
    for prim in opened.prims(UsdSkel.Root):
        cache.Populate(UsdSkel.Root(prim), Usd.TraverseInstanceProxies())
    return opened


def fault_of(skeleton: Any) -> str:
    """Return why a skeleton has no query."""
    joints = UsdSkel.Skeleton(skeleton).GetJointsAttr().Get()
    if not joints:
        return "it names no joints"
    valid, reason = UsdSkel.Topology(joints).Validate()
    return "its transforms are not one for each joint" if valid else reason
