"""Draws the README's picture of a crowd: a moment of it, coloured by level of detail.

posefield crowd MODEL --count 144 --seconds 4 --camera=-34,6,-20 --pixels 2 -o CROWD.usd
.venv/bin/python docs/draw_crowd.py CROWD.usd > LEVELS.json
.venv-blender/bin/python docs/draw_crowd.py CROWD.usd LEVELS.json PICTURE.png
"""

import json
import math
import sys
from pathlib import Path

FRAME = 60
COLOURS = ((0.02, 0.2, 0.6), (0.05, 0.5, 0.25), (0.9, 0.5, 0.05), (0.8, 0.1, 0.05))


def levels(path: str) -> None:
    """Print the level of each character by its number, which Blender's import leaves out."""
    from pxr import Usd

    stage = Usd.Stage.Open(path)
    characters = stage.GetPrimAtPath("/Crowd/Characters").GetChildren()
    motions = [one.GetRelationship("skel:animationSource").GetTargets()[0] for one in characters]
    attributes = [stage.GetPrimAtPath(motion).GetAttribute("posefield:level") for motion in motions]
    print(json.dumps([int(attribute.Get(FRAME)) for attribute in attributes]))


def draw(crowd: str, shown: str, picture: str) -> None:
    """Import the crowd as anyone would, colour it and look at it from its camera.

    It is the camera that chose the levels; Blender's up is Z, and its Y our -Z.
    """
    import blender_scene as scenes
    import bpy

    scene = scenes.open_file(crowd)
    scene.frame_set(FRAME)
    with Path(shown).open(encoding="utf-8") as file:
        own = json.load(file)
    paints = [scenes.paint(colour) for colour in COLOURS]
    bodies = sorted((b for b in bpy.data.objects if b.type == "MESH"), key=number)
    for body, level in zip(bodies, own, strict=True):
        body.data = body.data.copy()
        body.data.materials.clear()
        body.data.materials.append(paints[level])
    scenes.add_floor(400)
    scenes.add_light((40, 15, math.degrees(0.4)), 3.5)
    camera = scenes.add_camera((-34, 20, 6))
    middle = bpy.data.objects.new("middle", None)
    middle.location = (9, -13, 0)
    scene.collection.objects.link(middle)
    camera.constraints.new("TRACK_TO").target = middle
    camera.data.lens = 85
    scenes.render(picture, 1200, 520)


def number(body) -> int:
    """The character's, which the parent of its armature is named after."""
    thing = body
    while thing.parent and not thing.name.startswith("c0"):
        thing = thing.parent
    return int(thing.name[1:6])


if len(sys.argv) == 2:
    levels(sys.argv[1])
else:
    draw(*sys.argv[1:4])
