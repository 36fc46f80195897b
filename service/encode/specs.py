"""Short forms for writing prims, attributes and relationships straight into a layer."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from pxr import Sdf, Vt

from service.encode.content import Samples
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


def uniform(owner: Any, name: str, kind: Any, value: Any = None) -> None:
    """New attribute that never varies in time, with its value where one is given."""
    spec = Sdf.AttributeSpec(owner, name, kind, Sdf.VariabilityUniform)
    if value is not None:
        spec.default = value


def per_point(owner: Any, name: str, kind: Any, value: Any = None) -> Any:
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


def samples(prim: Any, values: Samples) -> None:
    """Samples of the translations and rotations of a SkelAnimation."""
    _samples(prim, "translations", map(Vt.Vec3fArray.FromNumpy, values["translations"]))
    _samples(prim, "rotations", map(Vt.QuatfArray.FromNumpy, values["rotations"]))


def _samples(prim: Any, name: str, values: Iterable[Any]) -> None:
    layer, path = prim.layer, prim.path.AppendProperty(name)
    for frame, value in enumerate(values):
        layer.SetTimeSample(path, frame, value)
