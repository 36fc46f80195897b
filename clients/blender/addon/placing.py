"""Placement of a clip on an armature and in the time of a scene."""

import math

from . import action, rig
from .action import Placing
from .without_blender import bones, rates
from .without_blender.clips import Clip

STRAIGHT = 1e-3
"""Largest turn of a cycle, rad, that Cycles modifiers with an offset can repeat."""


def put(scene, armature, clip: Clip, keep_lengths: bool, loop: bool) -> None:
    """Write the clip to the armature's action, at the scene's rate."""
    channels = bones.channels(clip, rig.rest(armature, clip), keep_lengths)
    repeated = loop and bones.heading_left(clip) <= STRAIGHT
    action.write(armature, clip, channels, _placing(scene, clip, repeated), keep_lengths)


def set_scene(scene, armature, clip: Clip, loop: bool) -> list[str]:
    """Set the scene's rate and range to the clip's and return notes on the changes."""
    before, now = _rate(scene), clip.rate
    said = []
    if not rates.same(before, now):
        scene.render.fps, scene.render.fps_base = rates.parts(now)
        said.append(f"scene rate {before:g} -> {now:g} frames a second")
        said += _others(scene, armature, now / before)
    first, last = frames(scene, clip, loop)
    if (scene.frame_start, scene.frame_end) != (first, last):
        said.append(f"scene range {scene.frame_start}-{scene.frame_end} -> {first}-{last}")
        scene.frame_start, scene.frame_end = first, last
    return said


def frames(scene, clip: Clip, loop: bool) -> tuple[int, int]:
    """Return the first and last frame to play.

    The last key of a loop repeats its first and is not played.
    """
    placing = _placing(scene, clip, loop)
    last = math.ceil(placing.start + placing.step * (len(clip) - 1) - 1e-6) - loop
    return int(placing.start), max(last, int(placing.start))


def frame_of(scene, clip: Clip, time: float) -> int:
    """Return the frame of the scene that is nearest to a time of a clip, s."""
    placing = _placing(scene, clip, False)
    return round(placing.start + placing.step * clip.rate * time)


def unrepeated(clip: Clip, loop: bool) -> list[str]:
    """Return the reason that a loop has no Cycles modifiers; empty if it has some."""
    turn = bones.heading_left(clip)
    if not loop or turn <= STRAIGHT:
        return []
    turned = f"{math.degrees(turn):.1f} degrees"
    return [f"the cycle turns by {turned}, which no modifier can repeat: in place it could be"]


def _placing(scene, clip: Clip, repeated: bool) -> Placing:
    rate = _rate(scene)
    step = 1.0 if rates.same(rate, clip.rate) else rate / clip.rate
    return Placing(scene.posefield.start, step, repeated)


def _rate(scene) -> float:
    return rates.rate(scene.render.fps, scene.render.fps_base)


def _others(scene, armature, faster: float) -> list[str]:
    count = sum(
        bool(each.animation_data and each.animation_data.action)
        for each in scene.objects
        if each != armature
    )
    if not count:
        return []
    return [f"{count} other animated objects play {faster:g} times as fast now"]
