"""Drives the add-on inside Blender: addon_drive.py ARCHIVE ADDRESS PID RESULT README.

The archive is installed as Blender installs extensions. What armatures did is kept with what was
asked for, to be compared elsewhere; what was said and done besides, as facts. PID is the service's,
which is stopped in the middle.
"""

import json
import os
import re
import signal
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np

# Blender's Z is up: (x, y, z) of the service is (x, -z, y) there.
TO_Y_UP = np.array([(1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)], dtype=float)
ELSEWHERE = "http://203.0.113.1:8000"
PATIENCE = 20.0

cases, arrays, facts = [], {}, {}


def install(archive):
    """Name of the add-on's package, installed and enabled."""
    done = bpy.ops.extensions.package_install_files(
        filepath=archive, repo="user_default", enable_on_install=True
    )
    facts["installed"] = sorted(done)
    return "bl_ext.user_default.posefield"


def part(name):
    """A module of the installed add-on."""
    return sys.modules[f"{PACKAGE}.{name}"]


def settings():
    return bpy.context.scene.posefield


def preferences():
    return bpy.context.preferences.addons[PACKAGE].preferences


def afresh(model, **told):
    """An empty scene in which a model is picked."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    # Factory settings switch add-ons off.
    if PACKAGE not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=PACKAGE)
    preferences().address = ADDRESS
    bpy.ops.posefield.refresh()
    settings().model = model
    for name, value in told.items():
        setattr(settings(), name, value)


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
        "performer": asked.performer,
        "level": asked.level,
        "root": asked.root,
        "loop": asked.loop,
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
    """What an operator says when it fails; empty where it does not."""
    try:
        call(**told)
    except RuntimeError as refusal:
        return str(refusal)
    return ""


def snapshot():
    """All that an import would change."""
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


# --- one family after another ----------------------------------------------------------------


def reaching():
    afresh("reaching", rate="OWN", fps=30.0)
    before = snapshot()
    bpy.ops.posefield.import_clip()
    facts["an import changes the scene"] = snapshot() != before
    facts["fps"] = [bpy.context.scene.render.fps, round(bpy.context.scene.render.fps_base, 6)]
    facts["range"] = [bpy.context.scene.frame_start, bpy.context.scene.frame_end]
    facts["frames"] = len(part("session").current.clip)
    facts["actions"] = [a.name for a in bpy.data.actions]
    record("new armature", {"controls": {"turn": 17.0}})
    armature = settings().character
    key(armature, damaged)
    record("damaged on purpose", None)


def damaged(curve, keys):
    if curve.data_path.endswith("rotation_quaternion") and curve.array_index == 1:
        keys[:, 1] += 0.01
    return keys


def late():
    afresh("reaching", rate="OWN", fps=30.0)
    bpy.ops.posefield.import_clip()
    key(settings().character, lambda _, keys: keys + np.array([1, 0], dtype=np.float32))
    record("keys a frame late on purpose", None)


def in_place_of_sliders():
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    old = part("questions").question(bpy.context.scene).controls
    settings().live = True
    for stature in np.linspace(1.6, 1.86, 40):
        slide(stature=float(stature), turn=float(50 * stature - 60))
    asked = time.monotonic()
    wait()
    facts["seconds to the last of forty moves"] = time.monotonic() - asked
    facts["actions after live"] = [a.name for a in bpy.data.actions]
    record("sliders moved", {"controls": old})
    record("its bones at rest", None, body="armature")
    facts["timer left"] = bpy.app.timers.is_registered(part("live").tick)


def undone():
    """An import is one step back, and what the sliders did since is none."""
    afresh("reaching")
    before = snapshot()
    slide(stature=1.7)
    facts["not live: unchanged"] = snapshot() == before
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.posefield.import_clip("EXEC_DEFAULT", True)
    settings().live = True
    for stature in (1.65, 1.75, 1.8):
        slide(stature=stature)
        wait()
    bpy.ops.ed.undo()
    facts["undone: as before"] = snapshot() == before
    bpy.ops.ed.redo()
    facts["redone: armatures"] = len(bpy.data.armatures)
    settings().live = True
    slide(stature=1.66)
    wait()
    record("live after undo and redo", {"controls": {"stature": 1.8}})


def onto_existing():
    for name, more, lengths in (
        ("other axes", other_axes, "ARMATURE"),
        ("other axes, clip's lengths", other_axes, "CLIP"),
        ("scaled object", scaled, "CLIP"),
        ("longer bones, clip's lengths", longer, "CLIP"),
    ):
        armature = existing(more)
        bpy.ops.posefield.import_clip(onto="ACTIVE", lengths=lengths)
        facts[f"{name}: armatures"] = len(bpy.data.armatures)
        facts[f"{name}: same"] = settings().character == armature
        record(name, {"controls": {"turn": 17.0}})
    own = existing(longer)
    own.pose.bones[3].constraints.new("LIMIT_ROTATION")
    own.animation_data.nla_tracks.new()
    own.rotation_euler = (0, np.radians(20), 0)
    bpy.context.view_layer.update()
    bpy.ops.posefield.import_clip(onto="ACTIVE")
    facts["disturbed"] = list(part("session").current.said)
    own = existing(longer)
    bpy.ops.posefield.import_clip(onto="ACTIVE")
    facts["longer bones said"] = list(part("session").current.said)
    record("longer bones, their own", {"body": "clip"}, body="armature")
    settings().live = True
    slide(turn=40.0)
    wait()
    record("longer bones, live", {"controls": {"turn": 17.0}}, body="armature")


def existing(change):
    """An armature as somebody else could have made it, with an action and Euler angles."""
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    armature = settings().character
    armature.animation_data.action = bpy.data.actions.new("Own")
    bpy.data.actions.remove(bpy.data.actions["reaching"])
    edit(armature, change)
    if change is scaled:
        armature.scale = (0.5, 0.5, 0.5)
    for bone in armature.pose.bones:
        bone.rotation_mode, bone.location = "XYZ", (0.1, 0.2, 0.3)
    bpy.context.view_layer.update()
    return armature


def other_axes(index, bone):
    bone.tail = bone.head + type(bone.head)((0.1, 0.02 * (index % 5), 0.03))
    bone.roll = 0.7 * index


def scaled(index, bone):
    head = 2 * bone.head
    bone.head, bone.tail = head, head + type(head)((0.0, 0.2, 0.1))


def longer(index, bone):
    head = 1.2 * bone.head
    bone.head, bone.tail = head, head + type(head)((0.0, 0.2, 0.1))


def refused():
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    own = settings().character
    edit(own, renamed)
    before = snapshot()
    facts["other names"] = said(bpy.ops.posefield.import_clip, onto="ACTIVE")
    facts["other names: unchanged"] = snapshot() == before
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    own = settings().character
    own.scale = (1, 2, 1)
    bpy.context.view_layer.update()
    facts["uneven scale"] = said(bpy.ops.posefield.import_clip, onto="ACTIVE")
    own.data.bones[7].use_inherit_rotation = False
    facts["no inheritance"] = said(bpy.ops.posefield.import_clip, onto="ACTIVE")
    edit(own, hung_elsewhere)
    facts["another tree"] = said(bpy.ops.posefield.import_clip, onto="ACTIVE")
    bpy.ops.object.mode_set(mode="EDIT")
    facts["being edited"] = said(bpy.ops.posefield.import_clip, onto="ACTIVE")
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = None
    facts["no armature"] = said(bpy.ops.posefield.import_clip, onto="ACTIVE")
    facts["no such control"] = said(bpy.ops.posefield.import_clip, controls='{"speed": 1}')
    facts["no numbers"] = said(bpy.ops.posefield.import_clip, controls="[1]")
    facts["no such model"] = said(bpy.ops.posefield.import_clip, model="nobody")
    preferences().address = ELSEWHERE
    facts["elsewhere"] = said(bpy.ops.posefield.refresh)
    preferences().address = "somewhere"
    facts["no address"] = said(bpy.ops.posefield.refresh)


def renamed(index, bone):
    if index in (3, 4):
        bone.name = f"Bone{index}"


def hung_elsewhere(index, bone):
    if index == 5:
        bone.parent = bone.parent.parent


def rates():
    for rate in (24.0, 29.97, 60.0):
        afresh("reaching", rate="OWN", fps=rate)
        bpy.ops.posefield.import_clip()
        facts[f"said at {rate}"] = list(part("session").current.said)
        record(f"{rate:g} a second", {"fps": 1.1 * rate})
    afresh("reaching", rate="OWN", fps=60.0, start=10)
    bpy.ops.posefield.import_clip(set_scene=False)
    facts["left rate"] = [bpy.context.scene.render.fps, bpy.context.scene.frame_end]
    record("60 a second in a scene of 24", {"fps": 24.0})
    afresh("reaching")
    bpy.context.scene.render.fps, bpy.context.scene.render.fps_base = 30, 1.001
    bpy.ops.posefield.import_clip()
    record("the scene's NTSC rate", {"fps": 24.0})
    afresh("reaching", level="3")
    bpy.ops.posefield.import_clip()
    record("level 3", {"level": 0})
    afresh("reaching", root="in_place")
    bpy.ops.posefield.import_clip()
    record("reaching in place", {"controls": {"turn": 17.0}})


def walking(model, performer, straight):
    """straight: controls at which the cycle does not turn."""
    for root, other in (("travelling", "in_place"), ("in_place", "travelling")):
        afresh(model, root=root)
        bpy.ops.posefield.import_clip()
        record(f"{model} {root}", {"root": other})
    afresh(model, performer=performer)
    bpy.ops.posefield.import_clip()
    record(f"{model} as {performer}", {"performer": None})
    afresh(model, loop=True, root="in_place")
    bpy.ops.posefield.import_clip()
    period = len(part("session").current.clip) - 1
    facts[f"{model} range of a loop"] = (
        bpy.context.scene.frame_end - bpy.context.scene.frame_start + 1 - period
    )
    record(f"{model} loop twice", {"root": "travelling"}, 2 * period + 1, cycles=2)
    for curve in curves(settings().character):
        for modifier in list(curve.modifiers):
            curve.modifiers.remove(modifier)
    record(f"{model} loop once on purpose", None, 2 * period + 1, cycles=2)
    afresh(model, loop=True)
    slide(**straight)
    bpy.ops.posefield.import_clip()
    facts[f"{model} travelling loop"] = list(part("session").current.said)
    period = len(part("session").current.clip) - 1
    repeated = any(curve.modifiers for curve in curves(settings().character))
    facts[f"{model} repeated"] = repeated
    count = 2 * period + 1 if repeated else period + 1
    record(f"{model} travelling loop", {"root": "in_place"}, count, cycles=2 if repeated else 1)


def losses():
    """What may happen between a question and its answer."""
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    settings().live = True
    slide(stature=1.7)
    bpy.data.objects.remove(settings().character)
    wait()
    facts["armature deleted"] = list(part("session").current.said)
    facts["armature deleted: live"] = settings().live
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    settings().live = True
    slide(stature=1.7)
    bpy.ops.object.delete()
    wait()
    facts["armature deleted by hand"] = list(part("session").current.said)
    reload()
    switched()


def reload():
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    slide(stature=1.7)
    settings().live = True
    file = str(RESULT.with_suffix(".blend"))
    bpy.ops.wm.save_as_mainfile(filepath=file)
    slide(stature=1.8)
    bpy.ops.wm.open_mainfile(filepath=file)
    facts["reload: next look"] = part("live").tick()
    facts["reload: live"] = settings().live
    before = snapshot()
    bpy.ops.posefield.refresh()
    facts["reload: unchanged"] = snapshot() == before
    facts["reload: stature"] = round(bpy.context.scene.posefield_controls.stature, 6)
    settings().live = True
    slide(stature=1.65)
    wait()
    record("live after a reload", {"controls": {"stature": 1.8}})


def switched():
    """The armature got an action of somebody else meanwhile, which must stay as it is."""
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    settings().live = True
    slide(stature=1.7)
    settings().character.animation_data.action = bpy.data.actions.new("Own")
    before = snapshot()
    wait()
    facts["another action"] = list(part("session").current.said)
    facts["another action: unchanged"] = snapshot() == before


class Layout:
    """A layout that writes down what is drawn on it, and refuses what Blender's would.

    Blender draws no panel without a window.
    """

    icons = bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items.keys()

    def __init__(self, rows):
        self.rows = rows

    def row(self, **_):
        return Layout(self.rows)

    column = row

    def label(self, text="", icon="NONE"):
        assert icon in self.icons, icon
        self.rows.append(text)

    def prop(self, data, name, text=None, slider=False):
        found = data.bl_rna.properties[name]
        self.rows.append(found.name if text is None else text)

    def operator(self, name, text=None, icon="NONE"):
        assert icon in self.icons, icon
        found = getattr(bpy.ops.posefield, name.removeprefix("posefield.")).get_rna_type()
        self.rows.append(found.name if text is None else text)
        return SimpleNamespace()


def drawn():
    rows = []
    kind = bpy.types.Panel.bl_rna_get_subclass_py("VIEW3D_PT_posefield")
    kind.draw(SimpleNamespace(layout=Layout(rows)), bpy.context)
    return rows


def panel():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if PACKAGE not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=PACKAGE)
    preferences().address = ADDRESS
    facts["drawn before"] = drawn()
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    facts["drawn after"] = drawn()
    slide(stature=2.5)
    facts["drawn outside"] = drawn()
    rows = []
    part("preferences").PosefieldPreferences.draw(
        SimpleNamespace(
            layout=Layout(rows), bl_rna=preferences().bl_rna, key="k", address=ELSEWHERE
        ),
        bpy.context,
    )
    facts["drawn preferences"] = rows
    found = bpy.context.scene.posefield_controls.bl_rna.properties["stature"]
    facts["slider"] = [
        round(getattr(found, name), 4) for name in ("soft_min", "soft_max", "hard_min", "hard_max")
    ]
    facts["slider words"] = [found.name, found.description]


def scripted(readme):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if PACKAGE not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=PACKAGE)
    (code,) = re.findall(r"```python\n(.*?)```", Path(readme).read_text(), re.S)
    exec(code.replace("http://127.0.0.1:8000", ADDRESS), {})
    record("the README's lines", {"controls": {"turn": 17.0}})


def stopped():
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    settings().live = True
    os.kill(PID, signal.SIGTERM)
    end = time.monotonic() + PATIENCE
    while not said(bpy.ops.posefield.refresh) and time.monotonic() < end:
        time.sleep(0.1)
    before = snapshot()
    facts["stopped"] = said(bpy.ops.posefield.import_clip)
    slide(stature=1.7)
    wait()
    facts["stopped, live"] = list(part("session").current.said)
    facts["stopped: drawn"] = drawn()
    facts["stopped: unchanged"] = snapshot() == before


def threads():
    return [each.name for each in threading.enumerate() if each.name == "posefield"]


def left():
    """What of the add-on Blender knows."""
    calls = (*bpy.app.handlers.load_pre, *bpy.app.handlers.load_post)
    known = [name for name in dir(bpy.types.Scene) if "posefield" in name]
    return known + [call.__name__ for call in calls if "posefield" in call.__module__]


def switched_off():
    live = part("live")
    slide(stature=1.75)
    thread = live._asking
    tick = live.tick
    facts["on: timer"] = bpy.app.timers.is_registered(tick)
    facts["on: threads"] = threads()
    facts["on: left"] = left()
    bpy.ops.preferences.addon_disable(module=PACKAGE)
    facts["off: timer"] = bpy.app.timers.is_registered(tick)
    facts["off: thread ended"] = thread.join(PATIENCE)
    facts["off: threads"] = threads()
    facts["off: left"] = left()
    bpy.ops.preferences.addon_enable(module=PACKAGE)
    facts["on again"] = hasattr(bpy.types.Scene, "posefield")
    bpy.ops.preferences.addon_disable(module=PACKAGE)


if __name__ == "__main__":
    archive, ADDRESS, pid, result, readme = sys.argv[1:6]
    PID, RESULT = int(pid), Path(result)
    PACKAGE = install(archive)
    for each in (reaching, late, in_place_of_sliders, undone, onto_existing, refused, rates):
        each()
    for given in json.loads(sys.argv[6]):
        walking(*given)
    losses()
    panel()
    scripted(readme)
    stopped()
    switched_off()
    np.savez(RESULT, **arrays)
    RESULT.with_suffix(".json").write_text(json.dumps({"cases": cases, "facts": facts}))
