"""Checks of the add-on's errors, and of events between a request and its response."""

import os
import signal
import time

import bpy
from addon_layout import drawn
from addon_stage import (
    PACKAGE,
    PATIENCE,
    afresh,
    edit,
    facts,
    left,
    made,
    part,
    preferences,
    record,
    said,
    settings,
    slide,
    snapshot,
    threads,
    wait,
)

ELSEWHERE = "http://203.0.113.1:8000"
"""Address without a host."""

NOBODY = "no service answers at"


def undone():
    """An import is one step back, and what the sliders did since is none."""
    afresh("reaching")
    before = made()
    slide(stature=1.7)
    facts["not live: unchanged"] = made() == before
    before = snapshot()
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
    facts["by hash"] = said(bpy.ops.posefield.import_clip, model=card().identity)
    preferences().address = ELSEWHERE
    facts["elsewhere"] = said(bpy.ops.posefield.refresh)
    preferences().address = "somewhere"
    facts["no address"] = said(bpy.ops.posefield.refresh)


def another_model(model, performer):
    """Of another model nothing is left where it is refused, and nothing taken along where not."""
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    bpy.context.view_layer.objects.active = settings().character
    slide(stature=1.7)
    before = snapshot()
    facts["another model, refused"] = said(
        bpy.ops.posefield.import_clip, model=model, controls='{"veer": 1e9}'
    )
    facts["another model, no fit"] = said(bpy.ops.posefield.import_clip, model=model, onto="ACTIVE")
    facts["another model: unchanged"] = snapshot() == before
    bpy.ops.posefield.import_clip(model=model)
    facts["another model: taken"] = [settings().model, snapshot() == before]
    record("another model", {"root": "in_place"})
    afresh(model, {"performer": performer}, level="1", loop=True)
    bpy.ops.posefield.import_clip()
    settings().live = True
    wait()
    asked = []
    part("live").stop()
    part("live").asking = part("without_blender.latest").Latest(lambda _: None)
    part("live").asking.ask = asked.append
    settings().model = "reaching"
    part("live").stop()
    newest = asked[-1].question
    questions = [each.question for each in asked]
    chosen = {(*each.labels.values(), each.level, each.loop) for each in questions}
    facts["another model, live"] = [list(each) for each in chosen]
    facts["another model, live: controls"] = newest.controls == card().defaults


def unforeseen():
    """An error of our own is shown, and the next question answered."""
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    settings().live = True
    wait()
    part("live").asking.ask(None)
    wait()
    facts["unforeseen"] = list(part("session").current.said)
    slide(stature=1.7)
    wait()
    facts["unforeseen: afterwards"] = list(part("session").current.said)


def card():
    return part("session").current.card


def renamed(index, bone):
    if index in (3, 4):
        bone.name = f"Bone{index}"


def hung_elsewhere(index, bone):
    if index == 5:
        bone.parent = bone.parent.parent


def losses(file):
    """Disturb Blender between a question and its answer."""
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
    reload(file)
    switched()


def reload(file):
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    slide(stature=1.7)
    settings().live = True
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    slide(stature=1.8)
    thread = part("live").asking
    bpy.ops.wm.open_mainfile(filepath=str(file))
    facts["reload: thread ended"] = thread.join(PATIENCE)
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
    """Give the armature another action meanwhile, which must stay as it is."""
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    settings().live = True
    slide(stature=1.7)
    settings().character.animation_data.action = bpy.data.actions.new("Own")
    before = made()
    wait()
    facts["another action"] = list(part("session").current.said)
    facts["another action: unchanged"] = made() == before


def stopped(pid):
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    settings().live = True
    os.kill(pid, signal.SIGTERM)
    end = time.monotonic() + PATIENCE
    while NOBODY not in said(bpy.ops.posefield.refresh) and time.monotonic() < end:
        time.sleep(0.1)
    before = snapshot()
    facts["stopped"] = said(bpy.ops.posefield.import_clip)
    facts["stopped: unchanged"] = snapshot() == before
    before = made()
    slide(stature=1.7)
    wait()
    facts["stopped, live"] = list(part("session").current.said)
    facts["stopped: drawn"] = drawn()
    facts["stopped, live: unchanged"] = made() == before


def switched_off():
    live = part("live")
    slide(stature=1.75)
    thread = live.asking
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
