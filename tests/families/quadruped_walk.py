"""A procedural quadruped: strides of two animals at several speeds and turns, with fixed paws.

In the files the animals face -x, as in libraries of animal motion, so that the recipe has to state
the facing. No joint has a name by which its side would be recognised.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from posefield.common.units import UP, Floats
from posefield.motion import bvh_writer, quat, skeleton
from posefield.motion.clip import Clip, assemble
from posefield.motion.skeleton import Skeleton
from posefield_train.sample import sample_limbs
from posefield_train.source import facing

RATE = 60.0
FACING: facing.Facing = "-x"
ANIMALS = {"fox": 0.8, "hound": 1.0}
"""Size of each animal relative to the larger one."""
SPEEDS, TURNS = (0.5, 0.65, 0.8, 0.95, 1.1, 1.25), (-0.35, -0.1, 0.12, 0.35)
"""Speeds of the larger animal, m/s, and turns, rad a stride."""

HIPS, LENGTH, WIDTH, BONE, PAW = 0.6, 0.5, 0.11, 0.36, 0.06
"""Height of the hips, length of the back, half the distance of the legs, length of each of a leg's
two bones, and height of the ankles, m."""
STANCE = 0.66
"""Share of a stride in which a paw stands."""


@dataclass(frozen=True)
class Leg:
    """One leg. side: sign of x. ahead: distance before the hips, m. landing: phase of landing."""

    name: str
    parent: str
    side: float
    ahead: float
    landing: float

    @property
    def joints(self) -> tuple[str, str, str]:
        """Return the names of the leg's joints, downwards."""
        return f"{self.name}_upper", f"{self.name}_lower", f"{self.name}_paw"


# A walk in lateral sequence: each hind leg is followed by the foreleg of its side.
LEGS = (
    Leg("hind_a", "pelvis", 1.0, 0.0, 0.0),
    Leg("fore_a", "chest", 1.0, LENGTH, 0.25),
    Leg("hind_b", "pelvis", -1.0, 0.0, 0.5),
    Leg("fore_b", "chest", -1.0, LENGTH, 0.75),
)
TRUNK = (
    ("spine", "pelvis", (0.0, 0.0, 0.5 * LENGTH)),
    ("chest", "spine", (0.0, 0.0, 0.5 * LENGTH)),
    ("neck", "chest", (0.0, 0.10, 0.12)),
    ("head", "neck", (0.0, 0.12, 0.14)),
    ("tail1", "pelvis", (0.0, 0.04, -0.12)),
    ("tail2", "tail1", (0.0, -0.02, -0.16)),
)
TIPS = {"head": (0.0, -0.03, 0.16), "tail2": (0.0, -0.04, -0.16)}
NAMES = ("pelvis", *(name for name, _, _ in TRUNK), *(n for leg in LEGS for n in leg.joints))
PAWS = tuple(leg.joints[2] for leg in LEGS)

RECIPE = f"""\
schema = 1
name = "quadruped"
description = "Procedural walking strides of two quadrupeds"
licence = "CC0-1.0"

[source]
metres_per_unit = 1.0
up = "y"

[clips]
table = "clips.csv"
file = "file"
performer = "animal"

[[controls]]
name = "speed"
auto = {{ quantity = "speed" }}
description = "Mean speed over the stride"

[[controls]]
name = "turn"
auto = {{ quantity = "turn" }}
description = "Change of heading over the stride, positive to the left"

[motion]
frames = 48
cyclic = true
root = "travelling"
facing = "{FACING}"
feet = ["{'", "'.join(PAWS)}"]

[kriging]
label = "performer"

[size]
rms_budget_cm = 0.3
"""


def figure(size: float) -> Skeleton:
    """Return the skeleton of an animal that faces +z, at a size relative to the larger animal."""
    parents, offsets = {"pelvis": ""}, {"pelvis": (0.0, HIPS, 0.0)}
    for name, parent, offset in TRUNK:
        parents[name], offsets[name] = parent, offset
    for leg in LEGS:
        upper, lower, paw = leg.joints
        parents |= {upper: leg.parent, lower: upper, paw: lower}
        offsets |= {upper: (leg.side * WIDTH, 0.0, 0.0)}
        offsets |= dict.fromkeys((lower, paw), (0.0, -BONE, 0.0))
    tips = TIPS | dict.fromkeys(PAWS, (0.0, -PAW, 0.05))
    holders = sorted(tips, key=NAMES.index)
    return Skeleton(
        NAMES,
        (-1, *(NAMES.index(parents[name]) for name in NAMES[1:])),
        size * np.array([offsets[name] for name in NAMES]),
        tuple(map(NAMES.index, holders)),
        size * np.array([tips[name] for name in holders]),
    )


def walk_stride(animal: str, speed: float, turn: float) -> Clip:
    """Return one stride that faces +z. speed: m/s, of the larger animal; turn: rad a stride."""
    size = ANIMALS[animal]
    seconds = np.sqrt(size) * (0.45 + 0.35 * speed) / speed
    frames = round(RATE * seconds)
    length = size * speed * frames / RATE / np.sqrt(size)
    u = np.linspace(0.0, 1.0, frames + 1)
    own = figure(size)
    path = _arc(u, length, turn)
    path[:, 1] = size * (HIPS + 0.008 * np.cos(4.0 * np.pi * u))
    rotations = np.tile(quat.IDENTITY, (len(u), len(NAMES), 1))
    rotations[:, 0] = quat.from_axis_angle(UP, turn * u)
    _bend_trunk(rotations, u, turn * size * LENGTH / length)
    translations = skeleton.translations(own.offsets, path)
    positions, turned = skeleton.forward_kinematics(own.parents, rotations, translations)
    for leg in LEGS:
        upper, lower, paw = map(NAMES.index, leg.joints)
        parent = turned[:, own.parents[upper]]
        ankle, heading = _paw_path(leg, u, length, turn, size)
        to_ankle = quat.rotate(quat.conj(parent), ankle - positions[:, upper])
        # Knees bend forwards, elbows backwards.
        side = np.array([0.0, 0.0, -1.0 if leg.ahead else 1.0])
        hip, angle = sample_limbs.knee(size * BONE, size * BONE, to_ankle, side)
        bend = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), angle)
        shank = quat.mul(parent, quat.mul(hip, bend))
        flat = quat.from_axis_angle(UP, heading)
        rotations[:, [upper, lower]] = np.stack([hip, bend], axis=1)
        rotations[:, paw] = quat.mul(quat.conj(shank), flat)
    return assemble(own, rotations, path, own.offsets, RATE)


def _bend_trunk(rotations: Floats, u: Floats, bend: float) -> None:
    """Set the rotations of the trunk: a spine bent along the path by `bend`, rad, and swings."""
    phase = 2.0 * np.pi * u
    side, nod = 0.04 * np.sin(phase), 0.06 * np.cos(2.0 * phase)
    for name, yaw, pitch in (
        ("spine", 0.5 * bend + side, 0.0 * u),
        ("chest", 0.5 * bend - side, 0.0 * u),
        ("neck", 0.3 * bend + 0.0 * u, nod),
        ("head", 0.3 * bend + 0.0 * u, -nod),
        ("tail1", 4.0 * side, 0.3 + 0.0 * u),
        ("tail2", 4.0 * np.roll(side, 1), 0.2 + 0.0 * u),
    ):
        rotations[:, NAMES.index(name)] = quat.from_euler(np.stack([yaw, pitch], axis=-1), "YX")


def _arc(u: Floats, length: float, turn: float, left: float = 0.0) -> Floats:
    """Return points on the floor (..., 3) beside the arc of a stride after shares u of it."""
    on = length * u * np.exp(0.5j * turn * u) * np.sinc(turn * u / (2.0 * np.pi))
    place = on + 1j * left * np.exp(1j * turn * u)
    return np.stack([place.imag, np.zeros_like(u), place.real], axis=-1)


def _paw_path(
    leg: Leg, u: Floats, length: float, turn: float, size: float
) -> tuple[Floats, Floats]:
    """Return the ankle (F, 3), m, and the heading (F,), rad, of a paw that stands, then swings."""
    before = size * leg.ahead / length
    steps = np.floor(u - leg.landing)
    swing = np.clip((u - leg.landing - steps - STANCE) / (1.0 - STANCE), 0.0, 1.0)
    # A paw stands at the path's position in the middle of its stance.
    at = steps + leg.landing + 0.5 * STANCE + before
    # It lifts before it moves ahead, and stops before it lands.
    gone = quat.smoothstep(np.clip((swing - 0.2) / 0.6, 0.0, 1.0))
    left = size * leg.side * WIDTH
    here, there = (_arc(at + more, length, turn, left) for more in (0.0, 1.0))
    ankle = here + gone[:, None] * (there - here)
    ankle[:, 1] = size * (PAW + 0.07 * np.sin(np.pi * swing) ** 2)
    return ankle, turn * (at + gone)


def strides() -> Iterator[tuple[str, Clip]]:
    """Yield the animal and the clip of each stride, which faces +z."""
    for index, (speed, turn) in enumerate(product(SPEEDS, TURNS)):
        animal = list(ANIMALS)[index % 3 > 0]
        yield animal, walk_stride(animal, speed, turn)


def files() -> dict[str, bytes]:
    """Return the contents of all files of the family, by path relative to its folder."""
    found, rows = {}, ["file,animal"]
    for index, (animal, clip) in enumerate(strides(), start=1):
        path = f"bvh/stride_{index:02}.bvh"
        turned = facing.turn_basis(clip, -facing.AXES[FACING])
        found[path] = bvh_writer.dumps(turned, metres_per_unit=1.0)
        rows.append(f"{path},{animal}")
    table = "\n".join(rows) + "\n"
    return found | {"clips.csv": table.encode(), "recipe.toml": RECIPE.encode()}
