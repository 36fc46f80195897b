"""A procedural walk with fixed stance feet: strides of two walkers at several speeds and turns.

Its controls have unusual names and units, to test that clients read them from the model. The
strides may also be in several styles, a second label set.
"""

import tomllib
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from posefield.common.units import UP, Floats
from posefield.motion import bvh_writer, quat
from posefield.motion.clip import Clip, assemble
from posefield.motion.skeleton import Skeleton
from posefield_train.sample import sample_limbs
from posefield_train.source.recipe import Recipe

RATE = 60.0
THIGH = SHIN = 0.45
ANKLE, HIPS, WIDTH = 0.08, 0.82, 0.1
STANCE = 0.6
SIDES = {"Left": (1.0, 0.0), "Right": (-1.0, 0.5)}
"""Sign of each foot's sideways offset, and the phase at which it lands."""

SKELETON = Skeleton(
    ("Hips", "LeftUpLeg", "LeftLeg", "LeftFoot", "RightUpLeg", "RightLeg", "RightFoot"),
    (-1, 0, 1, 2, 0, 4, 5),
    np.array(
        [(0, 0, 0)]
        + [row for s in (1, -1) for row in ((s * WIDTH, 0, 0), (0, -THIGH, 0), (0, -SHIN, 0))],
        dtype=float,
    ),
    (3, 6),
    np.array([(0, 0, 0.15)] * 2, dtype=float),
)

RECIPE_TEXT = """\
schema = 1
name = "stroll"
description = "Strides of two walkers"
licence = "CC0-1.0"
[source]
metres_per_unit = 1.0
up = "y"
[clips]
table = "strides.csv"
file = "file"
performer = "who"
[[controls]]
name = "haste"
column = "haste"
unit = "km/h"
description = "How fast"
[[controls]]
name = "veer"
column = "veer"
unit = "mrad"
description = "How much the heading changes in a stride"
[motion]
frames = 40
cyclic = true
root = "travelling"
feet = ["LeftFoot", "RightFoot"]
[kriging]
label = "performer"
covariance = "matern52"
drift = 1
[size]
rms_budget_cm = 0.2
"""


def recipe() -> Recipe:
    """Return the recipe of the strides."""
    return Recipe.model_validate(tomllib.loads(RECIPE_TEXT))


@dataclass(frozen=True)
class Style:
    """Manner of a stride. lift: height of the swinging foot, m. crouch: lowering of the hips, m."""

    lift: float = 0.08
    crouch: float = 0.0


STYLES = {"plain": Style(), "marching": Style(lift=0.2), "sneaking": Style(crouch=0.06)}
SWAYS = {"ann": 0.0, "ben": 0.12}
"""Sideways sway of each walker, m."""


def styled_recipe() -> Recipe:
    """Return the recipe of the strides in several styles."""
    found = tomllib.loads(RECIPE_TEXT)
    found["clips"]["labels"] = {"style": "manner"}
    found["kriging"] = {"label": ["performer", "style"], "covariance": "matern52"}
    return Recipe.model_validate(found)


def walk_stride(speed: float, turn: float, sway: float, style: Style | None = None) -> Clip:
    """Return one stride at a speed, m/s, with a turn, rad, and a sideways sway, m."""
    manner = style or Style()
    frames = round(RATE * (0.5 + 0.45 * speed) / speed)
    length = speed * frames / RATE
    u = np.linspace(0.0, 1.0, frames + 1)
    roll = 0.05 * np.cos(2 * np.pi * u)
    pelvis = quat.mul(
        quat.from_axis_angle(UP, turn * u), quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), roll)
    )
    hips = _along(u, length, turn, sway * np.sin(2 * np.pi * u))
    hips[:, 1] = HIPS - manner.crouch + 0.01 * np.cos(4 * np.pi * u)
    course = length, turn, manner.lift
    legs = [_leg(side, u, course, hips, pelvis) for side in SIDES]
    rotations = np.stack([pelvis, *legs[0], *legs[1]], axis=1)
    return assemble(SKELETON, rotations, hips, SKELETON.offsets, RATE)


def _along(u: Floats, length: float, turn: float, left: Floats | float) -> Floats:
    """Return points on the floor (..., 3) beside the arc of a stride after shares u of it."""
    on = length * u * np.exp(0.5j * turn * u) * np.sinc(turn * u / (2 * np.pi))
    place = on + 1j * left * np.exp(1j * turn * u)
    return np.stack([place.imag, np.zeros_like(u), place.real], axis=-1)


def _leg(
    side: str, u: Floats, course: tuple[float, float, float], hips: Floats, pelvis: Floats
) -> list[Floats]:
    """Return the rotations of a leg; the foot is fixed in stance, then swings to the next.

    course: length of the stride, m, its turn, rad, and the height of the swinging foot, m.
    """
    (off, down), (length, turn, lift) = SIDES[side], course
    steps = np.floor(u - down)
    since = u - down - steps
    swing = np.clip((since - STANCE) / (1.0 - STANCE), 0.0, 1.0)
    # A foot stands at the path's position in the middle of its stance.
    at = steps + down + 0.5 * STANCE
    # The foot lifts before it moves ahead, and stops before it lands.
    gone = quat.smoothstep(np.clip((swing - 0.2) / 0.6, 0.0, 1.0))
    here, there = (_along(at + more, length, turn, off * WIDTH) for more in (0.0, 1.0))
    ankle = here + gone[:, None] * (there - here)
    ankle[:, 1] = ANKLE + lift * np.sin(np.pi * swing) ** 2
    flat = quat.from_axis_angle(UP, turn * (at + gone))
    back = quat.conj(pelvis)
    hip = hips + quat.rotate(pelvis, np.array([off * WIDTH, 0.0, 0.0]))
    to_ankle = quat.rotate(back, ankle - hip)
    upper, angle = sample_limbs.knee(THIGH, SHIN, to_ankle, np.array([0.0, 0.0, 1.0]))
    bend = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), angle)
    lower = quat.mul(pelvis, quat.mul(upper, bend))
    return [upper, bend, quat.mul(quat.conj(lower), flat)]


def write_walk(folder: Path) -> Path:
    """Write the strides and their table to a folder and return it."""
    rows = ["file,who,haste,veer"]
    points = product((0.7, 0.9, 1.1, 1.3, 1.5), (-0.5, -0.2, 0.2, 0.5))
    for index, (speed, turn) in enumerate(points):
        who, sway = (("ann", 0.02), ("ben", 0.05))[index % 3 == 0]
        clip = walk_stride(speed, turn, sway)
        (folder / f"{index}.bvh").write_bytes(bvh_writer.dumps(clip, metres_per_unit=1.0))
        rows.append(f"{index}.bvh,{who},{3.6 * speed},{1000 * turn}")
    (folder / "strides.csv").write_text("\n".join(rows) + "\n")
    return folder


def write_styled_walk(folder: Path) -> Path:
    """Write strides of both walkers in all styles, and their table, to a folder and return it.

    Each walker walks in each style at six of the thirty-six points.
    """
    rows = ["file,who,manner,haste,veer"]
    points = product(np.linspace(0.7, 1.5, 6), np.linspace(-0.5, 0.5, 6))
    ways = list(product(SWAYS, STYLES))
    for index, (speed, turn) in enumerate(points):
        # Along a row of equal speeds each way occurs once, at another turn than in the row before.
        who, manner = ways[(index + 2 * (index // 6)) % len(ways)]
        clip = walk_stride(float(speed), float(turn), SWAYS[who], STYLES[manner])
        (folder / f"{index}.bvh").write_bytes(bvh_writer.dumps(clip, metres_per_unit=1.0))
        rows.append(f"{index}.bvh,{who},{manner},{3.6 * speed},{1000 * turn}")
    (folder / "strides.csv").write_text("\n".join(rows) + "\n")
    return folder
