"""Skeleton as a smooth function of stature: 33 joints, 94 degrees of freedom."""

from collections.abc import Iterator

import numpy as np

from posefield.common.units import Floats
from posefield.motion.skeleton import Skeleton

SPINE = ("LowerBack", "Spine", "Spine1")
SIDES = {"Left": 1.0, "Right": -1.0}
"""Sign of x on each side of the body."""

HINGES = ("LeftLeg", "LeftToeBase", "RightLeg", "RightToeBase")
"""Joints that turn about their x axis only."""

# Name, parent, segment and offset from the parent as a fraction of stature. Lengths are rounded
# from the anthropometry of Drillis and Contini (1966); x is given for the left side.
_TRUNK = (
    ("LowerBack", "Hips", "torso", (0.0, 0.030, -0.010)),
    ("Spine", "LowerBack", "torso", (0.0, 0.070, 0.0)),
    ("Spine1", "Spine", "torso", (0.0, 0.075, 0.0)),
    ("Neck", "Spine1", "torso", (0.0, 0.125, -0.005)),
    ("Neck1", "Neck", "head", (0.0, 0.030, 0.005)),
    ("Head", "Neck1", "head", (0.0, 0.030, 0.005)),
)
_LEG = (
    ("UpLeg", "Hips", "torso", (0.052, -0.020, 0.0)),
    ("Leg", "UpLeg", "leg", (0.0, -0.245, 0.0)),
    ("Foot", "Leg", "leg", (0.0, -0.242, 0.0)),
    ("ToeBase", "Foot", "foot", (0.0, -0.030, 0.085)),
)
_ARM = (
    ("Shoulder", "Spine1", "torso", (0.015, 0.095, 0.005)),
    ("Arm", "Shoulder", "girth", (0.095, -0.005, 0.0)),
    ("ForeArm", "Arm", "arm", (0.172, 0.0, 0.0)),
    ("Hand", "ForeArm", "arm", (0.157, 0.0, 0.0)),
    ("Thumb1", "Hand", "hand", (0.012, -0.006, 0.016)),
    ("Thumb2", "Thumb1", "hand", (0.018, -0.006, 0.012)),
    ("Index1", "Hand", "hand", (0.053, 0.0, 0.014)),
    ("Middle1", "Hand", "hand", (0.055, 0.001, 0.0)),
    ("Pinky1", "Hand", "hand", (0.048, -0.002, -0.020)),
)
_SIDE_TIPS = (
    ("ToeBase", "foot", (0.0, -0.012, 0.035)),
    ("Thumb2", "hand", (0.016, -0.004, 0.008)),
    ("Index1", "hand", (0.045, 0.0, 0.002)),
    ("Middle1", "hand", (0.048, 0.0, 0.0)),
    ("Pinky1", "hand", (0.033, 0.0, -0.003)),
)
_HEAD_TIP = ("Head", "head", (0.0, 0.091, 0.0))

Bone = tuple[str, str, str, tuple[float, float, float]]


def _mirrored(bones: tuple[Bone, ...], side: str) -> Iterator[Bone]:
    for name, parent, segment, (x, y, z) in bones:
        parent_name = parent if parent in ("Hips", "Spine1") else side + parent
        yield side + name, parent_name, segment, (SIDES[side] * x, y, z)


def _bones() -> tuple[Bone, ...]:
    legs = [bone for side in SIDES for bone in _mirrored(_LEG, side)]
    arms = [bone for side in SIDES for bone in _mirrored(_ARM, side)]
    return (*legs, *_TRUNK, *arms)


def _tips() -> list[tuple[str, str, tuple[float, float, float]]]:
    sides = [
        (side + name, segment, (sign * x, y, z))
        for side, sign in SIDES.items()
        for name, segment, (x, y, z) in _SIDE_TIPS
    ]
    return sorted([_HEAD_TIP, *sides], key=lambda tip: INDEX[tip[0]])


_BONES = _bones()
NAMES = ("Hips", *(name for name, _, _, _ in _BONES))
INDEX = {name: index for index, name in enumerate(NAMES)}
PARENTS = (-1, *(INDEX[parent] for _, parent, _, _ in _BONES))
_TIPS = _tips()


def _segments(stature: float) -> dict[str, float]:
    """Return the size of each segment relative to the average body, times stature.

    z is -1, 0 and 1 for the three performers. The torso takes the remaining height, so that the
    crown is exactly at stature in the rest pose.
    """
    z = (stature - 1.75) / 0.13
    ratio = {
        "leg": 1.0 + 0.025 * z - 0.008 * z**2,
        "foot": 1.0 + 0.010 * z - 0.010 * z**2,
        "head": 1.0 - 0.030 * z,
        "arm": 1.0 + 0.012 * z + 0.015 * z**2,
        "hand": 1.0 + 0.010 * z - 0.010 * z**2,
        "girth": 1.0 - 0.020 * z + 0.020 * z**2,
    }
    height = 0.042 * ratio["foot"] + 0.487 * ratio["leg"] + 0.151 * ratio["head"]
    ratio["torso"] = (1.0 - height) / 0.320
    return {segment: stature * size for segment, size in ratio.items()}


def skeleton(stature: float) -> Skeleton:
    """Return the skeleton of a stature, m: a T-pose facing +Z with the toes' tips on the floor."""
    size = _segments(stature)
    offsets = np.array([(0.0, 0.0, 0.0), *(offset for _, _, _, offset in _BONES)])
    offsets[1:] *= np.array([size[segment] for _, _, segment, _ in _BONES])[:, None]
    tips = np.array([offset for _, _, offset in _TIPS])
    tips *= np.array([size[segment] for _, segment, _ in _TIPS])[:, None]
    offsets[0, 1] = 0.042 * size["foot"] + 0.487 * size["leg"] + 0.020 * size["torso"]
    return Skeleton(NAMES, PARENTS, offsets, tuple(INDEX[name] for name, _, _ in _TIPS), tips)


def offset(body: Skeleton, name: str) -> Floats:
    """Return the rest offset (3,), m, of a joint by name."""
    vector: Floats = body.offsets[INDEX[name]]
    return vector


def ankle_height(stature: float) -> float:
    """Return the height of the ankle of a foot flat on the floor, m."""
    return 0.042 * _segments(stature)["foot"]


def sitting_hip(stature: float) -> float:
    """Return the height of the root of a performer who sits on a chair of common height, m."""
    return 0.295 * stature


def standing_hip(stature: float) -> float:
    """Return the height of the root of a performer who stands upright, knees unlocked, m."""
    size = _segments(stature)
    return ankle_height(stature) + 0.982 * 0.487 * size["leg"] + 0.020 * size["torso"]
