"""Half turns that a mocap solver makes and a body does not, found and undone.

A marker that hides for a moment leaves the twist of a finger or a toe open, and the solver comes
back half a turn off: between two frames, or for a whole take. Only joints that move next to nothing
are touched, so that no visible position changes by more than a few centimetres; each is reported.
"""

from dataclasses import dataclass, replace

import numpy as np

from service.motion import quat, skeleton
from service.motion.clip import Clip
from service.motion.conventions import Floats

# A joint moves nothing that anyone sees where all below it lies within a hand's length, m.
HAND = 0.15
# No joint turns this far between two frames of a capture, rad.
JUMP = 1.5
# A whole clip this far from the family's mean, rad, is a solver's flip and not a motion.
FLIPPED = 0.75 * np.pi


@dataclass(frozen=True)
class Finding:
    """What was noticed of one joint in one clip, and by which angle, rad.

    kind: "jump" undone between two frames, "flip" undone for the whole clip, "wrap" followed past
    half a turn from the mean, or "far", close to that.
    """

    kind: str
    joint: int
    clip: int
    angle: float


def small_joints(parents: tuple[int, ...], offsets: Floats) -> Floats:
    """Which joints (J,) carry nothing farther than a hand, by bone offsets (J, 3), m."""
    rest = np.broadcast_to(quat.IDENTITY, (*offsets.shape[:-1], 4))
    positions, _ = skeleton.forward(parents, rest, offsets)
    gaps = np.linalg.norm(positions[:, None] - positions, axis=-1)
    small: Floats = (gaps * skeleton.descendants(parents)).max(axis=1) < HAND
    return small


def without_jumps(clip: Clip, index: int) -> tuple[Clip, list[Finding]]:
    """Clip whose small joints go on turning from where they were before a jump."""
    steps = quat.mul(quat.conj(clip.rotations[:-1]), clip.rotations[1:])
    turned = np.linalg.norm(quat.log(steps), axis=-1)
    small = small_joints(clip.skeleton.parents, clip.translations[0])
    rotations, findings = clip.rotations.copy(), []
    for joint in np.flatnonzero(small & (turned.max(axis=0, initial=0.0) > JUMP)):
        kept = np.where(turned[:, joint, None] > JUMP, quat.IDENTITY, steps[:, joint])
        for frame, step in enumerate(kept):
            rotations[frame + 1, joint] = quat.mul(rotations[frame, joint], step)
        findings.append(Finding("jump", int(joint), index, float(turned[:, joint].max())))
    return replace(clip, rotations=rotations), findings


def without_flips(rotations: Floats, small: Floats) -> tuple[Floats, list[Finding]]:
    """Aligned rotations (N, T, J, 4) with clips turned back as one whose small joint is half a
    turn off throughout."""
    means = quat.mean(rotations.reshape(-1, *rotations.shape[2:]))
    return without_flips_from(means, rotations, small)


def without_flips_from(
    means: Floats, rotations: Floats, small: Floats
) -> tuple[Floats, list[Finding]]:
    """The same, half a turn off a family's means (J, 4)."""
    away = quat.mul(quat.conj(means), rotations)
    least = np.linalg.norm(quat.log(away), axis=-1).min(axis=1)
    clean, findings = rotations.copy(), []
    for clip, joint in np.argwhere((least > FLIPPED) & small):
        offset = quat.mean(away[clip, :, joint][:, None])[0]
        # mean⁻¹ q = offset · the motion itself; the offset alone is the flip.
        itself = quat.mul(quat.conj(offset), away[clip, :, joint])
        clean[clip, :, joint] = quat.mul(means[joint], itself)
        angle = float(np.linalg.norm(quat.log(offset)))
        findings.append(Finding("flip", int(joint), int(clip), angle))
    return clean, findings
