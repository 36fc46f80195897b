"""Measures of a retargeted motion: foot skate, turned legs and depth below the floor."""

from typing import Annotated

import numpy as np

from posefield.common.units import UP, Booleans, Floats
from posefield.feet.two_bone import shortest_turn
from posefield.motion import quat
from posefield.retarget.foot_paths import SourceFeet
from posefield.retarget.planted_legs import PlantedLegs, PosedRig
from posefield.retarget.retarget_report import RetargetReport
from posefield.retarget.role_map import SIDES

PERCENTILE = 99.0


def measure(feet: SourceFeet, made: PlantedLegs, scale: float, rate: float) -> RetargetReport:
    """Return the report on a motion with planted feet, without its roles, hands and warnings.

    feet: of the motion, in proportion. scale: length of the rig's legs over the motion's.
    """
    paths = [
        np.stack([own.of_role(role) for role in feet.roles], axis=1)
        for own in (made.copied, made.rig)
    ]
    before, copied, after = (skate(own, feet.standing, rate) for own in (feet.paths, *paths))
    return RetargetReport(
        scale=scale,
        skate_source=before,
        skate_copied=copied,
        skate=after,
        legs_turned=legs_turned(made.copied, made.rig),
        lowered=float(made.lowered.max()),
        penetration=penetration(made.depths),
    )


def skate(
    paths: Annotated[Floats, "frames feet 3"],
    standing: Annotated[Booleans, "frames feet"],
    rate: float,
) -> float:
    """Return the mean speed of feet over the floor while they stand, m/s; 0 if they never do.

    paths (F, 2, 3), m. standing (F, 2): of the motion's feet.
    """
    both = standing[1:] & standing[:-1]
    speeds = rate * np.linalg.norm(np.diff(paths, axis=0) * (1.0 - UP), axis=-1)
    return float(np.sum(speeds * both) / max(int(both.sum()), 1))


def legs_turned(copied: PosedRig, made: PosedRig) -> float:
    """Return the mean angle between the bones of legs in two poses, rad."""
    angles = []
    for side in SIDES:
        for upper, lower in (("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot")):
            ends = [own.of_role(side + lower) - own.of_role(side + upper) for own in (copied, made)]
            angles.append(np.linalg.norm(quat.log(shortest_turn(*ends)), axis=-1))
    return float(np.mean(angles))


def penetration(depths: Annotated[Floats, "frames feet"]) -> float:
    """Return the 99th percentile of the depths (F, 2) of soles below the floor, m."""
    return float(np.percentile(np.maximum(depths, 0.0), PERCENTILE))
