"""Draws the guide's moving picture of a control: a walk whose speed follows a slider.

.venv/bin/python docs/draw_walk.py build/models/cmu_walk.onnx docs/walk.gif

The mannequin is the one of the files, shaded by a few lines of NumPy, so that no 3-D program is
needed.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from posefield.encode import character
from posefield.encode.skinned_mesh import FULL_WEIGHT, triangles, vertex_normals
from posefield.inference import session
from posefield.motion import quat
from posefield.motion.skeleton import forward_kinematics
from posefield.question.motion_question import FileQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

FRAMES, RATE = 72, 18
WIDE, HIGH, SCALE = 480, 400, 190.0
LOWEST, HIGHEST, SPEEDS = 0.7, 1.6, 10
TURN = np.radians(52.0)
PARTS = 2
"""Number of times that each triangle is divided into four, for smooth shading."""
SUN = np.array([0.35, 0.65, 0.67])
SKIN = np.array([122.0, 156.0, 214.0])
BACKGROUND, FLOOR, INK, ACCENT = (238, 241, 246), (222, 227, 235), (60, 66, 80), (45, 100, 200)


def main(model: str, picture: str) -> None:
    """Write the picture: all frames of one slow, fast and slow walk."""
    walker = Synthesizer("walk", session.load(Path(model)))
    speeds = np.linspace(LOWEST, HIGHEST, SPEEDS)
    strides = [stride(walker, float(speed)) for speed in speeds]
    phase, drawn = 0.0, []
    for frame in range(FRAMES):
        share = 0.5 - 0.5 * np.cos(2.0 * np.pi * frame / FRAMES)
        own = strides[round(share * (SPEEDS - 1))]
        drawn.append(frame_of(own, phase, LOWEST + share * (HIGHEST - LOWEST)))
        phase = (phase + 1.0 / (RATE * own.seconds)) % 1.0
    shades = drawn[0].quantize(64)
    frames = [each.quantize(palette=shades, dither=Image.Dither.NONE) for each in drawn]
    frames[0].save(picture, save_all=True, append_images=frames[1:], duration=1000 // RATE, loop=0)


class Stride:
    """One cycle of a walk in place, with the body that walks it."""

    def __init__(self, clip):
        rig = character.rig(clip.skeleton)
        rest = character.rest_pose(rig, clip.translations[:1])
        self.seconds = (len(clip) - 1) / clip.rate
        self.faces = triangles(rig.body.counts, rig.body.corners)
        points, bind = rest.points[0], clip.skeleton.at_rest(rest.offsets[0])
        found = forward_kinematics(clip.skeleton.parents, clip.rotations, clip.translations)
        self.frames = np.zeros((len(clip), *points.shape))
        for joints, weights in zip(rig.body.joints.T, rig.body.weights.T, strict=True):
            moved = found[0][:, joints] + quat.rotate(found[1][:, joints], points - bind[joints])
            self.frames += (weights / FULL_WEIGHT)[:, None] * moved

    def at(self, phase: float):
        """Return the points (P, 3) at a phase from 0 to 1, m."""
        return self.frames[round(phase * (len(self.frames) - 1))]


def stride(walker: Synthesizer, speed: float) -> Stride:
    """Return the stride at a speed, m/s."""
    asked = FileQuestion(
        controls={"speed": speed, "turn": 0.0}, fps=60.0, root="in_place", loop=True
    )
    return Stride(clips.synthesize_clip(walker, asked).clip)


def frame_of(own: Stride, phase: float, speed: float) -> Image.Image:
    """Return one frame: the walker, and the slider at a speed."""
    canvas = Image.new("RGB", (WIDE, HIGH), BACKGROUND)
    pen = ImageDraw.Draw(canvas)
    pen.rectangle((0, HIGH - 96, WIDE, HIGH), fill=FLOOR)
    pen.ellipse((WIDE / 2 - 75, HIGH - 84, WIDE / 2 + 75, HIGH - 62), fill=(200, 206, 216))
    shade(own.at(phase), own.faces, canvas)
    pen.text((24, HIGH - 37), f"speed {speed:.2f} m/s", fill=INK, font_size=16)
    left, right, level = 190, WIDE - 28, HIGH - 27
    place = left + (right - left) * (speed - LOWEST) / (HIGHEST - LOWEST)
    pen.line((left, level, right, level), fill=(170, 178, 192), width=4)
    pen.line((left, level, place, level), fill=ACCENT, width=4)
    pen.ellipse((place - 8, level - 8, place + 8, level + 8), fill=ACCENT)
    return canvas


def shade(points, faces, canvas: Image.Image) -> None:
    """Draw the skin on a canvas, the farthest first, twice as large and smoothed."""
    cos, sin = np.cos(TURN), np.sin(TURN)
    x, z = points[:, 0] - points[:, 0].mean(), points[:, 2] - points[:, 2].mean()
    seen = np.stack([cos * x + sin * z, points[:, 1], cos * z - sin * x], axis=-1)
    skin = np.concatenate([seen, vertex_normals(seen, faces)], axis=-1)[faces]
    for _ in range(PARTS):
        skin = quartered(skin)
    skin = skin[np.argsort(skin[:, :, 2].mean(axis=1))]
    facing = np.cross(skin[:, 1, :3] - skin[:, 0, :3], skin[:, 2, :3] - skin[:, 0, :3])
    normals = skin[:, :, 3:].mean(axis=1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    light = 0.42 + 0.6 * np.clip(normals @ SUN, 0.0, 1.0)
    colours = np.minimum(255, light[:, None] * SKIN).astype(int)
    flat = np.stack(
        [WIDE + 2 * SCALE * skin[..., 0], 2 * (HIGH - 74 - SCALE * skin[..., 1])], axis=-1
    )
    large = canvas.resize((2 * WIDE, 2 * HIGH))
    pen = ImageDraw.Draw(large)
    for at in np.flatnonzero(facing[:, 2] > 0):
        pen.polygon([tuple(point) for point in flat[at]], fill=tuple(colours[at]))
    canvas.paste(large.resize((WIDE, HIGH), Image.Resampling.LANCZOS))


def quartered(skin):
    """Return four triangles for each one (T, 3, 6), with all numbers halfway along its edges."""
    a, b, c = skin[:, 0], skin[:, 1], skin[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    corners = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    return np.concatenate([np.stack(each, axis=1) for each in corners])


main(*sys.argv[1:3])
