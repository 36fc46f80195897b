"""Checks of joint motion: clips on new and existing armatures, at all rates and as loops."""

import time

import bpy
import numpy as np
from addon_layout import drawn
from addon_stage import (
    afresh,
    choose,
    curves,
    edit,
    facts,
    key,
    part,
    record,
    said,
    settings,
    slide,
    snapshot,
    wait,
)


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
    facts["timer runs"] = bpy.app.timers.is_registered(part("live").tick)


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
    """Return an armature as by another program, with an action and Euler angles."""
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
    afresh(model, {"performer": performer})
    bpy.ops.posefield.import_clip()
    record(f"{model} as {performer}", {"labels": {}})
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


def styles(model):
    """A model of two walkers in three styles."""
    afresh(model, {"style": "sneaking"})
    bpy.ops.posefield.import_clip()
    record("a style", {"labels": {"style": "plain"}})
    afresh(model, {"performer": {"ann": 0.25, "ben": 0.75}, "style": "marching"})
    bpy.ops.posefield.import_clip()
    mixed = {"performer": {"ann": 0.25, "ben": 0.75}, "style": "marching"}
    record("a mixture of performers", {"labels": mixed | {"performer": "ben"}})
    facts["drawn mixture"] = drawn()
    settings().live = True
    choose("style", {"marching": 0.7, "sneaking": 0.2})
    wait()
    record("a mixture of styles, live", {"labels": mixed})
    facts["drawn open"] = drawn()
    choose("style", {"marching": 0.9})
    wait()
    facts["drawn too much"] = drawn()
    afresh(model)
    bpy.ops.posefield.import_clip(labels='{"style": {"marching": 0.5}, "performer": "ann"}')
    record("labels of a script", {"labels": {"performer": "ann"}})
    before = snapshot()
    for name, labels in UNFIT_LABELS.items():
        facts[name] = said(bpy.ops.posefield.import_clip, labels=labels)
    facts["unfit labels: unchanged"] = snapshot() == before
    bpy.ops.posefield.refresh()
    facts["refresh keeps labels"] = snapshot() == before
    bpy.ops.posefield.import_clip(labels='{"style": null}')
    record("a style left open again", {"labels": {"style": "plain"}})
    settings().labels["performer"].choice = ":OPEN"
    settings().performer_name = "ben"
    bpy.ops.posefield.refresh()
    facts["performer of an older file"] = part("questions").question(bpy.context.scene).labels


def takes(model):
    """Takes, and feet that stand, of a model with contacts and without sampled details."""
    afresh(model, take=7)
    bpy.ops.posefield.import_clip()
    record("a take", {"take": 0})
    facts["drawn take"] = drawn()
    settings().live = True
    bpy.ops.posefield.next_take()
    facts["drawn until the next take"] = drawn()
    wait()
    record("the next take, live", {"take": 7})
    settings().live = False
    bpy.ops.posefield.import_clip(take=3, variety=0.25, feet="as_predicted")
    record("a take of a script", {"variety": 0.7})
    record("feet of a script", {"feet": "stand"})
    facts["settings of a script"] = [settings().take, settings().feet]
    facts["drawn as predicted"] = drawn()
    bpy.ops.posefield.import_clip(feet="stand")
    record("feet stand", {"feet": "as_predicted"})
    before = snapshot()
    facts["no details"] = said(bpy.ops.posefield.import_clip, detail=True)
    facts["no details: unchanged"] = snapshot() == before
    settings().model = "reaching"
    facts["take of another model"] = [settings().take, settings().feet]
    bpy.ops.posefield.import_clip()
    facts["drawn without feet"] = drawn()


UNFIT_LABELS = {
    "no such label set": '{"mood": "glad"}',
    "no such label": '{"style": "marchng"}',
    "no labels": '["marching"]',
    "weights above one": '{"style": {"marching": 0.7, "plain": 0.7}}',
}
