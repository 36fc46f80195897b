"""Crowds as one layer without references to others.

usd-core holds a layer's samples until it has been exported, so the crowd is in memory once.
"""

from typing import Any

import numpy as np
from pxr import Sdf

from posefield.common import cancellation
from posefield.common.units import Indices
from posefield.encode.character import character
from posefield.encode.character.character import Rig
from posefield.encode.usd import character_prims, prim_specs
from posefield.encode.usd_crowd import crowd_motions, crowd_scene, crowd_summary
from posefield.encode.usd_crowd.crowd_motions import Motion
from posefield.motion.crowd_clip import CrowdClip


def referring(crowd: CrowdClip, form: str, instanced: bool) -> Any:
    """Return a layer in which every character refers to one prototype; the caller must hold it."""
    made, rig = crowd_scene.new(crowd, form), character.rig(crowd.skeleton)
    root = made.GetPrimAtPath(crowd_scene.ROOT)
    prototype = character_prims.root(root, crowd_scene.PROTOTYPE.name, rig)
    character_prims.fill(prototype, character_prims.values(character.at_rest(rig)))
    prototype.specifier = Sdf.SpecifierClass
    group = prim_specs.prim(root, crowd_scene.MOTIONS.name, "Scope")
    notes = []
    for index, motion in enumerate(crowd_motions.each(crowd, rig)):
        animation = character_prims.animation(group, crowd_scene.motion(index), rig.paths)
        prim_specs.samples(animation, motion.samples)
        notes.append(motion.note)
    crowd_scene.referring(made, crowd, instanced)
    crowd_summary.referring(made, crowd, notes)
    return made


def flat(crowd: CrowdClip, form: str) -> Any:
    """Return a layer in which every character has its own data; the caller must hold it."""
    made, rig = crowd_scene.new(crowd, form), character.rig(crowd.skeleton)
    _copies(made, crowd, rig)
    notes = []
    for index, motion in enumerate(crowd_motions.each(crowd, rig)):
        _play(made, np.flatnonzero(crowd.motion == index), rig, motion)
        notes.append(motion.note)
    crowd_summary.flat(made, crowd, notes)
    return made


def _copies(made: Any, crowd: CrowdClip, rig: Rig) -> None:
    # Sdf.CopySpec would take a third of the time, but it adds the fields of a spec in the order of
    # their names' addresses, which differs between processes and shows in binary files.
    group, values = crowd_scene.group(made), character_prims.values(character.at_rest(rig))
    for some in crowd_scene.blocks(crowd):
        with Sdf.ChangeBlock():
            prims = [character_prims.root(group, crowd_scene.character(i), rig) for i in some]
            for prim in prims:
                character_prims.fill(prim, values)
            crowd_scene.place(prims, crowd.placement.of(some))


def _play(layer: Any, characters: Indices, rig: Rig, motion: Motion) -> None:
    """Give each character that plays a motion a copy of it.

    The copy has the character's name: some readers identify an animation by the name of its prim
    alone.
    """
    first = None
    for index in characters:
        cancellation.check()
        root = layer.GetPrimAtPath(crowd_scene.place_of(index))
        own = character_prims.animation(root, root.name, rig.paths)
        if first is None:
            prim_specs.samples(own, motion.samples)
            first = own.path
        else:
            # Each spec lacks at most one field, so the order of copying does not matter.
            Sdf.CopySpec(layer, first, layer, own.path)
        character_prims.bind(root, own.path)
