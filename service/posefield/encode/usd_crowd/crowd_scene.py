"""Scene hierarchy of a crowd: prototype, characters and their placement, without the motions.

    /Crowd                      assembly, the default prim
      Prototype                 class, the one character that all others refer to
      Motions                   a SkelAnimation for each motion, outside of the instances
        m00000
      Characters                group
        c00000                  component: refers to the prototype, is placed, bound to a motion

USD never frees a name, so names are few and constant.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from pxr import Sdf, Vt

from posefield.common import cancellation
from posefield.common.units import Indices
from posefield.encode.usd_layers import custom_data, layer_metadata, prim_specs
from posefield.encode.usd_layers.prim_specs import ValueTypes
from posefield.motion import quat
from posefield.motion.crowd_clip import CrowdClip, Placement

ROOT = Sdf.Path("/Crowd")
PROTOTYPE = ROOT.AppendChild("Prototype")
MOTIONS = ROOT.AppendChild("Motions")
CHARACTERS = ROOT.AppendChild("Characters")
MODEL_SCHEMAS = ("GeomModelAPI",)
BLOCK_SIZE = 500
"""Characters that are written at a time."""


def motion_name(index: int) -> str:
    """Return the name of a motion's prim."""
    return f"m{index:05}"


def character_name(index: int) -> str:
    """Return the name of a character's prim."""
    return f"c{index:05}"


def character_path(index: int) -> Any:
    """Return the path of a character."""
    return CHARACTERS.AppendChild(character_name(index))


def new_layer(crowd: CrowdClip, form: str) -> Any:
    """Return a layer with the crowd's metadata and no character; the caller must hold it.

    form: usda or usdc, in which it will be exported. usd-core copies a layer of the other form
    before it writes it, which takes half as much memory again.
    """
    made = Sdf.Layer.CreateAnonymous(f"crowd.{form}")
    layer_metadata.set_layer_metadata(made, ROOT.name, crowd.frames, crowd.rate)
    made.customLayerData = {layer_metadata.FACTS: custom_data.usd_dictionary(crowd.facts)}
    prim_specs.prim(made, ROOT.name, "Xform", MODEL_SCHEMAS).kind = "assembly"
    return made


def characters_prim(made: Any) -> Any:
    """Return a new prim for the characters."""
    characters = prim_specs.prim(made.GetPrimAtPath(ROOT), CHARACTERS.name, "Xform", MODEL_SCHEMAS)
    characters.kind = "group"
    return characters


def set_payload(owner: Any, path: str) -> None:
    """Set another layer's default prim as the payload of a prim; readers may leave it out."""
    owner.SetInfo("payload", Sdf.PayloadListOp.Create(prependedItems=[Sdf.Payload(path)]))


def add_references(made: Any, crowd: CrowdClip, instanced: bool) -> None:
    """Add every character as a reference to the prototype, instanceable where `instanced`.

    A prim cannot be added below an instance, so each character's root is bound to its motion.
    """
    with Sdf.ChangeBlock():
        characters = characters_prim(made)
    prototype = Sdf.ReferenceListOp.Create(prependedItems=[Sdf.Reference("", PROTOTYPE)])
    for some in character_blocks(crowd):
        with Sdf.ChangeBlock():
            prims = [prim_specs.prim(characters, character_name(i), "SkelRoot") for i in some]
            for prim, played in zip(prims, crowd.motion[some], strict=True):
                prim.SetInfo("references", prototype)
                if instanced:
                    prim.SetInfo("instanceable", True)
                prim_specs.add_relationship(
                    prim, "skel:animationSource", MOTIONS.AppendChild(motion_name(played))
                )
            set_transforms(prims, crowd.placement.select(some))


def character_blocks(crowd: CrowdClip) -> Iterator[Indices]:
    """Yield indices of characters in blocks, since a change block records changes until it ends."""
    for first in range(0, len(crowd.motion), BLOCK_SIZE):
        cancellation.check()
        yield np.arange(first, min(first + BLOCK_SIZE, len(crowd.motion)))


def set_transforms(prims: Sequence[Any], placement: Placement) -> None:
    """Set the transform of each prim to its character's placement.

    It is a matrix, since one reader does not support translations by whole numbers.
    """
    order = Vt.TokenArray(["xformOp:transform"])
    for prim, matrix in zip(prims, _matrices(placement), strict=True):
        prim_specs.varying_attribute(prim, "xformOp:transform", ValueTypes.Matrix4d, matrix)
        prim_specs.uniform_attribute(prim, "xformOpOrder", ValueTypes.TokenArray, order)


def _matrices(placement: Placement) -> Any:
    """Return each character's matrix4d, for row vectors: images of the axes, then the origin."""
    matrices = np.tile(np.eye(4), (len(placement), 1, 1))
    matrices[:, :3, :3] = quat.rotate(placement.turns[:, None], np.eye(3))
    matrices[:, 3, :3] = placement.positions
    return Vt.Matrix4dArray.FromNumpy(matrices)
