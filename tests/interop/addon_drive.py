"""Driver of the add-on inside Blender: addon_drive.py ARCHIVE ADDRESS RESULT README.

It installs the archive as an extension, and records the armatures' motion with the requested one
for later comparison, and messages and other effects as facts.
"""

import json
import re
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np

PACKAGE = "bl_ext.user_default.posefield"
# Blender's Z is up: (x, y, z) of the service is (x, -z, y) there.
TO_Y_UP = np.array([(1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)], dtype=float)
SCRIPT = """{"segments": [
  {"kind": "walk", "model": "stroll", "seconds": 2},
  {"kind": "hold", "seconds": 1}]}"""

cases, arrays, facts = [], {}, {}


class Layout:
    """A layout that writes down what is drawn on it; Blender draws none without a window."""

    icons = bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items.keys()

    def __init__(self, rows):
        self.rows = rows

    def row(self, **_):
        return Layout(self.rows)

    column = row

    def label(self, text="", icon="NONE"):
        assert icon in self.icons, icon
        self.rows.append(text)

    def prop(self, data, name, text=None, **_):
        self.rows.append(data.bl_rna.properties[name].name if text is None else text)

    def operator(self, name, text=None, icon="NONE"):
        assert icon in self.icons, icon
        kind = getattr(bpy.ops.posefield, name.removeprefix("posefield.")).get_rna_type()
        self.rows.append(kind.name if text is None else text)


def drawn():
    rows = []
    kind = bpy.types.Panel.bl_rna_get_subclass_py("VIEW3D_PT_posefield")
    kind.draw(SimpleNamespace(layout=Layout(rows)), bpy.context)
    return " ".join(rows)


def settings():
    return bpy.context.scene.posefield


def empty(address):
    """An empty scene, and the add-on, which factory settings switch off."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if PACKAGE not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=PACKAGE)
    own = bpy.context.preferences.addons[PACKAGE].preferences
    own.address, own.seconds = address, 60.0


def part(name):
    """A module of the installed add-on."""
    return sys.modules[f"{PACKAGE}.{name}"]


def record(name, armature, **more):
    """Keep where the joints of each frame are, Y up, and what was asked for."""
    scene, bones = bpy.context.scene, armature.pose.bones
    matrices = []
    for frame in range(settings().start, part("scene").last_frame(armature) + 1):
        scene.frame_set(frame)
        matrices.append([TO_Y_UP @ np.array(armature.matrix_world @ bone.matrix) for bone in bones])
    arrays[name] = np.array(matrices)
    cases.append({"name": name, "joints": [bone.name for bone in bones], **more})


def record_clip(name):
    question = part("settings").question(bpy.context.scene)
    record(name, settings().character, model=settings().model, question=question)


def wait():
    """As Blender's own timers do, until there is nothing to come."""
    end = time.monotonic() + 60
    while (again := part("live").tick()) is not None:
        assert time.monotonic() < end, "the service did not answer"
        time.sleep(again)


def said(call, **given):
    """Return an operator's error message; empty if it succeeds."""
    try:
        call(**given)
    except RuntimeError as refusal:
        return str(refusal)
    return ""


def names():
    return sorted(each.name for each in bpy.data.objects)


def clips(address):
    empty(address)
    facts["drawn before"] = drawn()
    bpy.ops.posefield.refresh()
    settings().model = "reaching"
    sliders = bpy.context.scene.posefield_controls
    sliders.turn = 20.0
    bpy.ops.posefield.import_clip()
    record_clip("a clip")
    facts["drawn after"] = drawn()
    facts["range"] = bpy.context.scene.frame_end == part("scene").last_frame(settings().character)
    before = names()
    settings().live = True
    for turn in (21.0, 25.0, 30.0):
        sliders.turn = turn
    sliders.stature = 1.7
    wait()
    record_clip("after sliders moved")
    facts["live: objects"] = len(names()) == len(before) == 2
    facts["live: data"] = [len(bpy.data.actions), len(bpy.data.meshes), len(bpy.data.materials)]
    settings().live = False
    settings().start = 50
    bpy.context.scene.render.fps = 25
    bpy.ops.posefield.import_clip()
    record_clip("at 25 frames a second")
    sliders.stature = 2.5
    facts["drawn outside"] = drawn()


def refusals():
    before = names()
    call = bpy.ops.posefield.import_clip
    facts["no such control"] = said(call, controls='{"speed": 1}')
    facts["far outside"] = said(call, controls='{"turn": 1e9}')
    facts["no such label set"] = said(call, labels='{"mood": "glad"}')
    facts["no such model"] = said(call, model="nobody")
    facts["no gait"] = said(bpy.ops.posefield.import_crowd)
    facts["no script"] = said(bpy.ops.posefield.perform_script, text="go.json")
    bpy.data.texts.new("bad.json").write('{"segments": [{"kind": "run"}]}')
    facts["a bad script"] = said(bpy.ops.posefield.perform_script, text="bad.json")
    bpy.data.texts.new("no.json").write('{"segments": [')
    facts["no JSON"] = said(bpy.ops.posefield.perform_script, text="no.json")
    facts["drawn refusal"] = drawn()
    facts["refused: unchanged"] = names() == before


def walks(address):
    empty(address)
    bpy.ops.posefield.refresh()
    settings().model = "stroll"
    settings().loop, settings().root, settings().take = True, "in_place", 3
    bpy.ops.posefield.import_clip()
    facts["repeated"] = all(
        curve.modifiers
        for curve in part("scene").curves(settings().character.animation_data.action)
    )
    record_clip("a loop of another take")
    bpy.data.texts.new("go.json").write(SCRIPT)
    settings().script = bpy.data.texts["go.json"]
    for _ in range(2):
        bpy.ops.posefield.perform_script()
    script = json.loads(SCRIPT) | {"fps": bpy.context.scene.render.fps}
    record("a performance", bpy.data.objects["go.json"], model="stroll", script=json.dumps(script))
    facts["markers"] = [each.name for each in bpy.context.scene.timeline_markers]
    facts["performed twice"] = sum(each.type == "ARMATURE" for each in bpy.data.objects)
    settings().count, settings().seconds = 3, 1.0
    before = sum(each.type == "ARMATURE" for each in bpy.data.objects)
    bpy.ops.posefield.import_crowd()
    facts["crowd"] = sum(each.type == "ARMATURE" for each in bpy.data.objects) - before


def styles(address):
    empty(address)
    bpy.ops.posefield.refresh()
    settings().model = "styled"
    bpy.context.scene.posefield_controls.label_performer = "ben"
    bpy.ops.posefield.import_clip()
    record_clip("of a performer")
    facts["drawn labels"] = drawn()
    labels = {"style": {"marching": 0.5}}
    bpy.ops.posefield.import_clip(labels=json.dumps(labels))
    question = part("settings").question(bpy.context.scene)
    question["labels"] |= labels
    record("of a mixture", settings().character, model="styled", question=question)
    facts["no such label"] = said(bpy.ops.posefield.import_clip, labels='{"style": "marchng"}')


def readme(path, address):
    empty(address)
    (code,) = re.findall(r"```python\n(.*?)```", Path(path).read_text(), re.S)
    code = code.replace("hdm05_grab_high", "reaching")
    exec(code.replace("http://127.0.0.1:8000", address), {})
    question = part("settings").question(bpy.context.scene)
    question["controls"] |= {"target_height": 1.65}
    record("the README's lines", settings().character, model="reaching", question=question)


def switched_off(address):
    settings().live = True
    bpy.context.preferences.addons[PACKAGE].preferences.address = "http://127.0.0.1:9"
    facts["nobody answers"] = said(bpy.ops.posefield.refresh)
    bpy.context.preferences.addons[PACKAGE].preferences.address = "http://192.0.2.1:8000"
    facts["elsewhere"] = said(bpy.ops.posefield.refresh)
    bpy.ops.preferences.addon_disable(module=PACKAGE)
    calls = (*bpy.app.handlers.load_pre, *bpy.app.handlers.load_post)
    facts["left"] = [each for each in dir(bpy.types.Scene) if "posefield" in each] + [
        each.__name__ for each in calls if "posefield" in each.__module__
    ]


if __name__ == "__main__":
    archive, where, result, read_me = sys.argv[1:]
    bpy.ops.extensions.package_install_files(
        filepath=archive, repo="user_default", enable_on_install=True
    )
    clips(where)
    refusals()
    walks(where)
    styles(where)
    readme(read_me, where)
    switched_off(where)
    np.savez(result, **arrays)
    Path(result).with_suffix(".json").write_text(json.dumps({"cases": cases, "facts": facts}))
