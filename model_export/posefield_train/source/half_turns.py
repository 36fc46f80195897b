"""Detection and removal of half turns that come from the mocap solver.

An occluded marker leaves the twist of a finger or a toe undetermined, and the solver can be half a
turn off afterwards, between two frames or for a whole take. Only joints that move little are
corrected, so that no joint position changes by more than a few centimetres; each correction is
reported.
"""

from dataclasses import dataclass, replace

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip

# Rotations of a joint are hardly visible if all its descendants lie within a hand's length, m.
HAND_SIZE = 0.15
# Angle between two frames above which a rotation is a jump, rad.
JUMP_ANGLE = 1.5
# Angle from the family's mean above which a whole clip counts as flipped, rad.
FLIP_ANGLE = 0.75 * np.pi


@dataclass(frozen=True)
class Finding:
    """A correction or warning for one joint of one clip. angle: rad.

    kind: "jump" corrected between two frames, "flip" corrected for the whole clip, "wrap" unwrapped
    past half a turn from the mean, or "far", close to half a turn.
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
    """Return the clip with jumps of small joints removed, and the corrections."""
    steps = quat.mul(quat.conj(clip.rotations[:-1]), clip.rotations[1:])
    turned = np.linalg.norm(quat.log(steps), axis=-1)
    small = small_joints(clip.skeleton.parents, clip.translations[0])
    rotations, findings = clip.rotations.copy(), []
    for joint in np.flatnonzero(small & (turned.max(axis=0, initial=0.0) > JUMP_ANGLE)):
        kept = np.where(turned[:, joint, None] > JUMP_ANGLE, quat.IDENTITY, steps[:, joint])
        for frame, step in enumerate(kept):
            rotations[frame + 1, joint] = quat.mul(rotations[frame, joint], step)
        findings.append(Finding("jump", int(joint), index, float(turned[:, joint].max())))
    return replace(clip, rotations=rotations), findings


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
    away = quat.mul(quat.conj(means), rotations)
    least = np.linalg.norm(quat.log(away), axis=-1).min(axis=1)
    clean, findings = rotations.copy(), []
    for clip, joint in np.argwhere((least > FLIP_ANGLE) & small):
        offset = quat.mean(away[clip, :, joint][:, None])[0]
        # mean⁻¹ q = offset · the motion itself; the offset alone is the flip.
        itself = quat.mul(quat.conj(offset), away[clip, :, joint])
        clean[clip, :, joint] = quat.mul(means[joint], itself)
        angle = float(np.linalg.norm(quat.log(offset)))
        findings.append(Finding("flip", int(joint), int(clip), angle))
    return clean, findings
