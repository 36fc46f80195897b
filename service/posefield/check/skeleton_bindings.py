"""Skeletons of a stage with their bindings, and access to attributes."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdSkel

from posefield.common.units import Floats


@dataclass(frozen=True)
class SkeletonBinding:
    """Skeleton of a stage: its prim, the SkelRoot above it, its SkelAnimation, and its joints.

    root, animation: None if missing.
    """

    stage: Any
    skeleton: Any
    root: Any
    animation: Any
    joints: tuple[str, ...]

    @property
    def leaves(self) -> list[str]:
        """Return the joints' names without their ancestors' names."""
        return [joint.rpartition("/")[2] for joint in self.joints]


def skeleton_bindings(stage: Any) -> list[SkeletonBinding]:
    """Return every skeleton of the stage, instances included."""
    prims = stage.Traverse(Usd.TraverseInstanceProxies())
    return [_skeleton_binding(stage, prim) for prim in prims if prim.IsA(UsdSkel.Skeleton)]


def is_authored(prim: Any, name: str) -> bool:
    """Return whether the attribute has an authored value, a default or time samples."""
    attribute = prim.GetAttribute(name)
    return bool(attribute and attribute.HasAuthoredValue())


def attribute_array(prim: Any, name: str, time: Any = None) -> Floats:
    """Return the value of an attribute as numbers; empty if it has none or another type."""
    code = Usd.TimeCode.Default() if time is None else time
    value = prim.GetAttribute(name).Get(code) if prim.HasAttribute(name) else None
    try:
        return np.array(value if value is not None else [], dtype=float)
    except (TypeError, ValueError):
        return np.empty(0)


def attribute_tokens(prim: Any, name: str = "joints") -> tuple[str, ...]:
    """Return the tokens of an attribute; empty if it has none."""
    value = prim.GetAttribute(name).Get() if prim.HasAttribute(name) else None
    return tuple(str(token) for token in value or ())


def _skeleton_binding(stage: Any, skeleton: Any) -> SkeletonBinding:
    source = UsdSkel.BindingAPI(skeleton).GetInheritedAnimationSource()
    animation = source if source and source.IsA(UsdSkel.Animation) else None
    root = UsdSkel.Root.Find(skeleton)
    return SkeletonBinding(
        stage,
        skeleton,
        root.GetPrim() if root else None,
        animation,
        attribute_tokens(skeleton, "joints"),
    )
