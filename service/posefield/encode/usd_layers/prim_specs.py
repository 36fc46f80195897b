"""Helpers that write prims, attributes and relationships directly into a layer."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from pxr import Sdf, Vt

from posefield.common.units import Floats
from posefield.encode.usd_layers.layer_content import WEIGHTS, Samples

ValueTypes = Sdf.ValueTypeNames


def prim(parent: Any, name: str, kind: str, apis: Sequence[str] = ()) -> Any:
    """Return a new prim of a schema with applied API schemas."""
    spec = Sdf.PrimSpec(parent, name, Sdf.SpecifierDef, kind)
    if apis:
        spec.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=list(apis)))
    return spec


def varying_attribute(owner: Any, name: str, kind: Any, value: Any = None) -> Any:
    """Return a new varying attribute, with a default value unless it is None."""
    spec = Sdf.AttributeSpec(owner, name, kind)
    if value is not None:
        spec.default = value
    return spec


def uniform_attribute(owner: Any, name: str, kind: Any, value: Any = None) -> None:
    """Create an attribute that does not vary over time, with a value unless it is None."""
    spec = Sdf.AttributeSpec(owner, name, kind, Sdf.VariabilityUniform)
    if value is not None:
        spec.default = value


def vertex_attribute(owner: Any, name: str, kind: Any, value: Any = None) -> Any:
    """Return a new attribute with one element per point of a mesh."""
    spec = varying_attribute(owner, name, kind, value)
    spec.SetInfo("interpolation", "vertex")
    return spec


def add_relationship(owner: Any, name: str, *targets: Any) -> None:
    """Create a relationship to the prims at paths."""
    spec = Sdf.RelationshipSpec(owner, name, custom=False)
    spec.targetPathList.explicitItems = list(targets)


def float3_array(values: Floats) -> Any:
    """Return a float3[] of an array (N, 3)."""
    return Vt.Vec3fArray.FromNumpy(values.astype(np.float32))


def set_time_samples(prim: Any, values: Samples, first: int = 0) -> None:
    """Set the time samples of translations, rotations and weights, if any, of a SkelAnimation.

    first: time code of the first sample.
    """
    kinds = {"translations": Vt.Vec3fArray, "rotations": Vt.QuatfArray, WEIGHTS: Vt.FloatArray}
    for name, kind in kinds.items():
        if name in values:
            _set_attribute_samples(prim, name, map(kind.FromNumpy, values[name]), first)


def _set_attribute_samples(prim: Any, name: str, values: Iterable[Any], first: int) -> None:
    layer, path = prim.layer, prim.path.AppendProperty(name)
    for frame, value in enumerate(values, first):
        layer.SetTimeSample(path, frame, value)
