"""A procedural hand that opens, reaches and closes on an object: 16 joints, no facing.

The thinner the object, the further the fingers close. Two performers have hands of two sizes.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.random import PCG64, Generator

from posefield.common.units import Floats
from posefield.motion import bvh_writer, quat
from posefield.motion.clip import Clip, assemble
from posefield.motion.skeleton import Skeleton
from posefield_train.sample import reach_timing, sample_family

RATE, SECONDS, SEED = 60.0, 0.9, 16
PERFORMERS = {"ann": 0.92, "ben": 1.0}
"""Size of each performer's hand relative to the larger one."""
WIDTHS, LIFTS = (0.02, 0.03, 0.04, 0.05, 0.06, 0.07), (0.05, 0.12, 0.19, 0.26)
"""Thickness of the objects and rise of the wrist, m."""

FINGERS = {
    "thumb": ((0.02, -0.01, 0.03), (0.035, 0.03, 0.025), 0.75),
    "index": ((0.025, 0.0, 0.09), (0.042, 0.026, 0.02), 0.0),
    "middle": ((0.005, 0.003, 0.092), (0.046, 0.029, 0.021), 0.0),
    "ring": ((-0.015, 0.0, 0.087), (0.042, 0.027, 0.021), -0.05),
    "pinky": ((-0.034, -0.005, 0.078), (0.033, 0.02, 0.018), -0.12),
}
"""Knuckle, lengths of the three bones, m, and angle to the side, rad, of each finger."""
NAMES = ("wrist", *(f"{finger}{n}" for finger in FINGERS for n in (1, 2, 3)))

RECIPE = """\
schema = 1
name = "hand"
description = "Procedural grips of two hands on objects of several widths"
licence = "CC0-1.0"

[source]
metres_per_unit = 1.0
up = "y"

[clips]
table = "clips.csv"
file = "file"
performer = "performer"

[[controls]]
name = "width"
column = "width"
unit = "m"
description = "Thickness of the object"

[[controls]]
name = "lift"
auto = { quantity = "root_height", at = "end" }
description = "Height of the wrist at the end"

[motion]
frames = 40
cyclic = false
root = "travelling"
facing = "none"

[event]
joint = "index3"
at = "end"

[kriging]
label = "performer"

[size]
rms_budget_cm = 0.1
"""


def figure(size: float) -> Skeleton:
    """Return the skeleton of a hand at a size relative to the larger hand, fingers along +z."""
    parents, offsets, holders, tips = [-1], [(0.0, 0.0, 0.0)], [], []
    for knuckle, lengths, angle in FINGERS.values():
        along = np.array([np.sin(angle), 0.0, np.cos(angle)])
        first = len(parents)
        parents += [0, first, first + 1]
        offsets += [knuckle, *(tuple(length * along) for length in lengths[:2])]
        holders.append(first + 2)
        tips.append(lengths[2] * along)
    return Skeleton(
        NAMES, tuple(parents), size * np.array(offsets), tuple(holders), size * np.array(tips)
    )


def grip(performer: str, width: float, lift: float, rng: Generator) -> Clip:
    """Return one grip with noise. width: of the object, lift: rise of the wrist, m."""
    own = figure(PERFORMERS[performer])
    frames = round(RATE * SECONDS * (1.0 + 0.8 * lift)) + 1
    u = np.linspace(0.0, 1.0, frames)
    rotations = np.tile(quat.IDENTITY, (frames, len(NAMES), 1))
    for finger in FINGERS:
        for number, angle in enumerate(_curl(finger, u, width / PERFORMERS[performer]), start=1):
            across = np.array([np.cos(FINGERS[finger][2]), 0.0, -np.sin(FINGERS[finger][2])])
            rotations[:, NAMES.index(f"{finger}{number}")] = quat.from_axis_angle(across, angle)
    roll = 0.5 * reach_timing.minimum_jerk(u, 0.0, 0.7)
    rotations[:, 0] = quat.from_euler(np.stack([0.2 - roll, 0.4 * roll], axis=-1), "XZ")
    noise = sample_family.smooth_noise(rng, frames, (len(NAMES), 3))
    rotations = quat.mul(rotations, quat.exp(noise))
    path = np.zeros((frames, 3))
    path[:, 0] = 0.25 * reach_timing.minimum_jerk(u, 0.05, 0.8)
    path[:, 1] = 0.9 + lift * reach_timing.minimum_jerk(u, 0.0, 0.85)
    return assemble(own, rotations, path, own.offsets, RATE)


def _curl(finger: str, u: Floats, width: float) -> list[Floats]:
    """Return the angles (F,), rad, of a finger's joints; width: m, of the larger hand."""
    opening = 0.35 * reach_timing.bell_curve(np.minimum(1.6 * u, 1.0))
    closed = (1.25 - 11.0 * width) * reach_timing.minimum_jerk(u, 0.45, 1.0)
    share = (0.35, 0.5, 0.4) if finger == "thumb" else (0.9, 1.0, 0.6)
    return [part * (0.25 + closed) - opening for part in share]


def grips() -> Iterator[tuple[str, float, Clip]]:
    """Yield performer, width, m, and clip of each grip; every call yields the same."""
    rng = Generator(PCG64(SEED))
    for index, (width, lift) in enumerate(product(WIDTHS, LIFTS)):
        performer = list(PERFORMERS)[index % 3 > 0]
        yield performer, width, grip(performer, width, lift, rng)


def files() -> dict[str, bytes]:
    """Return the contents of all files of the family, by path relative to its folder."""
    found, rows = {}, ["file,performer,width"]
    for index, (performer, width, clip) in enumerate(grips(), start=1):
        path = f"bvh/grip_{index:02}.bvh"
        found[path] = bvh_writer.dumps(clip, metres_per_unit=1.0)
        rows.append(f"{path},{performer},{width}")
    table = "\n".join(rows) + "\n"
    return found | {"clips.csv": table.encode(), "recipe.toml": RECIPE.encode()}
