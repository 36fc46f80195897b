"""Characters and crowds in a scene, made by Blender's own importers of glTF and USD."""

import tempfile
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from .without_blender.service import Fault

STRAIGHT = 1e-6
"""Largest square of the part by which a cycle's last root rotation may differ from its first."""


def import_character(content: bytes, name: str, start: int, replaced=None):
    """Import a glTF file and return its armature, whose motion begins at a frame.

    replaced: armature to remove with its meshes and its action; its place is kept.
    """
    before = set(bpy.data.objects)
    with _file(content, "motion.glb") as path, _unchanged_time():
        bpy.ops.import_scene.gltf(filepath=path, disable_bone_shape=True)
    made = [each for each in bpy.data.objects if each not in before]
    armature = next((each for each in made if each.type == "ARMATURE"), None)
    if armature is None or armature.animation_data is None:
        raise Fault("the file of the service has no armature with a motion")
    if replaced is not None:
        armature.matrix_world = replaced.matrix_world.copy()
        _remove(replaced)
    armature.name = armature.data.name = armature.animation_data.action.name = name
    for curve in curves(armature.animation_data.action):
        _shift(curve, start)
    return armature


def import_crowd(content: bytes, name: str) -> int:
    """Import a USD file of a crowd into a collection of its own; return the number of armatures."""
    collection = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(collection)
    before, layers = set(bpy.data.objects), bpy.context.view_layer.layer_collection
    active = bpy.context.view_layer.active_layer_collection
    bpy.context.view_layer.active_layer_collection = layers.children[collection.name]
    with _file(content, "crowd.usdc") as path, _unchanged_time():
        bpy.ops.wm.usd_import(filepath=path, set_frame_range=False)
    bpy.context.view_layer.active_layer_collection = active
    made = [each for each in bpy.data.objects if each not in before]
    return sum(each.type == "ARMATURE" for each in made)


def existing(scene, armature):
    """Return an imported armature; raise Fault if it was deleted."""
    # The pointer keeps a deleted object, but no scene contains it.
    if armature is None or armature.name not in scene.objects:
        raise Fault("there is no imported armature in this scene: import a clip first")
    return armature


def set_range(scene, first: int, last: int) -> list[str]:
    """Set the frames that the scene plays; return a note if they change."""
    before = scene.frame_start, scene.frame_end
    scene.frame_start, scene.frame_end = first, max(first, last)
    now = scene.frame_start, scene.frame_end
    return [] if before == now else [f"scene range {before[0]}-{before[1]} -> {now[0]}-{now[1]}"]


def last_frame(armature) -> int:
    """Return the last frame of an armature's action."""
    return int(np.ceil(armature.animation_data.action.frame_range[1] - 1e-3))


def repeat(armature) -> list[str]:
    """Repeat a cycle before and after by Cycles modifiers; return the reason if that cannot be."""
    action = armature.animation_data.action
    turns = [each for each in curves(action) if each.data_path.endswith("rotation_quaternion")]
    root = turns[0].data_path
    ends = [
        [each.evaluate(frame) for each in turns if each.data_path == root]
        for frame in action.frame_range
    ]
    if 1.0 - np.dot(*ends) ** 2 > STRAIGHT:
        return ["the cycle turns, which no modifier can repeat: in place it could be"]
    for curve in curves(action):
        modifier = curve.modifiers.new("CYCLES")
        onward = curve.data_path.endswith(".location")
        modifier.mode_before = modifier.mode_after = "REPEAT_OFFSET" if onward else "REPEAT"
    return []


def put_markers(scene, name: str, moments) -> None:
    """Replace the markers of a script, which begin with its name. moments: frames and words."""
    begin = f"{name}: "
    # Markers have no custom properties in Blender 5.
    for marker in [each for each in scene.timeline_markers if each.name.startswith(begin)]:
        scene.timeline_markers.remove(marker)
    for frame, words in moments:
        scene.timeline_markers.new(begin + words, frame=frame)


def curves(action):
    """Return the curves of an action with layers, as Blender 4.5 and 5.0 have them."""
    return [
        curve
        for layer in action.layers
        for strip in layer.strips
        for bag in strip.channelbags
        for curve in bag.fcurves
    ]


@contextmanager
def _file(content: bytes, name: str):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(content)
        yield str(path)


@contextmanager
def _unchanged_time():
    """Keep the frame and the range of the scene, which importers change."""
    scene = bpy.context.scene
    before = scene.frame_start, scene.frame_end, scene.frame_current
    yield
    scene.frame_start, scene.frame_end, scene.frame_current = before


def _remove(armature) -> None:
    action = armature.animation_data.action if armature.animation_data else None
    objects = (*armature.children_recursive, armature)
    data = [each.data for each in objects if each.data is not None]
    materials = [each for one in data for each in getattr(one, "materials", ()) if each]
    bpy.data.batch_remove(objects)
    # Blender keeps what nothing uses until the file is saved.
    for unused in (data, [action] if action else [], materials):
        bpy.data.batch_remove([each for each in dict.fromkeys(unused) if not each.users])


def _shift(curve, start: int) -> None:
    points = curve.keyframe_points
    pairs = np.empty(2 * len(points), np.float32)
    points.foreach_get("co", pairs)
    pairs[::2] += start
    points.foreach_set("co", pairs)
    curve.update()
