"""Stick figures of clips at equal steps of time, as paths of SVG."""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import UP, Floats
from posefield_train.discover.take_reading import Take

INSTANTS = 6
GAP = 0.35
"""Distance between two figures, leg lengths."""
UNIT = 40.0
"""Length of a leg in the picture."""
VIEW_TURN = np.radians(25.0)
"""Angle of the view from that which shows most of the motion, rad."""
BONES = (
    ("hips", "neck"),
    ("neck", "head"),
    *(
        bone
        for side in ("left", "right")
        for bone in (
            ("hips", f"{side}UpperLeg"),
            (f"{side}UpperLeg", f"{side}LowerLeg"),
            (f"{side}LowerLeg", f"{side}Foot"),
            (f"{side}Foot", f"{side}Toes"),
            ("neck", f"{side}UpperArm"),
            (f"{side}UpperArm", f"{side}LowerArm"),
            (f"{side}LowerArm", f"{side}Hand"),
        )
    ),
)


@dataclass(frozen=True)
class StickStrip:
    """Figures of a clip side by side.

    body, right: paths of SVG, of the trunk with the left limbs, and of the right limbs. width,
    height: of the picture.
    """

    body: str
    right: str
    width: float
    height: float


def draw(take: Take, first: int, last: int) -> StickStrip:
    """Return the figures of a part of a take at INSTANTS times, seen from where most moves."""
    frames = np.linspace(first, last, INSTANTS).round().astype(int)
    bones = [bone for bone in BONES if set(bone) <= take.places.keys()]
    hips = take.places["hips"][frames] * (1.0 - UP)
    ends = [[take.places[role][frames] - hips for role in bone] for bone in bones]
    points = np.array(ends).transpose(2, 0, 1, 3)
    across = points @ _direction(points)
    floor, top = points[..., 1].min(), points[..., 1].max()
    step = across.max() - across.min() + GAP
    x = across - across.min() + 0.5 * GAP + step * np.arange(INSTANTS)[:, None, None]
    flat = UNIT * np.stack([x, top - points[..., 1] + 0.1], axis=-1)
    is_right = np.array([any(role.startswith("right") for role in bone) for bone in bones])
    return StickStrip(
        _path(flat[:, ~is_right]),
        _path(flat[:, is_right]),
        round(float(UNIT * step * INSTANTS), 1),
        round(float(UNIT * (top - floor + 0.2)), 1),
    )


def _direction(points: Floats) -> Floats:
    """Return the horizontal direction (3,) along which the ends of bones move most, turned a bit.

    From exactly there one side of the body would hide the other.
    """
    moved = (points - points.mean(axis=0)).reshape(-1, 3) * (1.0 - UP)
    spread = (points - points.mean(axis=(1, 2), keepdims=True)).reshape(-1, 3) * (1.0 - UP)
    # A body that does not move is seen from where it is widest.
    _, vectors = np.linalg.eigh(moved.T @ moved + 0.01 * spread.T @ spread)
    found = vectors[:, -1]
    found = found if found[2] + 1e-3 * found[0] >= 0.0 else -found
    aside = np.array([found[2], 0.0, -found[0]])
    return np.asarray(np.cos(VIEW_TURN) * found + np.sin(VIEW_TURN) * aside)


def _path(bones: Floats) -> str:
    """Return the path of bones (F, B, 2, 2)."""
    lines = bones.reshape(-1, 4)
    return "".join(f"M{x:.0f} {y:.0f}L{u:.0f} {v:.0f}" for x, y, u, v in lines)
