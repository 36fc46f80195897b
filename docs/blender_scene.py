"""Parts of Blender scenes that the pictures of the documentation share."""

import math
from collections.abc import Sequence

import bpy


def open_file(path: str) -> bpy.types.Scene:
    """Import a USD file as anyone would, into an empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=path)
    return bpy.context.scene


def skin() -> bpy.types.Object:
    """Return the first mesh of the scene."""
    return next(thing for thing in bpy.data.objects if thing.type == "MESH")


def paint(colour: Sequence[float], mirrors: bool = True) -> bpy.types.Material:
    """Return a material of one colour; it mirrors the sky, or not."""
    material = bpy.data.materials.new("paint")
    material.use_nodes = True
    surface = material.node_tree.nodes["Principled BSDF"]
    surface.inputs["Base Color"].default_value = (*colour, 1.0)
    if not mirrors:
        surface.inputs["Specular IOR Level"].default_value = 0.0
    return material


def freeze(body: bpy.types.Object, shift: Sequence[float], colour: bpy.types.Material) -> None:
    """Keep a copy of the body as it is now, moved by a shift."""
    evaluated = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new_from_object(evaluated)
    mesh.materials.clear()
    mesh.materials.append(colour)
    copy = bpy.data.objects.new("frozen body", mesh)
    copy.matrix_world = body.matrix_world.copy()
    for axis, way in enumerate(shift):
        copy.location[axis] += way
    bpy.context.scene.collection.objects.link(copy)


def remove_moving() -> None:
    """Remove all objects that were not frozen."""
    for thing in list(bpy.data.objects):
        if not thing.name.startswith("frozen"):
            bpy.data.objects.remove(thing)


def add_floor(size: float, place: Sequence[float] = (0, 0, 0)) -> None:
    """Add a grey floor."""
    bpy.ops.mesh.primitive_plane_add(size=size, location=place)
    bpy.context.object.data.materials.append(paint((0.3, 0.3, 0.32)))


def add_light(degrees: Sequence[float], energy: float, sky: float = 1.0) -> None:
    """Add a sun with these angles, and a sky."""
    bpy.ops.object.light_add(type="SUN", rotation=[math.radians(angle) for angle in degrees])
    bpy.context.object.data.energy = energy
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    background = world.node_tree.nodes["Background"].inputs
    background["Color"].default_value = (0.6, 0.68, 0.8, 1.0)
    background["Strength"].default_value = sky
    bpy.context.scene.world = world


def add_camera(place: Sequence[float], rotation: Sequence[float] = (0, 0, 0)) -> bpy.types.Object:
    """Add the camera of the scene; rotation: rad."""
    bpy.ops.object.camera_add(location=place, rotation=rotation)
    bpy.context.scene.camera = bpy.context.object
    return bpy.context.object


def render(picture: str, wide: int, high: int) -> None:
    """Write a picture of the scene."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 24
    scene.cycles.use_denoising = True
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = wide, high
    scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)
