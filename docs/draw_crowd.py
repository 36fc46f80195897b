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
    """Import the crowd as anyone would, colour it and look at it from its camera."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=crowd)
    scene = bpy.context.scene
    scene.frame_set(FRAME)
    with Path(shown).open(encoding="utf-8") as file:
        own = json.load(file)
    paints = [paint(bpy, level, colour) for level, colour in enumerate(COLOURS)]
    bodies = sorted((b for b in bpy.data.objects if b.type == "MESH"), key=number)
    for body, level in zip(bodies, own, strict=True):
        body.data = body.data.copy()
        body.data.materials.clear()
        body.data.materials.append(paints[level])
    light_and_look(bpy, scene)
    scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)


def number(body) -> int:
    """The character's, which the parent of its armature is named after."""
    thing = body
    while thing.parent and not thing.name.startswith("c0"):
        thing = thing.parent
    return int(thing.name[1:6])


def paint(bpy, level: int, colour: tuple[float, float, float]):
    """Material of a level."""
    material = bpy.data.materials.new(f"level{level}")
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*colour, 1.0)
    return material


def light_and_look(bpy, scene) -> None:
    """Floor, sun, and the camera that chose the levels; Blender's up is Z, and our Z its -Y."""
    bpy.ops.mesh.primitive_plane_add(size=400)
    floor = bpy.data.materials.new("floor")
    floor.use_nodes = True
    surface = floor.node_tree.nodes["Principled BSDF"]
    surface.inputs["Base Color"].default_value = (0.3, 0.3, 0.32, 1.0)
    bpy.context.object.data.materials.append(floor)
    bpy.ops.object.light_add(type="SUN", rotation=(math.radians(40), math.radians(15), 0.4))
    bpy.context.object.data.energy = 3.5
    bpy.ops.object.camera_add(location=(-34, 20, 6))
    scene.camera = bpy.context.object
    middle = bpy.data.objects.new("middle", None)
    middle.location = (9, -13, 0)
    scene.collection.objects.link(middle)
    aim = scene.camera.constraints.new("TRACK_TO")
    aim.target = middle
    scene.camera.data.lens = 85
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.6, 0.68, 0.8, 1.0)
    scene.world = world
    scene.render.engine, scene.cycles.samples = "CYCLES", 24
    scene.cycles.use_denoising = True
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = 1200, 520


if len(sys.argv) == 2:
    levels(sys.argv[1])
else:
    draw(*sys.argv[1:4])
