"""Draws the guide's picture of feet: a clip as predicted above, and with standing feet below.

Each row is a film strip whose camera moves along. Tiles of the floor are 10 cm wide. Bars mark the
places where feet are planned to stand, in both rows, so that a foot beside its bar slides.

posefield clip MODEL --feet as_predicted --fps 24 -o BEFORE.usdc
posefield clip MODEL --feet stand --fps 24 -o AFTER.usdc
posefield clip MODEL --feet stand --fps 24 -o AFTER.npz
.venv-blender/bin/python docs/draw_feet.py BEFORE.usdc AFTER.npz BEFORE.png
.venv-blender/bin/python docs/draw_feet.py AFTER.usdc AFTER.npz AFTER.png
.venv/bin/python docs/draw_feet.py BEFORE.png AFTER.png PICTURE.png
"""

import json
import math
import sys

import numpy as np

POSES, GAP, RATE = 6, 1.15, 24
TILE, DEPTH, BAR_WIDTH = 0.1, 0.45, 0.03
WIDE, HIGH = 1000, 300
LOOK = math.radians(18.0)
"""Angle at which the camera looks down."""
SKIN, BAR = (0.03, 0.12, 0.4), (1.0, 0.1, 0.0)
TILES = ((0.2, 0.2, 0.22), (0.3, 0.3, 0.33))


def strip(clip: str, planned: str, picture: str) -> None:
    """Import the clip as anyone would, and freeze some of its frames into one scene."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=clip)
    with np.load(planned) as found:
        stances = json.loads(str(found["trust"]))["feet"]["stances"]
        # Y is up in the file, and Z in Blender.
        path = found["root_position"][:, [0, 2, 1]] * (1, -1, 1)
    body = next(thing for thing in bpy.data.objects if thing.type == "MESH")
    paints = [paint(bpy, colour) for colour in (SKIN, BAR, *TILES)]
    for index in range(POSES):
        frame = round(index * (len(path) - 1) / (POSES - 1))
        bpy.context.scene.frame_set(frame)
        # Clips lead along -Y, which the camera sees going right.
        aside = -GAP * index - path[frame, 1]
        freeze(bpy, body, aside, paints[0])
        lay_tiles(bpy, -GAP * index, path[frame, 1], paints[2:])
        for each in stances:
            if each["begin"] <= frame / RATE <= each["end"]:
                lay_bar(bpy, each["position"], aside, paints[1])
    for thing in list(bpy.data.objects):
        if not thing.name.startswith("frozen"):
            bpy.data.objects.remove(thing)
    light_and_look(bpy, bpy.context.scene)
    bpy.context.scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)


def freeze(bpy, body, aside: float, colour) -> None:
    """Keep a copy of the body as it is now, moved aside."""
    mesh = bpy.data.meshes.new_from_object(
        body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    )
    mesh.materials.clear()
    mesh.materials.append(colour)
    copy = bpy.data.objects.new("frozen body", mesh)
    copy.matrix_world = body.matrix_world.copy()
    copy.location.y += aside
    bpy.context.scene.collection.objects.link(copy)


def lay_tiles(bpy, middle: float, way: float, colours) -> None:
    """Lay the floor of one pose; its tiles have the places that they have in the clip."""
    first, last = (math.floor((way + side * GAP / 2) / TILE) for side in (-1, 1))
    for tile in range(first, last + 1):
        low = max(tile * TILE, way - GAP / 2) - way + middle
        high = min((tile + 1) * TILE, way + GAP / 2) - way + middle
        box(bpy, ((-DEPTH, low, -0.02), (DEPTH, high, 0.0)), colours[tile % 2])


def lay_bar(bpy, place, aside: float, colour) -> None:
    """Lay a bar across the floor where a foot is planned to stand."""
    along = -place[2] + aside
    box(bpy, ((-DEPTH, along - BAR_WIDTH / 2, 0.0), (DEPTH, along + BAR_WIDTH / 2, 0.004)), colour)


def box(bpy, corners, colour) -> None:
    """Add a box from its lowest to its highest corner."""
    low, high = np.array(corners)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(low + high) / 2)
    made = bpy.context.object
    made.scale, made.name = high - low, "frozen box"
    made.data.materials.append(colour)


def paint(bpy, colour: tuple[float, float, float]):
    """Return a material of one colour."""
    material = bpy.data.materials.new("paint")
    material.use_nodes = True
    surface = material.node_tree.nodes["Principled BSDF"]
    surface.inputs["Base Color"].default_value = (*colour, 1.0)
    # The floor is seen at a flat angle, and would mirror the sky.
    surface.inputs["Specular IOR Level"].default_value = 0.0
    return material


def light_and_look(bpy, scene) -> None:
    """Add sun, sky and a camera that looks from the side without perspective."""
    bpy.ops.object.light_add(type="SUN", rotation=(math.radians(-25), math.radians(-40), 0))
    bpy.context.object.data.energy = 2.5
    middle, far = -GAP * (POSES - 1) / 2, 20.0
    place = (-far * math.cos(LOOK), middle, 0.82 + far * math.sin(LOOK))
    bpy.ops.object.camera_add(location=place, rotation=(math.pi / 2 - LOOK, 0, -math.pi / 2))
    scene.camera = bpy.context.object
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", GAP * POSES
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.6, 0.68, 0.8, 1.0)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.8
    scene.world = world
    scene.render.engine, scene.cycles.samples = "CYCLES", 24
    scene.cycles.use_denoising = True
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = WIDE, HIGH


def stack(before: str, after: str, picture: str) -> None:
    """Write one picture of both rows with their names, in 64 colours."""
    from PIL import Image, ImageDraw

    whole = Image.new("RGB", (WIDE, 2 * HIGH))
    pen = ImageDraw.Draw(whole)
    for row, (path, words) in enumerate(((before, "as predicted"), (after, "standing feet"))):
        whole.paste(Image.open(path).convert("RGB"), (0, row * HIGH))
        pen.text((8, row * HIGH + 4), words, fill=(20, 24, 32), font_size=16)
    # Median cut would leave no colour for the few pixels of the bars.
    small = whole.quantize(64, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    small.save(picture, optimize=True)


(stack if sys.argv[1].endswith(".png") else strip)(*sys.argv[1:4])
