"""Checks of scripts in text blocks: the motion, the markers, another version, and refusals."""

import json

import bpy
from addon_layout import drawn
from addon_stage import (
    afresh,
    arrays,
    cases,
    empty,
    facts,
    made,
    offsets,
    part,
    pose,
    said,
    settings,
)

NAME = "go_on.json"


def script(model, speed):
    """A script of two walks, each on a line of its own."""
    first = {"kind": "walk", "model": model, "seconds": 2, "speed": speed}
    second = {"kind": "walk", "model": model, "to": [0.5, 6], "speed": speed}
    return {"fps": 30, "segments": [first, second]}


def performed(model, speeds):
    """Perform a script, then a slower version of it, then what cannot be performed."""
    first, second = (script(model, speed) for speed in speeds)
    empty()
    facts["script: none"] = said(bpy.ops.posefield.perform_script)
    facts["script: not drawn"] = "Perform script" in drawn()
    settings().script = text = bpy.data.texts.new(NAME)
    write(text, first)
    facts["script: drawn"] = "Perform script" in drawn()
    bpy.ops.posefield.perform_script()
    keep("a script", model, first, second)
    facts["script: markers"] = markers()
    write(text, second)
    bpy.ops.posefield.perform_script()
    keep("a script again", model, second, first)
    facts["script: again"] = [len(bpy.data.armatures), len(bpy.data.actions), len(markers())]
    refused(text, second)
    others(model, second)


def refused(text, right):
    before, marked = made(), markers()
    text.clear()
    text.write(json.dumps(right, indent=1).replace('"to"', '"tu"'))
    facts["script: refused"] = said(bpy.ops.posefield.perform_script)
    facts["script: line"] = text.current_line.body.strip()
    text.clear()
    text.write('{\n"segments": [,]}')
    facts["script: no JSON"] = said(bpy.ops.posefield.perform_script)
    facts["script: no text"] = said(bpy.ops.posefield.perform_script, text="other")
    facts["script: unchanged"] = (made(), markers()) == (before, marked)


def others(model, right):
    """Perform onto another skeleton's armature, onto one of its own, and onto a new one."""
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    write(bpy.data.texts.new(NAME), right)
    told = {"text": NAME, "onto": "ACTIVE"}
    facts["script: no fit"] = said(bpy.ops.posefield.perform_script, **told)
    afresh(model)
    bpy.ops.posefield.import_clip()
    write(bpy.data.texts.new(NAME), right)
    bpy.ops.posefield.perform_script(**told)
    keep(
        "a script onto an armature", model, right, script(model, 0.9 * speed_of(right)), "armature"
    )
    bpy.ops.posefield.perform_script(text=NAME)
    facts["script: onto"] = [len(bpy.data.armatures), len(bpy.data.actions)]
    bpy.ops.posefield.perform_script(text=NAME, onto="NEW")
    facts["script: new"] = len(bpy.data.armatures)


def speed_of(asked):
    return asked["segments"][0]["speed"]


def write(text, asked):
    text.clear()
    text.write(json.dumps(asked, indent=1))


def markers():
    return [
        [each.name.partition(" (")[0], each.frame] for each in bpy.context.scene.timeline_markers
    ]


def keep(name, model, asked, other, body="clip"):
    """Keep where the joints are, the script, and another that it must not be taken for."""
    scene = bpy.context.scene
    armature = bpy.context.view_layer.objects.active
    joints = [bone.name for bone in armature.pose.bones]
    at = range(scene.frame_start, scene.frame_end + 1)
    arrays[f"{name}/matrices"] = [pose(armature, joints, frame) for frame in at]
    arrays[f"{name}/offsets"] = offsets(armature)
    known = part("performing").MARK
    facts[f"{name}: named"] = armature.get(known)
    case = {"name": name, "model": model, "joints": joints, "question": {}, "script": asked}
    cases.append(case | {"wrong": {"script": other}, "body": body})
