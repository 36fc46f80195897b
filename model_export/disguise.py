"""Whether a clip would belong if it were another clip: mirrored, its sides exchanged, or turned.

All is compared by where joints are around the root, with the heading of the first frame taken out.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from model_export.bones import apart
from service.motion.conventions import UP, Floats

# A disguise is named where the clip without it lies at less than this share of its distance.
BETTER = 0.5
# Left and right as names begin.
SIDES = (("Left", "Right"), ("left", "right"), ("L", "R"), ("l", "r"))


@dataclass(frozen=True)
class Disguise:
    """What would have to be done to a clip, and how far it would then lie from what was expected,
    m; it does lie `before` away."""

    said: str
    before: float
    after: float


def found(own: Floats, expected: Floats, names: tuple[str, ...], left: Floats) -> Disguise | None:
    """The disguise of a clip with joints at own (T, J, 3), expected elsewhere, if it wears one.

    left (3,): unit vector to the family's left.
    """
    before = apart(own, expected)
    undone = [
        Disguise(said, before, apart(other, expected))
        for said, other in _without(own, expected, names, left)
    ]
    best = min(undone, key=lambda disguise: disguise.after)
    return best if best.after < BETTER * before else None


def _without(
    own: Floats, expected: Floats, names: tuple[str, ...], left: Floats
) -> Iterator[tuple[str, Floats]]:
    swapped, flipped = others(names), own - 2.0 * (own @ left)[..., None] * left
    turn = _turn(own, expected)
    yield _told(turn), own @ turn.T
    if swapped != tuple(range(len(names))):
        yield "mirrored left to right", flipped[:, swapped]
        yield "with the names of left and right joints exchanged", own[:, swapped]
        yield "with the axis from left to right reversed", flipped


def others(names: tuple[str, ...]) -> tuple[int, ...]:
    """Index (J) of each joint's counterpart on the other side; its own in the middle."""
    counterparts: dict[str, str] = {}
    for a, b in SIDES:
        for name in names:
            if name.startswith(a) and b + name.removeprefix(a) in names:
                other = b + name.removeprefix(a)
                counterparts |= {name: other, other: name}
    return tuple(names.index(counterparts.get(name, name)) for name in names)


def leftwards(joints: Floats, names: tuple[str, ...]) -> Floats:
    """Unit vector (3,) to the left of joints (N, T, J, 3), level; x where no sides are named."""
    swapped = np.array(others(names))
    rights = [i for i, other in enumerate(swapped) if names[i][0] in "Rr" and other != i]
    if not rights:
        return np.array([1.0, 0.0, 0.0])
    # The median over clips: a clip that is mirrored has no say.
    across = (joints[:, :, swapped[rights]] - joints[:, :, rights]).mean(axis=(1, 2))
    level = np.median(across, axis=0) * (1.0 - UP)
    return np.asarray(level / np.linalg.norm(level))


def _turn(own: Floats, expected: Floats) -> Floats:
    """Rotation matrix that brings own nearest to expected (Kabsch 1976)."""
    u, _, v = np.linalg.svd(np.einsum("tjk,tjl->kl", expected, own))
    sign = np.sign(np.linalg.det(u @ v))
    return np.asarray(u @ np.diag([1.0, 1.0, sign]) @ v)


def _told(turn: Floats) -> str:
    """A rotation in words: what is taken for up, where that is not up."""
    tilt = np.degrees(np.arccos(np.clip(UP @ turn @ UP, -1.0, 1.0)))
    if tilt > 45.0:
        # What the turn brings up is what the file has for up.
        up = turn.T @ UP
        axis = int(np.argmax(np.abs(up)))
        return f"with {'-' if up[axis] < 0 else ''}{'xyz'[axis]} for up"
    angle = np.degrees(np.arctan2(turn[0, 2] - turn[2, 0], turn[0, 0] + turn[2, 2]))
    return f"turned by {angle:.0f} degrees about the vertical"
