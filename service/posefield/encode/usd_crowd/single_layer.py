"""Crowds as one layer without references to others.

usd-core holds a layer's samples until it has been exported, so the crowd is in memory once.
"""

from typing import Any

import numpy as np
from pxr import Sdf

from posefield.common import cancellation
from posefield.encode.character import character
from posefield.encode.character.character import CharacterRig
from posefield.encode.usd import character_prims
from posefield.encode.usd_crowd import crowd_motions, crowd_scene, crowd_summary
from posefield.encode.usd_crowd.crowd_motions import MotionSamples
from posefield.encode.usd_layers import prim_specs
from posefield.motion.crowd_clip import CrowdClip
from posefield.question.body_kind import BodyKind


def referencing_layer(crowd: CrowdClip, form: str, instanced: bool, body: BodyKind) -> Any:
    """Return a layer in which every character refers to one prototype; the caller must hold it."""
    made, rig = crowd_scene.new_layer(crowd, form), character.rig(crowd.skeleton, body)
    root = made.GetPrimAtPath(crowd_scene.ROOT)
    prototype = character_prims.root(root, crowd_scene.PROTOTYPE.name, rig)
    character_prims.add_blend_shapes(prototype, rig, crowd.curves)
    character_prims.set_values(prototype, character_prims.values(character.rest_pose_arrays(rig)))
    prototype.specifier = Sdf.SpecifierClass
    group = prim_specs.prim(root, crowd_scene.MOTIONS.name, "Scope")
    notes = []
    for index, motion in enumerate(crowd_motions.all_motions(crowd, rig)):
        name = crowd_scene.motion_name(index)
        animation = character_prims.animation(group, name, rig.paths, crowd.curves)
        prim_specs.set_time_samples(animation, motion.samples)
        notes.append(motion.summary)
    crowd_scene.add_references(made, crowd, instanced)
    crowd_summary.add_to_references(made, crowd, notes)
    return made


def flat_layer(crowd: CrowdClip, form: str, body: BodyKind) -> Any:
    """Return a layer in which every character has its own data; the caller must hold it."""
    made, rig = crowd_scene.new_layer(crowd, form), character.rig(crowd.skeleton, body)
    _copy_prototype(made, crowd, rig)
    notes = []
    for index, motion in enumerate(crowd_motions.all_motions(crowd, rig)):
        _copy_motion(made, crowd, index, rig, motion)
        notes.append(motion.summary)
    crowd_summary.add_to_flat(made, crowd, notes)
    return made


def _copy_prototype(made: Any, crowd: CrowdClip, rig: CharacterRig) -> None:
    # Sdf.CopySpec would take a third of the time, but it adds the fields of a spec in the order of
    # their names' addresses, which differs between processes and shows in binary files.
    group, values = (
        crowd_scene.characters_prim(made),
        character_prims.values(character.rest_pose_arrays(rig)),
    )
    for some in crowd_scene.character_blocks(crowd):
        with Sdf.ChangeBlock():
            prims = [character_prims.root(group, crowd_scene.character_name(i), rig) for i in some]
            for prim in prims:
                character_prims.add_blend_shapes(prim, rig, crowd.curves)
                character_prims.set_values(prim, values)
            crowd_scene.set_transforms(prims, crowd.placement.select(some))


def _copy_motion(
    layer: Any, crowd: CrowdClip, played: int, rig: CharacterRig, motion: MotionSamples
) -> None:
    """Give each character that plays a motion, of an index, a copy of it.

    The copy has the character's name: some readers identify an animation by the name of its prim
    alone.
    """
    first = None
    for index in np.flatnonzero(crowd.motion == played).tolist():
        cancellation.check()
        root = layer.GetPrimAtPath(crowd_scene.character_path(index))
        own = character_prims.animation(root, root.name, rig.paths, crowd.curves)
        if first is None:
            prim_specs.set_time_samples(own, motion.samples)
            first = own.path
        else:
            # Each spec lacks at most one field, so the order of copying does not matter.
            Sdf.CopySpec(layer, first, layer, own.path)
        character_prims.bind_animation(root, own.path)
