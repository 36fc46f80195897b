"""Canonical clips: jumps and half turns of the solver, heading and origin removed, seams closed."""

import ctypes
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import UP, Floats, Vector
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.curves import clamp

CLIPS_TOGETHER = 300
"""Clips of a block; temporary arrays of the motions of more would take gigabytes."""


def clip_blocks(clips: int) -> list[slice]:
    """Return the blocks of at most CLIPS_TOGETHER clips."""
    starts = range(0, clips, CLIPS_TOGETHER)
    return [slice(start, min(start + CLIPS_TOGETHER, clips)) for start in starts]


def return_freed_memory() -> None:
    """Give memory that was freed back to the system, where the C library can be told to.

    Arrays of single clips, freed between others that stay, leave holes that larger arrays do not
    fit in: 0.4 MB a clip after reading. Only glibc has this function.
    """
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)


# Rotations of a joint are hardly visible if all its descendants lie within a hand's length, m.
HAND_SIZE = 0.15
# Angle between two frames above which a rotation is a jump, rad.
JUMP_ANGLE = 1.5
# Bones that are shorter have no direction, m; bones count as along one axis above this cosine.
SHORTEST_BONE, ALONG = 1e-6, 0.999
# Largest rotation, rad, besides the twist about the bone, of a jump that is such a twist.
MOST_SWING = 0.5
# Angle from the family's mean above which a whole clip counts as flipped, rad.
FLIP_ANGLE = 0.75 * np.pi


@dataclass(frozen=True)
class Finding:
    """A correction or warning for one joint of one clip. angle: rad.

    kind: "jump" corrected between two frames, "twist" moved to the children between two frames,
    "flip" corrected for the whole clip, "wrap" unwrapped past half a turn from the mean, or "far",
    close to half a turn.
    """

    kind: str
    joint: int
    clip: int
    angle: float


def small_joints(parents: tuple[int, ...], offsets: Floats) -> Floats:
    """Return a mask (J,) of joints whose descendants lie within HAND, by bone offsets (J, 3), m."""
    rest = np.broadcast_to(quat.IDENTITY, (*offsets.shape[:-1], 4))
    positions = skeleton.positions(parents, rest, offsets)
    gaps = np.linalg.norm(positions[:, None] - positions, axis=-1)
    small: Floats = (gaps * skeleton.descendant_matrix(parents)).max(axis=1) < HAND_SIZE
    return small


def remove_jumps(clip: Clip, index: int) -> tuple[Clip, list[Finding]]:
    """Return the clip with jumps of twists and of small joints removed, and the corrections."""
    clip, findings = move_twists(clip, index)
    turned = np.linalg.norm(quat.log(_steps(clip.rotations)), axis=-1)
    small = small_joints(clip.skeleton.parents, clip.translations[0])
    rotations = clip.rotations.copy()
    for joint in np.flatnonzero(small & (turned.max(axis=0, initial=0.0) > JUMP_ANGLE)):
        steps = _steps(clip.rotations[:, joint])
        smooth = np.where(turned[:, joint, None] > JUMP_ANGLE, quat.IDENTITY, steps)
        for frame, step in enumerate(smooth):
            rotations[frame + 1, joint] = quat.mul(rotations[frame, joint], step)
        findings.append(Finding("jump", int(joint), index, float(turned[:, joint].max())))
    return replace(clip, rotations=rotations), findings


def move_twists(clip: Clip, index: int) -> tuple[Clip, list[Finding]]:
    """Return the clip with jumps about a bone moved from its joint to the joint's children.

    The longest part of a clip without such a jump stays as it is. Positions do not change.
    """
    rotations, findings = clip.rotations.copy(), []
    for joint, axis in _bone_axes(clip):
        steps = _steps(rotations[:, joint])
        angles = np.linalg.norm(quat.log(steps), axis=-1)
        twists = quat.twist(steps, axis)
        swings = quat.mul(steps, quat.from_axis_angle(axis, -twists))
        swung = np.linalg.norm(quat.log(swings), axis=-1)
        jumps = (angles > JUMP_ANGLE) & (swung < MOST_SWING)
        if not jumps.any():
            continue
        twist_angles = np.concatenate([[0.0], np.cumsum(np.where(jumps, twists, 0.0))])
        sections = np.split(np.arange(len(twist_angles)), np.flatnonzero(jumps) + 1)
        twist_angles -= twist_angles[max(sections, key=len)[0]]
        corrections = quat.from_axis_angle(axis, twist_angles)
        rotations[:, joint] = quat.mul(rotations[:, joint], quat.conj(corrections))
        for child in np.flatnonzero(np.array(clip.skeleton.parents) == joint):
            rotations[:, child] = quat.mul(corrections, rotations[:, child])
        findings.append(Finding("twist", joint, index, float(np.abs(twists[jumps]).max())))
    return (replace(clip, rotations=rotations) if findings else clip), findings


def _bone_axes(clip: Clip) -> Iterator[tuple[int, Vector]]:
    """Yield each joint that carries bones along one axis only, with that unit axis."""
    parents = np.array(clip.skeleton.parents)
    offsets = clip.translations.mean(axis=0)
    lengths = np.linalg.norm(offsets, axis=-1)
    for joint in range(len(parents)):
        children = np.flatnonzero((parents == joint) & (lengths > SHORTEST_BONE))
        if not len(children):
            continue
        axes = offsets[children] / lengths[children, None]
        if np.abs(axes @ axes[0]).min() > ALONG:
            yield joint, axes[0]


def _steps(rotations: Annotated[Floats, "*frames 4"]) -> Annotated[Floats, "*steps 4"]:
    """Return the rotations (F - 1, ...) from each frame to the next."""
    return quat.mul(quat.conj(rotations[:-1]), rotations[1:])


def remove_flips(rotations: Floats, small: Floats) -> tuple[Floats, list[Finding]]:
    """Return aligned rotations (N, T, J, 4) with flips of small joints removed, and findings.

    A flip is a small joint that is half a turn from its mean throughout a clip.
    """
    means = quat.mean(rotations.reshape(-1, *rotations.shape[2:]))
    return remove_flips_about(means, rotations, small)


def remove_flips_about(
    means: Floats, rotations: Floats, small: Floats
) -> tuple[Floats, list[Finding]]:
    """Return the result of `remove_flips` relative to given means (J, 4)."""
    blocks = clip_blocks(len(rotations))
    # Least angle (N, J) of each joint from its mean.
    nearest = np.concatenate(
        [
            np.linalg.norm(quat.log(quat.mul(quat.conj(means), rotations[rows])), axis=-1).min(
                axis=1
            )
            for rows in blocks
        ]
    )
    flips = np.argwhere((nearest > FLIP_ANGLE) & small.astype(bool))
    clean, findings = rotations.copy() if len(flips) else rotations, []
    for clip, joint in flips:
        away = quat.mul(quat.conj(means[joint]), rotations[clip, :, joint])
        offset = quat.mean(away[:, None])[0]
        # mean⁻¹ q = offset · the motion itself; the offset alone is the flip.
        itself = quat.mul(quat.conj(offset), away)
        clean[clip, :, joint] = quat.mul(means[joint], itself)
        angle = float(np.linalg.norm(quat.log(offset)))
        findings.append(Finding("flip", int(joint), int(clip), angle))
    return clean, findings


FADE = 0.2
"""Share of the cycle in which half of the gap fades, at either end."""
RATE_SPAN = 0.03
"""Share of the cycle in one of the two steps over which rates of change are measured."""


def close_cycle(clip: Clip, heading: Floats) -> Clip:
    """Return a closed cycle. heading: unwrapped angle (F,) of its root about the vertical, rad.

    The root keeps its travel over the floor and the turn of the line fitted to its heading.
    """
    frames = np.arange(len(clip))
    line = np.polynomial.Polynomial.fit(frames, heading, 1)
    walking = quat.from_axis_angle(UP, line(frames))
    rotations = clip.rotations.copy()
    rotations[:, 0] = quat.mul(quat.conj(walking), rotations[:, 0])
    gap, rates = _log_between(rotations[0], rotations[-1]), _rate_gap(rotations, _log_between)
    rotations = quat.mul(rotations, quat.exp(_offsets(gap, rates, len(clip))))
    rotations[:, 0] = quat.mul(walking, rotations[:, 0])
    translations = clip.translations.copy()
    height = clip.root_path @ UP
    rise = _offsets(height[-1] - height[0], _rate_gap(height), len(clip))
    translations[:, 0] += rise[:, None] * UP
    curves = clip.curves
    if curves is not None:
        values = curves.values
        offsets = _offsets(values[-1] - values[0], _rate_gap(values), len(values))
        curves = replace(curves, values=clamp(curves.curves, values + offsets))
    return replace(clip, rotations=rotations, translations=translations, curves=curves)


def _rate_gap(
    values: Floats, change: Callable[[Floats, Floats], Floats] = lambda first, last: last - first
) -> Floats:
    """Return the rate of change of values (F, ...) at the end less that at the start, per cycle.

    change: from one value to another. One-sided differences of second order, because limbs may turn
    back at the seam.
    """
    frames = len(values)
    step = max(min(round(RATE_SPAN * (frames - 1)), (frames - 1) // 2), 1)
    begin = [change(values[0], values[step * k]) for k in (1, 2)]
    end = [change(values[-1], values[-1 - step * k]) for k in (1, 2)]
    share = step / (frames - 1)
    first, last = ((4.0 * one - two) / (2.0 * share) for one, two in (begin, end))
    return np.asarray(-last - first)


def _log_between(first: Floats, last: Floats) -> Floats:
    return quat.log(quat.mul(quat.conj(first), last))


def _offsets(gap: Floats, rates: Floats, frames: int) -> Floats:
    """Return what to add to each frame (F, ...) of a cycle with a gap and a difference of rates.

    Hermite's cubic at either end: half of both at the seam, and nothing FADE of the cycle away.
    """
    share = np.linspace(0.0, 1.0, frames)
    total = np.zeros((frames, *np.shape(gap)))
    for distance, sign in ((share, 1.0), (1.0 - share, -1.0)):
        t = np.minimum(distance / FADE, 1.0)
        value, rate = (1.0 + 2.0 * t) * (1.0 - t) ** 2, FADE * t * (1.0 - t) ** 2
        total += 0.5 * sign * np.multiply.outer(value, gap) + 0.5 * np.multiply.outer(rate, rates)
    return total


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
    mended, jumps = remove_jumps(clip, 0)
    if cyclic and has_facing:
        return straighten_gait(mended), tuple(jumps)
    turn = heading(mended)[0] if has_facing else np.zeros(())
    return place(mended, _horizontal(mended.root_path[0]), turn), tuple(jumps)


def closed(clip: Clip, cyclic: bool, in_place: bool) -> Clip:
    """Return a clip with the seam of a cycle closed, and without its travel if it is in place."""
    clip = close_cycle(clip, heading(clip)) if cyclic else clip
    return remove_drift(clip) if in_place else clip


def largest_stretch(clip: Clip) -> float:
    """Return the largest change of a component of a bone's offset, m."""
    return float(np.ptp(clip.translations[:, 1:], axis=0).max(initial=0.0))


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
