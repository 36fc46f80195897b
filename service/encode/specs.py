"""Short forms for writing prims, attributes and relationships straight into a layer."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from pxr import Sdf, Vt

from service.motion.conventions import Floats

Type = Sdf.ValueTypeNames


def prim(parent: Any, name: str, kind: str, apis: Sequence[str] = ()) -> Any:
    """New prim of a schema with applied API schemas."""
    spec = Sdf.PrimSpec(parent, name, Sdf.SpecifierDef, kind)
    if apis:
        spec.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=list(apis)))
    return spec


def attribute(owner: Any, name: str, kind: Any, value: Any = None) -> Any:
    """New varying attribute, with a default value where one is given."""
    spec = Sdf.AttributeSpec(owner, name, kind)
    if value is not None:
        spec.default = value
    return spec


def uniform(owner: Any, name: str, kind: Any, value: Any) -> None:
    """New attribute that never varies in time."""
    spec = Sdf.AttributeSpec(owner, name, kind, Sdf.VariabilityUniform)
    spec.default = value


def per_point(owner: Any, name: str, kind: Any, value: Any) -> Any:
    """New attribute with one element for each point of a mesh."""
    spec = attribute(owner, name, kind, value)
    spec.SetInfo("interpolation", "vertex")
    return spec


def relation(owner: Any, name: str, target: Any) -> None:
    """New relationship to the prim at a path."""
    spec = Sdf.RelationshipSpec(owner, name, custom=False)
    spec.targetPathList.explicitItems = [target]


def vectors(values: Floats) -> Any:
    """float3[] of (N, 3)."""
    return Vt.Vec3fArray.FromNumpy(values.astype(np.float32))


def vector_frames(values: Floats) -> Iterator[Any]:
    """float3[] of each frame of (F, N, 3)."""
    return map(Vt.Vec3fArray.FromNumpy, values.astype(np.float32))


def quaternion_frames(values: Floats) -> Iterator[Any]:
    """quatf[] of each frame of (F, N, 4) in the order w x y z; USD keeps the real part last."""
    return map(Vt.QuatfArray.FromNumpy, np.roll(values, -1, axis=-1).astype(np.float32))


def translations(values: Floats) -> Any:
    """matrix4d[] that move by (N, 3); USD multiplies row vectors, so the last row holds them."""
    matrices = np.tile(np.eye(4), (len(values), 1, 1))
    # The nearest float32 as a short decimal: a reader computes in float32 anyway.
    matrices[:, 3, :3] = np.round(values, 7)
    return Vt.Matrix4dArray.FromNumpy(matrices)


def samples(layer: Any, path: Any, values: Iterable[Any]) -> None:
    """Values of an attribute at the time codes 0, 1, 2 and so on."""
    for frame, value in enumerate(values):
        layer.SetTimeSample(path, frame, value)
