"""Draws the README's picture: poses of a clip side by side, rendered by Blender.

make test-system && .venv-blender/bin/python docs/draw.py CLIP.usdc PICTURE.png

The picture here is of `hdm05_grab_high`, reduced to 64 colours.
"""

import math
import sys

import bpy

POSES, GAP = 6, 0.95


def main(clip: str, picture: str) -> None:
    """Import the clip as anyone would, and freeze some of its frames into one scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=clip)
    scene = bpy.context.scene
    body = next(thing for thing in bpy.data.objects if thing.type == "MESH")
    last = scene.frame_end
    for index in range(POSES):
        scene.frame_set(round(index * last / (POSES - 1)))
        freeze(body, index)
    for thing in list(bpy.data.objects):
        if not thing.name.startswith("frozen"):
            bpy.data.objects.remove(thing)
    light_and_look(scene)
    scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)


def freeze(body: bpy.types.Object, index: int) -> None:
    """A copy of the body as it is now, moved aside."""
    evaluated = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new_from_object(evaluated)
    mesh.materials.clear()
    mesh.materials.append(paint(index))
    copy = bpy.data.objects.new(f"frozen{index}", mesh)
    copy.matrix_world = body.matrix_world.copy()
    copy.location.x += GAP * index
    bpy.context.scene.collection.objects.link(copy)


def paint(index: int) -> bpy.types.Material:
    """From blue at the start to orange at the end."""
    share = index / (POSES - 1)
    material = bpy.data.materials.new(f"paint{index}")
    material.use_nodes = True
    start, end = (0.02, 0.2, 0.6), (0.9, 0.25, 0.03)
    colour = [a + share * (b - a) for a, b in zip(start, end, strict=True)]
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*colour, 1.0)
    return material


def light_and_look(scene: bpy.types.Scene) -> None:
    """Floor, sun, camera."""
    middle = GAP * (POSES - 1) / 2
    bpy.ops.mesh.primitive_plane_add(size=40, location=(middle, 0, 0))
    floor = bpy.data.materials.new("floor")
    floor.use_nodes = True
    surface = floor.node_tree.nodes["Principled BSDF"]
    surface.inputs["Base Color"].default_value = (0.3, 0.3, 0.32, 1.0)
    bpy.context.object.data.materials.append(floor)
    bpy.ops.object.light_add(type="SUN", rotation=(math.radians(40), math.radians(15), 0.4))
    bpy.context.object.data.energy = 3.5
    bpy.ops.object.camera_add(
        location=(middle + 1.45, -9.3, 2.0), rotation=(math.radians(82.5), 0, math.radians(9))
    )
    scene.camera = bpy.context.object
    scene.camera.data.lens = 58
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.6, 0.68, 0.8, 1.0)
    scene.world = world
    scene.render.engine, scene.cycles.samples = "CYCLES", 24
    scene.cycles.use_denoising = True
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = 1200, 520


main(*sys.argv[1:3])
