"""Crowds as one layer, or as many: an entry, the character, one for each motion, and a summary.

usd-core holds a layer's samples until it has been exported, so a crowd of one layer is in memory
once. Of many layers, motions are written as they are computed, in a fraction of the time. The
summary is a sublayer of the entry, so that the entry can be written before any motion is computed.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from pxr import Sdf

from posefield.common import cancellation
from posefield.common.errors import InvalidField
from posefield.encode import archives
from posefield.encode.archives import ZipMember
from posefield.encode.character import character
from posefield.encode.character.character import CharacterRig
from posefield.encode.usd import character_prims
from posefield.encode.usd_crowd import crowd_scene
from posefield.encode.usd_crowd.crowd_scene import MotionSamples
from posefield.encode.usd_layers import layers
from posefield.motion.clip import CrowdClip
from posefield.question.motion_question import BodyKind


def referencing_layer(crowd: CrowdClip, form: str, instanced: bool, body: BodyKind) -> Any:
    """Return a layer in which every character refers to one prototype; the caller must hold it."""
    layer, rig = crowd_scene.new_layer(crowd, form), character.rig(crowd.skeleton, body)
    root = layer.GetPrimAtPath(crowd_scene.ROOT)
    prototype = character_prims.root(root, crowd_scene.PROTOTYPE.name, rig)
    character_prims.add_blend_shapes(prototype, rig, crowd.curves)
    character_prims.set_values(prototype, character_prims.values(character.rest_pose_arrays(rig)))
    prototype.specifier = Sdf.SpecifierClass
    group = layers.prim(root, crowd_scene.MOTIONS.name, "Scope")
    notes = []
    for index, motion in enumerate(crowd_scene.all_motions(crowd, rig)):
        name = crowd_scene.motion_name(index)
        animation = character_prims.animation(group, name, rig.paths, crowd.curves)
        layers.set_time_samples(animation, motion.samples)
        notes.append(motion.summary)
    crowd_scene.add_references(layer, crowd, instanced)
    crowd_scene.add_to_references(layer, crowd, notes)
    return layer


def flat_layer(crowd: CrowdClip, form: str, body: BodyKind) -> Any:
    """Return a layer in which every character has its own data; the caller must hold it."""
    layer, rig = crowd_scene.new_layer(crowd, form), character.rig(crowd.skeleton, body)
    _copy_prototype(layer, crowd, rig)
    notes = []
    for index, motion in enumerate(crowd_scene.all_motions(crowd, rig)):
        _copy_motion(layer, crowd, index, rig, motion)
        notes.append(motion.summary)
    crowd_scene.add_to_flat(layer, crowd, notes)
    return layer


def _copy_prototype(layer: Any, crowd: CrowdClip, rig: CharacterRig) -> None:
    # Sdf.CopySpec would take a third of the time, but it adds the fields of a spec in the order of
    # their names' addresses, which differs between processes and shows in binary files.
    group, values = (
        crowd_scene.characters_prim(layer),
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
        skel_animation = character_prims.animation(root, root.name, rig.paths, crowd.curves)
        if first is None:
            layers.set_time_samples(skel_animation, motion.samples)
            first = skel_animation.path
        else:
            # Each spec lacks at most one field, so the order of copying does not matter.
            Sdf.CopySpec(layer, first, layer, skel_animation.path)
        character_prims.bind_animation(root, skel_animation.path)


FOLDER, CHARACTER, SUMMARY = "crowd_clips", "character.usdc", "summary.usdc"

# Upper bounds in bytes: samples of a joint in a frame; heads of both samples, time codes and level
# of a frame; the rest of a motion's layer; a character; and the rest of the entry and the body.
SAMPLE, FRAME, LAYER, EACH, REST = 4 * (3 + 4), 40, 8_000, 2_000, 100_000
# Of a curve: a weight in a frame with its share of the head; its name in a layer; its blend shape.
WEIGHT, NAME, SHAPE = 12, 200, 1_000


def size_bound(crowd: CrowdClip) -> int:
    """Return an upper bound of the bytes of all layers."""
    curves = len(crowd.curves)
    frame = FRAME + SAMPLE * len(crowd.skeleton) + WEIGHT * curves
    layer = LAYER + NAME * curves + crowd.frames * frame
    return (
        REST + SHAPE * curves + crowd_scene.motion_count(crowd) * layer + len(crowd.motion) * EACH
    )


def check_size(crowd: CrowdClip) -> None:
    """Raise InvalidField if an archive of the crowd could exceed the limits of a zip."""
    size, members = size_bound(crowd), crowd_scene.motion_count(crowd) + 3
    if size > archives.BYTES or members > archives.MEMBERS:
        sizes = f"{size / 1e9:.1f} GB in {members} layers"
        expected = f"{archives.BYTES / 1e9:.1f} GB in {archives.MEMBERS}"
        raise InvalidField("format", f"{sizes}, expected at most {expected} in a usdz; take usd")


def root_layer(crowd: CrowdClip, instanced: bool, folder: str) -> bytes:
    """Return the root layer, which refers to the others in a folder beside it."""
    layer = crowd_scene.new_layer(crowd, "usdc")
    root = layer.GetPrimAtPath(crowd_scene.ROOT)
    layer.subLayerPaths.append(f"./{folder}/{SUMMARY}")
    with Sdf.ChangeBlock():
        prototype = layers.prim(root, crowd_scene.PROTOTYPE.name, "SkelRoot")
        prototype.specifier, prototype.kind = Sdf.SpecifierClass, "component"
        crowd_scene.set_payload(prototype, f"./{folder}/{CHARACTER}")
        group = layers.prim(root, crowd_scene.MOTIONS.name, "Scope")
        for name in map(crowd_scene.motion_name, range(crowd_scene.motion_count(crowd))):
            crowd_scene.set_payload(
                layers.prim(group, name, "SkelAnimation"), f"./{folder}/{name}.usdc"
            )
    crowd_scene.add_references(layer, crowd, instanced)
    return layers.crate_bytes(layer)


def referenced_layers(crowd: CrowdClip, body: BodyKind) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each other layer, one at a time."""
    rig, notes = character.rig(crowd.skeleton, body), []
    standing = _layer("Character", crowd)
    prim = character_prims.root(standing, "Character", rig)
    character_prims.add_blend_shapes(prim, rig, crowd.curves)
    character_prims.set_values(prim, character_prims.values(character.rest_pose_arrays(rig)))
    yield CHARACTER, layers.crate_bytes(standing)
    for index, motion in enumerate(crowd_scene.all_motions(crowd, rig)):
        notes.append(motion.summary)
        yield (
            f"{crowd_scene.motion_name(index)}.usdc",
            crowd_scene.motion_layer(crowd, rig, motion.samples),
        )
    last = _layer(crowd_scene.ROOT.name, crowd)
    crowd_scene.add_to_references(last, crowd, notes)
    yield SUMMARY, layers.crate_bytes(last)


def members(crowd: CrowdClip, instanced: bool, body: BodyKind) -> Iterator[ZipMember]:
    """Yield all layers as members of an archive, the entry first."""
    yield archives.whole("crowd.usdc", root_layer(crowd, instanced, FOLDER))
    for name, content in referenced_layers(crowd, body):
        yield archives.whole(f"{FOLDER}/{name}", content)


def _layer(default: str, crowd: CrowdClip) -> Any:
    layer = Sdf.Layer.CreateAnonymous("part.usdc")
    layers.set_layer_metadata(layer, default, crowd.frames, crowd.rate)
    return layer
