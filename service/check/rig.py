"""The skeletons of a stage, each with what it is bound to."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdSkel

from service.motion.conventions import Floats


@dataclass(frozen=True)
class Rig:
    """A Skeleton prim, the SkelRoot above it, its SkelAnimation (None when missing), its joints."""

    stage: Any
    skeleton: Any
    root: Any
    animation: Any
    joints: tuple[str, ...]

    @property
    def leaves(self) -> list[str]:
        """The joints' names without their ancestors'."""
        return [joint.rpartition("/")[2] for joint in self.joints]


def rigs(stage: Any) -> list[Rig]:
    """Every skeleton of the stage, instances included."""
    prims = stage.Traverse(Usd.TraverseInstanceProxies())
    return [_rig(stage, prim) for prim in prims if prim.IsA(UsdSkel.Skeleton)]


def authored(prim: Any, name: str) -> bool:
    """Whether the attribute has a value of its own, a default or time samples."""
    attribute = prim.GetAttribute(name)
    return bool(attribute and attribute.HasAuthoredValue())


def array(prim: Any, name: str, time: Any = None) -> Floats:
    """Value of an attribute as numbers, empty where it has none or is of another type."""
    code = Usd.TimeCode.Default() if time is None else time
    value = prim.GetAttribute(name).Get(code) if prim.HasAttribute(name) else None
    try:
        return np.array(value if value is not None else [], dtype=float)
    except (TypeError, ValueError):
        return np.empty(0)


def tokens(prim: Any, name: str = "joints") -> tuple[str, ...]:
    """Tokens of an attribute, empty where it has none."""
    value = prim.GetAttribute(name).Get() if prim.HasAttribute(name) else None
    return tuple(str(token) for token in value or ())


def _rig(stage: Any, skeleton: Any) -> Rig:
    source = UsdSkel.BindingAPI(skeleton).GetInheritedAnimationSource()
    animation = source if source and source.IsA(UsdSkel.Animation) else None
    root = UsdSkel.Root.Find(skeleton)
    return Rig(
        stage, skeleton, root.GetPrim() if root else None, animation, tokens(skeleton, "joints")
    )
