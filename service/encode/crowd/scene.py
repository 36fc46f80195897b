"""What a crowd's layer holds but for its motions: the model hierarchy and who stands where.

    /Crowd                      assembly, the default prim
      Prototype                 class, the one character that all others refer to
      Motions                   a SkelAnimation for each motion, outside of what is instanced
        m00000
      Characters                group
        c00000                  component: refers to the prototype, stands, is bound to a motion

USD never forgets a name, so they are few and always the same.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pxr import Sdf, Vt

from service.encode import facts, layers, specs
from service.encode.specs import Type
from service.motion import quat
from service.motion.crowd import CrowdClip, Placement

ROOT = Sdf.Path("/Crowd")
PROTOTYPE = ROOT.AppendChild("Prototype")
MOTIONS = ROOT.AppendChild("Motions")
CHARACTERS = ROOT.AppendChild("Characters")
MODEL = ("GeomModelAPI",)


def motion(index: int) -> str:
    """Name of a motion."""
    return f"m{index:05}"


def character(index: int) -> str:
    """Name of a character."""
    return f"c{index:05}"


def new(crowd: CrowdClip) -> Any:
    """Layer that states what the crowd is, with no character yet; the caller must keep it."""
    made = Sdf.Layer.CreateAnonymous("crowd.usda")
    layers.head(made, ROOT.name, crowd.frames, crowd.rate)
    made.customLayerData = {"posefield": facts.dictionary(crowd.facts)}
    specs.prim(made, ROOT.name, "Xform", MODEL).kind = "assembly"
    return made


def group(made: Any) -> Any:
    """New prim that holds the characters."""
    characters = specs.prim(made.GetPrimAtPath(ROOT), CHARACTERS.name, "Xform", MODEL)
    characters.kind = "group"
    return characters


def payload(owner: Any, path: str) -> None:
    """Let a prim be the default prim of another layer, which readers may leave out."""
    owner.SetInfo("payload", Sdf.PayloadListOp.Create(prependedItems=[Sdf.Payload(path)]))


def referring(made: Any, crowd: CrowdClip, instanced: bool) -> None:
    """Every character as a reference to the prototype, which USD may draw as one where instanced.

    A prim cannot be added below an instance, so its root is what is bound to a motion.
    """
    characters = group(made)
    prims = [specs.prim(characters, character(i), "SkelRoot") for i in range(len(crowd.motion))]
    prototype = Sdf.ReferenceListOp.Create(prependedItems=[Sdf.Reference("", PROTOTYPE)])
    for prim, played in zip(prims, crowd.motion, strict=True):
        prim.SetInfo("references", prototype)
        if instanced:
            prim.SetInfo("instanceable", True)
        specs.relation(prim, "skel:animationSource", MOTIONS.AppendChild(motion(played)))
    place(prims, crowd.placement)


def place(prims: Sequence[Any], placement: Placement) -> None:
    """Let each prim stand where its character does.

    As a matrix: one reader cannot take translations by whole numbers.
    """
    order = Vt.TokenArray(["xformOp:transform"])
    for prim, matrix in zip(prims, _matrices(placement), strict=True):
        specs.attribute(prim, "xformOp:transform", Type.Matrix4d, matrix)
        specs.uniform(prim, "xformOpOrder", Type.TokenArray, order)


def _matrices(placement: Placement) -> Any:
    """matrix4d of each character, for row vectors: its rows are where the axes and origin go."""
    matrices = np.tile(np.eye(4), (len(placement), 1, 1))
    matrices[:, :3, :3] = quat.rotate(placement.turns[:, None], np.eye(3))
    matrices[:, 3, :3] = placement.positions
    return Vt.Matrix4dArray.FromNumpy(matrices)
