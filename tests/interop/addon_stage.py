"""Helpers to drive the add-on inside Blender: scenes, sliders and recordings.

`cases` and `arrays` hold recorded and requested joint positions, `facts` messages and effects.
"""

import sys
import threading
import time

import bpy
import numpy as np

PACKAGE = "bl_ext.user_default.posefield"
PATIENCE = 20.0

# Blender's Z is up: (x, y, z) of the service is (x, -z, y) there.
TO_Y_UP = np.array([(1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)], dtype=float)

cases, arrays, facts = [], {}, {}
service = {}
"""Its address."""


def install(archive):
    """The add-on from its archive, as Blender installs extensions, and enabled."""
    done = bpy.ops.extensions.package_install_files(
        filepath=archive, repo="user_default", enable_on_install=True
    )
    facts["installed"] = sorted(done)


def empty():
    """An empty scene, and the add-on, which factory settings switch off."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if PACKAGE not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=PACKAGE)
    preferences().address = service["address"]


def part(name):
    """A module of the installed add-on."""
    return sys.modules[f"{PACKAGE}.{name}"]


def settings():
    return bpy.context.scene.posefield


def preferences():
    return bpy.context.preferences.addons[PACKAGE].preferences


def afresh(model, labels=None, **told):
    """An empty scene in which a model is picked, and perhaps names or weights by label set."""
    empty()
    bpy.ops.posefield.refresh()
    settings().model = model
    for name, value in (labels or {}).items():
        choose(name, value)
    for name, value in told.items():
        setattr(settings(), name, value)


def choose(name, value):
    """Choose a name of a label set, or weights of several, as in the panel."""
    choice = settings().labels[name]
    choice.choice = ":MIXTURE" if isinstance(value, dict) else value
    for label, weight in value.items() if isinstance(value, dict) else ():
        choice.weights[label].weight = weight


def record(name, wrong, frames=None, **more):
    """Keep where the joints are, what was asked for, and what else it must not be taken for."""
    armature, own = settings().character, settings()
    asked = part("questions").question(bpy.context.scene)
    step = scene_rate() / asked.fps
    count = frames or len(part("session").current.clip)
    joints = [bone.name for bone in armature.pose.bones]
    at = [own.start + step * i for i in range(count)]
    arrays[f"{name}/matrices"] = np.array([pose(armature, joints, frame) for frame in at])
    arrays[f"{name}/offsets"] = offsets(armature)
    question = {
        "controls": asked.controls,
        "fps": asked.fps,
        "labels": asked.labels,
        "level": asked.level,
        "root": asked.root,
        "loop": asked.loop,
        "take": asked.variation.seed,
        "variety": asked.variation.variety,
        "detail": asked.variation.detail,
        "feet": None if asked.variation.feet == "default" else asked.variation.feet,
    }
    cases.append(
        {"name": name, "model": own.model, "joints": joints, "question": question, "wrong": wrong}
        | more
    )


def pose(armature, joints, frame):
    whole = int(frame // 1)
    bpy.context.scene.frame_set(whole, subframe=frame - whole)
    found = np.array(
        [TO_Y_UP @ np.array(armature.matrix_world @ armature.pose.bones[j].matrix) for j in joints]
    )
    # Bones have axes of their own, the same in every pose, and an object its scale.
    rest = np.array(
        [TO_Y_UP[:3, :3] @ np.array(armature.data.bones[j].matrix_local)[:3, :3] for j in joints]
    )
    turns = found[:, :3, :3] / np.array(armature.matrix_world.to_scale())
    found[:, :3, :3] = turns @ np.swapaxes(rest, -1, -2)
    return found


def offsets(armature):
    """From parent to child at rest in the world, Y up."""
    found = []
    for bone in armature.data.bones:
        own = np.array(bone.head_local) - np.array(
            bone.parent.head_local if bone.parent else (0, 0, 0)
        )
        found.append(TO_Y_UP[:3, :3] @ own * np.array(armature.matrix_world.to_scale()))
    return np.array(found)


def scene_rate():
    return part("without_blender.rates").rate(
        bpy.context.scene.render.fps, bpy.context.scene.render.fps_base
    )


def slide(**controls):
    for name, value in controls.items():
        setattr(bpy.context.scene.posefield_controls, name, value)


def wait():
    """As Blender's own timers do, until there is nothing to come."""
    end = time.monotonic() + PATIENCE
    while (again := part("live").tick()) is not None:
        if time.monotonic() > end:
            raise TimeoutError("the service did not answer")
        time.sleep(again)


def said(call, **told):
    """Return an operator's error message; empty if it succeeds."""
    try:
        call(**told)
    except RuntimeError as refusal:
        return str(refusal)
    return ""


def snapshot():
    """All that an import would change, the panel's settings too."""
    own = bpy.context.scene
    sliders = getattr(own, "posefield_controls", None)
    return made(), values(own.posefield), values(sliders) if sliders else {}


def values(group):
    """Return a group's properties by name; for a pointer, its target's name."""
    found = {name: getattr(group, name) for name in group.bl_rna.properties.keys()}
    del found["rna_type"]
    return {name: plain(value) for name, value in found.items()}


def plain(value):
    """Return a value that can be compared later: a collection's entries, a pointer's name."""
    if hasattr(value, "foreach_set"):
        return [values(each) for each in value]
    return getattr(value, "name", value)


def made():
    """Return the scene's objects, keyframes and times."""
    scene = bpy.context.scene
    keys = {}
    for action in bpy.data.actions:
        for layer in action.layers:
            curves = [c for strip in layer.strips for bag in strip.channelbags for c in bag.fcurves]
            for curve in curves:
                values = np.empty(2 * len(curve.keyframe_points), dtype=np.float32)
                curve.keyframe_points.foreach_get("co", values)
                keys[action.name, curve.data_path, curve.array_index] = values.tobytes()
    things = (
        tuple(sorted(o.name for o in bpy.data.objects)),
        tuple(sorted(bpy.data.armatures.keys())),
    )
    render = scene.render
    return things, keys, render.fps, render.fps_base, scene.frame_start, scene.frame_end


def curves(armature):
    data = armature.animation_data
    return data.action.layers[0].strips[0].channelbag(data.action_slot).fcurves


def key(armature, change):
    """Change the keys (F, 2) of each curve of turns."""
    for curve in curves(armature):
        points = curve.keyframe_points
        found = np.empty(2 * len(points), dtype=np.float32)
        points.foreach_get("co", found)
        points.foreach_set("co", change(curve, found.reshape(-1, 2)).ravel())
        curve.update()


def edit(armature, change):
    """Change each bone of an armature at rest."""
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for index, bone in enumerate(armature.data.edit_bones):
        change(index, bone)
    bpy.ops.object.mode_set(mode="OBJECT")


def threads():
    return [each.name for each in threading.enumerate() if each.name == "posefield"]


def left():
    """Return the add-on's properties and handlers in Blender."""
    calls = (*bpy.app.handlers.load_pre, *bpy.app.handlers.load_post)
    known = [name for name in dir(bpy.types.Scene) if "posefield" in name]
    return known + [call.__name__ for call in calls if "posefield" in call.__module__]
