"""Draws the guide's picture of the shipped models: a film strip of each, from the side and ahead.

posefield clip NAME --fps 24 -o FOLDER/NAME.usdc, for each model
.venv-blender/bin/python docs/draw_models.py FOLDER/*.usdc
.venv/bin/python docs/draw_models.py FOLDER/*.png PICTURE.png
"""

import math
import sys
from pathlib import Path

import numpy as np

POSES, GAP = 6, 1.15
"""Poses of a strip, and the distance between two of them, m."""
WIDE, HIGH = 600, 190
LOOK = math.radians(6.0)
"""Angle at which the camera looks down."""
VIEWS = {"side": (1, -math.pi / 2), "ahead": (0, 0.0)}
"""Axis along which the poses of a view stand side by side, and the camera's turn about Z."""
START, END = (0.02, 0.2, 0.6), (0.9, 0.25, 0.03)
"""Colours of the first and the last pose."""


def draw(files: list[str]) -> None:
    """Render both strips of each clip beside its file."""
    for file in files:
        for view in VIEWS:
            strip(file, view, f"{Path(file).with_suffix('')}-{view}.png")


def strip(clip: str, view: str, picture: str) -> None:
    """Import the clip as anyone would, and freeze some of its frames into one scene."""
    import blender_scene as scenes
    import bpy
    from mathutils import Vector

    scene = scenes.open_file(clip)
    body, last = scenes.skin(), scene.frame_end
    axis, turn = VIEWS[view]
    # Clips lead along -Y: time goes to the right in both views.
    step = -GAP if view == "side" else GAP
    for index in range(POSES):
        scene.frame_set(round(index * last / (POSES - 1)))
        moving = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
        corners = np.array([moving.matrix_world @ Vector(corner) for corner in moving.bound_box])
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
        shift = [-middle[0], -middle[1], 0.0]
        shift[axis] += step * index
        share = index / (POSES - 1)
        colour = [a + share * (b - a) for a, b in zip(START, END, strict=True)]
        scenes.freeze(body, shift, scenes.paint(colour))
    scenes.remove_moving()
    centre = [0.0, 0.0, 0.92]
    centre[axis] = step * (POSES - 1) / 2
    scenes.add_floor(60, (*centre[:2], 0))
    scenes.add_light((40, 15, -60 if view == "side" else 20), 3.5)
    away = 20.0 * math.cos(LOOK)
    centre[1 - axis] -= away
    centre[2] += 20.0 * math.sin(LOOK)
    camera = scenes.add_camera(centre, (math.pi / 2 - LOOK, 0.0, turn))
    camera.data.type, camera.data.ortho_scale = "ORTHO", GAP * POSES
    scenes.render(picture, WIDE, HIGH)


def stack(strips: list[str], picture: str) -> None:
    """Write one picture with a row for each model and its name, in 48 colours."""
    from PIL import Image, ImageDraw

    names = sorted({Path(path).stem.rpartition("-")[0] for path in strips})
    folder = Path(strips[0]).parent
    whole = Image.new("RGB", (len(VIEWS) * WIDE, len(names) * HIGH))
    pen = ImageDraw.Draw(whole)
    for row, name in enumerate(names):
        for column, view in enumerate(VIEWS):
            part = Image.open(folder / f"{name}-{view}.png").convert("RGB")
            whole.paste(part, (column * WIDE, row * HIGH))
        pen.text((8, row * HIGH + 4), name, fill=(20, 24, 32), font_size=16)
    small = whole.resize((whole.width * 3 // 4, whole.height * 3 // 4))
    small.quantize(48, dither=Image.Dither.NONE).save(picture, optimize=True)


if sys.argv[1].endswith(".png"):
    stack(sys.argv[1:-1], sys.argv[-1])
else:
    draw(sys.argv[1:])
