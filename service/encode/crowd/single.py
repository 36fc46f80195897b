"""A crowd as one layer that needs no other.

usd-core holds a layer's samples until it has been exported: the crowd is in memory once.
"""

from typing import Any

import numpy as np
from pxr import Sdf

from service.encode import character, specs
from service.encode.character import Rig
from service.encode.crowd import motions, scene, summary
from service.encode.crowd.motions import Motion
from service.motion.crowd import CrowdClip


def referring(crowd: CrowdClip, instanced: bool) -> Any:
    """Layer in which every character refers to one prototype; the caller must keep it."""
    made, rig = scene.new(crowd), character.rig(crowd.skeleton)
    root = made.GetPrimAtPath(scene.ROOT)
    prototype = character.root(root, scene.PROTOTYPE.name, rig)
    character.fill(prototype, character.at_rest(rig))
    prototype.specifier = Sdf.SpecifierClass
    group = specs.prim(root, scene.MOTIONS.name, "Scope")
    notes = []
    for index, motion in enumerate(motions.each(crowd, rig)):
        animation = character.animation(group, scene.motion(index), rig.paths)
        specs.samples(animation, motion.samples)
        notes.append(motion.note)
    with Sdf.ChangeBlock():
        scene.referring(made, crowd, instanced)
        summary.referring(made, crowd, notes)
    return made


def flat(crowd: CrowdClip) -> Any:
    """Layer in which every character has all that it needs; the caller must keep it."""
    made, rig = scene.new(crowd), character.rig(crowd.skeleton)
    with Sdf.ChangeBlock():
        characters = _copies(made, crowd, rig)
    notes = []
    for index, motion in enumerate(motions.each(crowd, rig)):
        _play([characters[i] for i in np.flatnonzero(crowd.motion == index)], rig, motion)
        notes.append(motion.note)
    with Sdf.ChangeBlock():
        summary.flat(made, crowd, notes)
    return made


def _copies(made: Any, crowd: CrowdClip, rig: Rig) -> list[Any]:
    source = Sdf.Layer.CreateAnonymous("character.usda")
    prim = character.root(source, "Character", rig)
    character.fill(prim, character.at_rest(rig))
    scene.group(made)
    paths = [scene.CHARACTERS.AppendChild(scene.character(i)) for i in range(len(crowd.motion))]
    for copy in paths:
        Sdf.CopySpec(source, prim.path, made, copy)
    prims = [made.GetPrimAtPath(copy) for copy in paths]
    scene.place(prims, crowd.placement)
    return prims


def _play(characters: list[Any], rig: Rig, motion: Motion) -> None:
    """Give all who play a motion a copy of it.

    It has the character's name: readers that know an animation by its prim's own name alone can
    then tell whose it is.
    """
    for index, root in enumerate(characters):
        if index == 0:
            made = character.animation(root, root.name, rig.paths)
            specs.samples(made, motion.samples)
        else:
            Sdf.CopySpec(root.layer, made.path, root.layer, root.path.AppendChild(root.name))
        character.bind(root, root.path.AppendChild(root.name))
