"""Placement of clips: heading and origin removed, seams of cycles closed, travel removed."""

from dataclasses import replace

import numpy as np

from posefield.common.units import UP, Floats
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield_train.source.canonical import cycle_closing, half_turns
from posefield_train.source.canonical.half_turns import Finding


def canonicalize(
    clip: Clip, cyclic: bool, in_place: bool, has_facing: bool = True
) -> tuple[Clip, tuple[Finding, ...], float]:
    """Return the clip with heading and origin removed, the corrections, and the stretch of bones.

    A cycle is closed. A motion without a facing keeps its heading. The stretch is the largest
    change of a component of a bone's offset, m.
    """
    opened, jumps = without_jumps(clip, cyclic, has_facing)
    return closed(opened, cyclic, in_place), jumps, largest_stretch(clip)


def without_jumps(clip: Clip, cyclic: bool, has_facing: bool) -> tuple[Clip, tuple[Finding, ...]]:
    """Return the clip from the origin on with jumps removed, its seam left open, and the jumps.

    Closing a cycle would spread a jump over all frames.
    """
    mended, jumps = half_turns.remove_jumps(clip, 0)
    return _from_origin(mended, cyclic, has_facing), tuple(jumps)


def closed(clip: Clip, cyclic: bool, in_place: bool) -> Clip:
    """Return a clip with the seam of a cycle closed, and without its travel if it is in place."""
    clip = cycle_closing.close_cycle(clip, heading(clip)) if cyclic else clip
    return remove_drift(clip) if in_place else clip


def largest_stretch(clip: Clip) -> float:
    """Return the largest change of a component of a bone's offset, m."""
    return float(np.ptp(clip.translations[:, 1:], axis=0).max(initial=0.0))


def _from_origin(clip: Clip, cyclic: bool, has_facing: bool) -> Clip:
    if not has_facing:
        return place(clip, _horizontal(clip.root_path[0]), np.zeros(()))
    return straighten_gait(clip) if cyclic else _start_at_origin(clip)


def place(clip: Clip, origin: Floats, heading: Floats) -> Clip:
    """Return the clip with origin (…, 3) subtracted from its root, turned by -heading (…), rad."""
    turn = np.broadcast_to(quat.from_axis_angle(UP, -np.asarray(heading)), (len(clip), 4))
    rotations, translations = clip.rotations.copy(), clip.translations.copy()
    rotations[:, 0] = quat.mul(turn, clip.rotations[:, 0])
    translations[:, 0] = quat.rotate(turn, clip.translations[:, 0] - origin)
    return replace(clip, rotations=rotations, translations=translations)


def heading(clip: Clip) -> Floats:
    """Return the unwrapped angle (F,), rad, of the root about the vertical."""
    return np.unwrap(quat.twist(clip.rotations[:, 0], UP))


def _horizontal(position: Floats) -> Floats:
    return position * (1.0 - UP)


def _start_at_origin(clip: Clip) -> Clip:
    return place(clip, _horizontal(clip.root_path[0]), heading(clip)[0])


def straighten_gait(clip: Clip) -> Clip:
    """Return the clip of a gait, starting at the origin with its mean heading forward.

    The pelvis swings, so the heading is a line fitted over all frames, taken at the start.
    """
    time = np.arange(len(clip)) / (len(clip) - 1)
    _, at_start = np.polyfit(time, heading(clip), 1)
    return place(clip, _horizontal(clip.root_path[0]), at_start)


def remove_drift(clip: Clip) -> Clip:
    """Return the clip with the linear part of its travel over the floor removed."""
    translations = clip.translations.copy()
    travel = _horizontal(clip.root_path[-1] - clip.root_path[0])
    translations[:, 0] -= np.linspace(0.0, 1.0, len(clip))[:, None] * travel
    return replace(clip, translations=translations)
