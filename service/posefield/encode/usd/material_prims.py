"""USD prims of the material that a body wears."""

from typing import Any

from pxr import Gf

from posefield.encode.body import body_colours
from posefield.encode.usd import prim_specs
from posefield.encode.usd.prim_specs import ValueTypes

READER = "UsdPrimvarReader_float3"


def material(parent: Any, *, tinted: bool) -> Any:
    """Return the path of a new material in a prim.

    tinted: whether it takes its colour from the mesh instead of having one of its own.
    """
    made = prim_specs.prim(parent, "Material", "Material")
    surface = _shader(made, "Surface", "UsdPreviewSurface")
    colour = prim_specs.varying_attribute(surface, "inputs:diffuseColor", ValueTypes.Color3f)
    if tinted:
        reader = _shader(made, "Colour", READER)
        prim_specs.varying_attribute(reader, "inputs:varname", ValueTypes.String, "displayColor")
        result = prim_specs.varying_attribute(reader, "outputs:result", ValueTypes.Float3)
        _connect(colour, result)
    else:
        colour.default = Gf.Vec3f(*body_colours.SKIN)
    for name, value in (("roughness", body_colours.ROUGHNESS), ("metallic", 0.0)):
        prim_specs.varying_attribute(surface, f"inputs:{name}", ValueTypes.Float, value)
    output = prim_specs.varying_attribute(surface, "outputs:surface", ValueTypes.Token)
    _connect(prim_specs.varying_attribute(made, "outputs:surface", ValueTypes.Token), output)
    return made.path


def _shader(parent: Any, name: str, kind: str) -> Any:
    made = prim_specs.prim(parent, name, "Shader")
    prim_specs.uniform_attribute(made, "info:id", ValueTypes.Token, kind)
    return made


def _connect(taker: Any, giver: Any) -> None:
    taker.connectionPathList.explicitItems = [giver.path]
