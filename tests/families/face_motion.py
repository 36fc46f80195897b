"""Facial expression as a function of its controls: a smile, and how far the mouth opens.

The face is neutral at first and reaches its expression after two thirds of the clip. The jaw opens
before the corners of the mouth rise, the brows follow, and the eyes blink once on the way.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat
from posefield.motion.clip import Clip, assemble
from posefield.motion.curves import Curve, CurveValues
from posefield.motion.skeleton import Skeleton

COUNT = 25
RATE = 60.0
SEED = 2019
NOISE = 0.01
"""Standard deviation of the strength of each curve between trials."""

HEAD = Skeleton(
    ("Neck", "Head", "Jaw"),
    (-1, 0, 1),
    np.array([(0.0, 1.5, 0.0), (0.0, 0.09, 0.01), (0.0, 0.02, 0.03)]),
    (1, 2),
    np.array([(0.0, 0.2, 0.02), (0.0, -0.07, 0.07)]),
)
"""Bones of the head; the last ones end at the top of the head and at the chin."""

JAW_ANGLE, NOD_ANGLE = np.radians(22.0), np.radians(7.0)
"""Angles of a mouth that is fully open, and of the nod of a full smile, rad."""

CURVE_NAMES = (
    "jawOpen",
    "mouthFunnel",
    "mouthSmileLeft",
    "mouthSmileRight",
    "cheekSquintLeft",
    "cheekSquintRight",
    "eyeBlinkLeft",
    "eyeBlinkRight",
    "browInnerUp",
    "browOuterUpLeft",
    "browOuterUpRight",
)
"""Names of the curves, those of the blend shapes of ARKit."""


@dataclass(frozen=True)
class FaceTrial:
    """One trial: its controls and its clip."""

    smile: float
    openness: float
    clip: Clip


def duration(openness: float) -> float:
    """Return the duration of an expression, s."""
    return 0.9 + 0.5 * openness


def curve_values(smile: float, openness: float, u: Floats) -> Floats:
    """Return the curves (P, 11) at shares u (P,) of the clip, each between 0 and 1."""
    opening, smiling = _ease(u, 0.05, 0.6), _ease(u, 0.2, 0.75)
    brows, blink = _ease(u, 0.3, 0.85), np.exp(-np.square((u - 0.35) / 0.06))
    corner = 0.9 * smile * smiling
    squint = 0.6 * np.square(smile) * smiling
    raised = (0.15 + 0.6 * openness) * brows
    columns = [
        0.95 * openness * opening,
        0.5 * openness * (1.0 - smile) * opening,
        corner,
        0.96 * corner,
        squint,
        0.96 * squint,
        (0.85 - 0.2 * openness) * blink + 0.5 * squint,
        (0.85 - 0.2 * openness) * blink + 0.48 * squint,
        raised,
        0.7 * raised,
        0.65 * raised,
    ]
    return np.clip(np.stack(columns, axis=-1), 0.0, 1.0)


def expression(smile: float, openness: float, strengths: Floats | None = None) -> Clip:
    """Return the clip of an expression. strengths: factors (11,) of the curves; default: 1."""
    frames = round(duration(openness) * RATE) + 1
    u = np.linspace(0.0, 1.0, frames)
    turns = np.tile(quat.IDENTITY, (frames, len(HEAD), 1))
    right = np.array([1.0, 0.0, 0.0])
    turns[:, 1] = quat.from_axis_angle(right, -NOD_ANGLE * smile * _ease(u, 0.25, 0.9))
    turns[:, 2] = quat.from_axis_angle(right, JAW_ANGLE * openness * _ease(u, 0.05, 0.6))
    values = curve_values(smile, openness, u)
    if strengths is not None:
        values = np.clip(values * strengths, 0.0, 1.0)
    path = np.tile(HEAD.offsets[0], (frames, 1))
    clip = assemble(HEAD, turns, path, HEAD.offsets, RATE)
    return Clip(HEAD, clip.rotations, clip.translations, RATE, CurveValues(_CURVES, values))


_CURVES = tuple(Curve(name, 0.0, 1.0, 0.02) for name in CURVE_NAMES)


def trials() -> Iterator[FaceTrial]:
    """Yield all trials in order; every call yields the same.

    Their controls are a Fibonacci lattice over the unit square.
    """
    rng = np.random.Generator(np.random.PCG64(SEED))
    for index in range(COUNT):
        smile = round((index + 0.5) / COUNT, 4)
        openness = round(float(np.mod(index * 0.5 * (np.sqrt(5.0) - 1.0) + 0.1, 1.0)), 4)
        strengths = np.exp(NOISE * rng.standard_normal(len(CURVE_NAMES)))
        yield FaceTrial(smile, openness, expression(smile, openness, strengths))


def _ease(u: Floats, start: float, end: float) -> Floats:
    """Return a smooth rise (P,) from 0 at `start` to 1 at `end`, shares of the clip."""
    x = np.clip((u - start) / (end - start), 0.0, 1.0)
    return np.asarray(x * x * x * (10.0 + x * (6.0 * x - 15.0)))
