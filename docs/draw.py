"""Draws the first picture of the documentation: poses of a clip side by side, rendered by Blender.

posefield clip hdm05_grab_high --fps 24 -o CLIP.usdc
.venv-blender/bin/python docs/draw.py CLIP.usdc PICTURE.png

The picture here is of `hdm05_grab_high`, reduced to 64 colours.
"""

import math
import sys

import blender_scene as scenes

POSES, GAP = 6, 0.95
START, END = (0.02, 0.2, 0.6), (0.9, 0.25, 0.03)
"""Colours of the first and the last pose."""


def main(clip: str, picture: str) -> None:
    """Import the clip as anyone would, and freeze some of its frames into one scene."""
    scene = scenes.open_file(clip)
    body, last = scenes.skin(), scene.frame_end
    for index in range(POSES):
        scene.frame_set(round(index * last / (POSES - 1)))
        share = index / (POSES - 1)
        colour = [a + share * (b - a) for a, b in zip(START, END, strict=True)]
        scenes.freeze(body, (GAP * index, 0.0, 0.0), scenes.paint(colour))
    scenes.remove_moving()
    middle = GAP * (POSES - 1) / 2
    scenes.add_floor(40, (middle, 0, 0))
    scenes.add_light((40, 15, math.degrees(0.4)), 3.5)
    look = (math.radians(82.5), 0, math.radians(9))
    scenes.add_camera((middle + 1.45, -9.3, 2.0), look).data.lens = 58
    scenes.render(picture, 1200, 520)


main(*sys.argv[1:3])
