"""Draws the guide's pictures of feet: a clip as predicted above, and with standing feet below.

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

POSES, GAP, AHEAD, RATE = 6, 1.15, 0.22, 24
TILE, DEPTH, BAR_WIDTH = 0.1, 0.45, 0.03
WIDE, HIGH = 1000, 330
LOOK = math.radians(18.0)
"""Angle at which the camera looks down."""
SKIN, BAR = (0.03, 0.12, 0.4), (1.0, 0.1, 0.0)
TILES = ((0.2, 0.2, 0.22), (0.3, 0.3, 0.33))


def strip(clip: str, planned: str, picture: str) -> None:
    """Import the clip as anyone would, and freeze some of its frames into one scene."""
    import blender_scene as scenes

    scene = scenes.open_file(clip)
    with np.load(planned) as found:
        stances = json.loads(str(found["trust"]))["feet"]["stances"]
        # Y is up in the file, and Z in Blender.
        path = found["root_position"][:, [0, 2, 1]] * (1, -1, 1)
    body = scenes.skin()
    # The floor is seen at a flat angle, and would mirror the sky.
    paints = [scenes.paint(colour, mirrors=False) for colour in (SKIN, BAR, *TILES)]
    for index in range(POSES):
        frame = round(index * (len(path) - 1) / (POSES - 1))
        scene.frame_set(frame)
        # Clips lead along -Y, which the camera sees going right.
        aside = -GAP * index - path[frame, 1]
        scenes.freeze(body, (0.0, aside, 0.0), paints[0])
        lay_tiles(-GAP * index, path[frame, 1], paints[2:])
        for each in stances:
            if each["begin"] <= frame / RATE <= each["end"]:
                lay_bar(each["position"], aside, paints[1])
    scenes.remove_moving()
    scenes.add_light((-25, -40, 0), 2.5, 0.8)
    # Reaching hands are seen, too.
    middle, far = -GAP * (POSES - 1) / 2 - AHEAD, 20.0
    place = (-far * math.cos(LOOK), middle, 0.9 + far * math.sin(LOOK))
    camera = scenes.add_camera(place, (math.pi / 2 - LOOK, 0, -math.pi / 2))
    camera.data.type, camera.data.ortho_scale = "ORTHO", GAP * POSES
    scenes.render(picture, WIDE, HIGH)


def lay_tiles(middle: float, way: float, colours) -> None:
    """Lay the floor of one pose; its tiles have the places that they have in the clip."""
    first, last = (math.floor((way + side * GAP / 2) / TILE) for side in (-1, 1))
    for tile in range(first, last + 1):
        low = max(tile * TILE, way - GAP / 2) - way + middle
        high = min((tile + 1) * TILE, way + GAP / 2) - way + middle
        box(((-DEPTH, low, -0.02), (DEPTH, high, 0.0)), colours[tile % 2])


def lay_bar(place, aside: float, colour) -> None:
    """Lay a bar across the floor where a foot is planned to stand."""
    along = -place[2] + aside
    box(((-DEPTH, along - BAR_WIDTH / 2, 0.0), (DEPTH, along + BAR_WIDTH / 2, 0.004)), colour)


def box(corners, colour) -> None:
    """Add a box from its lowest to its highest corner."""
    import bpy

    low, high = np.array(corners)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(low + high) / 2)
    made = bpy.context.object
    made.scale, made.name = high - low, "frozen box"
    made.data.materials.append(colour)


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
