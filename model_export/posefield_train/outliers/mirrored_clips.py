"""Detection of mirrored, side-swapped or turned clips among those that do not fit their family.

Clips are compared by joint positions relative to the root, with the heading of the first frame
removed.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from posefield.common.units import UP, Floats
from posefield_train.source import take_groups
from posefield_train.source.clip_joints import apart

# A transform is reported if undoing it reduces the distance below this share.
MAX_DISTANCE_RATIO = 0.5
# Smallest turn that is reported, degrees: clips are placed by the heading of their first frame,
# which differs by some degrees from clip to clip.
MIN_TURN = 15.0


@dataclass(frozen=True)
class ClipTransform:
    """A transform of a clip and its effect.

    description: the transform in words. before, after: distance from the prediction without and
    with the transform undone, m.
    """

    description: str
    before: float
    after: float


def find_transform(
    own: Floats, expected: Floats, names: tuple[str, ...], left: Floats
) -> ClipTransform | None:
    """Return the transform that explains a clip's distance from its prediction; None if none does.

    own, expected: joint positions (T, J, 3), m. left: unit vector (3,) to the family's left.
    """
    before = apart(own, expected)
    undone = [
        ClipTransform(said, before, apart(other, expected))
        for said, other in _transformed(own, expected, names, left)
    ]
    best = min(undone, key=lambda disguise: disguise.after, default=None)
    return best if best and best.after < MAX_DISTANCE_RATIO * before else None


def _transformed(
    own: Floats, expected: Floats, names: tuple[str, ...], left: Floats
) -> Iterator[tuple[str, Floats]]:
    swapped, flipped = (
        take_groups.mirrored_joints(names),
        own - 2.0 * (own @ left)[..., None] * left,
    )
    turn = _best_rotation(own, expected)
    if said := _describe_rotation(turn):
        yield said, own @ turn.T
    if swapped != tuple(range(len(names))):
        yield "mirrored left to right", flipped[:, swapped]
        yield "with the names of left and right joints exchanged", own[:, swapped]
        yield "with the axis from left to right reversed", flipped


def left_direction(joints: Floats, names: tuple[str, ...]) -> Floats:
    """Return the horizontal unit vector (3,) to the left of joints (N, T, J, 3).

    It is x if no joint names contain sides.
    """
    swapped = np.array(take_groups.mirrored_joints(names))
    rights = take_groups.right_joints(names)
    if not rights:
        return np.array([1.0, 0.0, 0.0])
    # The median over clips ignores a few mirrored clips.
    across = (joints[:, :, swapped[rights]] - joints[:, :, rights]).mean(axis=(1, 2))
    level = np.median(across, axis=0) * (1.0 - UP)
    return np.asarray(level / np.linalg.norm(level))


def _best_rotation(own: Floats, expected: Floats) -> Floats:
    """Return the rotation matrix that best aligns own with expected (Kabsch 1976)."""
    u, _, v = np.linalg.svd(np.einsum("tjk,tjl->kl", expected, own))
    sign = np.sign(np.linalg.det(u @ v))
    return np.asarray(u @ np.diag([1.0, 1.0, sign]) @ v)


def _describe_rotation(turn: Floats) -> str:
    """Describe a rotation in words: the wrong up axis, or the angle about the vertical.

    The description of a small rotation is empty: it is no mistake of a file.
    """
    tilt = np.degrees(np.arccos(np.clip(UP @ turn @ UP, -1.0, 1.0)))
    if tilt > 45.0:
        # The axis that the rotation maps to up is the file's up axis.
        up = turn.T @ UP
        axis = int(np.argmax(np.abs(up)))
        return f"with {'-' if up[axis] < 0 else ''}{'xyz'[axis]} for up"
    angle = np.degrees(np.arctan2(turn[0, 2] - turn[2, 0], turn[0, 0] + turn[2, 2]))
    if abs(angle) < MIN_TURN:
        return ""
    return f"turned by {angle:.0f} degrees about the vertical"
