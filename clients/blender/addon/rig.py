"""Armatures: creation for a clip, and rest pose of existing ones."""

import bpy
import numpy as np

from .without_blender import bones, faults
from .without_blender.bones import Rest
from .without_blender.cards import Card
from .without_blender.clips import Clip

EVEN = 1e-4
"""Largest difference between the scales of two axes, as a share of the larger."""


def make(context, card: Card, clip: Clip):
    """Create an armature with the bone lengths of a checked clip in the active collection."""
    if context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    armature = bpy.data.objects.new(card.name, bpy.data.armatures.new(card.name))
    context.collection.objects.link(armature)
    for other in context.selected_objects:
        other.select_set(False)
    armature.select_set(True)
    context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    _bones(armature.data.edit_bones, clip, card)
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature


def _bones(edited, clip: Clip, card: Card) -> None:
    heads = bones.at_rest(clip)
    tails = bones.tails(clip, heads, card.tips)
    for (name, parent), head, tail in zip(clip.parents.items(), heads, tails, strict=True):
        bone = edited.new(name)
        bone.head, bone.tail = head, tail
        if parent is not None:
            bone.parent = edited[parent]


def active(context):
    """Return the active armature; raise Mismatch for another object, and in edit mode."""
    found = context.view_layer.objects.active
    if found is None or found.type != "ARMATURE":
        raise faults.Mismatch(
            f"the active object is {found.name if found else 'none'}, expected an armature"
        )
    return editable(found)


def editable(armature):
    """Return an armature; raise Mismatch for one in edit mode."""
    if armature.mode == "EDIT":
        raise faults.Mismatch(f"{armature.name} is being edited: leave edit mode first")
    return armature


def check(armature, clip: Clip) -> None:
    """Raise Mismatch for an armature that does not fit the clip."""
    if not armature.is_editable or not armature.data.is_editable:
        raise faults.Mismatch(f"the armature {armature.name} is linked from another file")
    own = armature.data.bones
    bones.check(clip, {bone.name: bone.parent and bone.parent.name for bone in own})
    loose = [b.name for b in own if not (b.use_inherit_rotation and b.use_local_location)]
    if loose:
        raise faults.Mismatch(
            f"{len(loose)} bones, {loose[0]} for one, inherit no rotation or move along other axes"
            " than their own; expected Inherit Rotation and Local Location everywhere"
        )
    _check_scale(_scale(armature))


def rest(armature, clip: Clip) -> Rest:
    """Return the rest matrices of a checked armature in the clip's order."""
    own = armature.data.bones
    matrices = np.array([own[name].matrix_local for name in clip.names], dtype=float)
    return Rest(matrices, float(_scale(armature).mean()))


def settle(armature) -> list[str]:
    """Set all bones to quaternions, clear location and scale, and return notes."""
    posed = armature.pose.bones
    others = [bone for bone in posed if bone.rotation_mode != "QUATERNION"]
    for bone in others:
        bone.rotation_mode = "QUATERNION"
    for bone in posed:
        bone.location, bone.scale = (0, 0, 0), (1, 1, 1)
    return [f"{len(others)} bones turn by quaternions now"] * bool(others) + disturbed(armature)


def disturbed(armature) -> list[str]:
    """Return notes on constraints, NLA tracks and tilt, which change the armature's motion."""
    constrained = sum(bool(bone.constraints) for bone in armature.pose.bones)
    tracks = len(armature.animation_data.nla_tracks) if armature.animation_data else 0
    tilt = np.degrees(np.arccos(np.clip(_upright(armature), -1, 1)))
    said = {
        f"bones with constraints, which move them away from the clip: {constrained}": constrained,
        f"NLA tracks that play beside the clip: {tracks}": tracks,
        f"the armature is tilted by {tilt:.0f} degrees: apply its rotation": tilt > 1,
    }
    return [sentence for sentence, so in said.items() if so]


def _check_scale(scale) -> None:
    if scale.min() <= 0 or np.ptp(scale) > EVEN * scale.max():
        raise faults.Mismatch(
            f"the armature is scaled by {scale.round(4).tolist()}, expected the same along all"
            " axes: apply the scale"
        )


def _scale(armature):
    return np.array(armature.matrix_world.to_scale(), dtype=float)


def _upright(armature) -> float:
    """Return the cosine between the armature's Z axis and the world's."""
    axis = np.array(armature.matrix_world, dtype=float)[:3, 2]
    return float(axis[2] / np.linalg.norm(axis))
