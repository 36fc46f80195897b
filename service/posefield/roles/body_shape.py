"""Checks of roles by the shape of the body: mirror symmetry, left on the left, upright trunk."""

from collections.abc import Mapping, Sequence

import numpy as np

from posefield.common.units import Floats
from posefield.roles.joint_recognition import SIDES, RoleGuess

BONES = (
    ("UpperArm", "LowerArm"),
    ("LowerArm", "Hand"),
    ("UpperLeg", "LowerLeg"),
    ("LowerLeg", "Foot"),
)
LARGEST_RATIO = 1.2
"""Largest ratio of the lengths of a bone on both sides."""
LEAST_ANGLE = 120.0
"""Least angle, degrees, between the legs and the trunk of a body that stands; 90 of a quadruped."""
POSES_SHARE = 90
"""Percentile of the poses that counts, since a body may bend or lie in some of them."""
UNEVEN, SWAPPED, LEVEL = 0.75, 0.5, 0.7
"""Factors of the confidence for each contradiction."""

Guesses = Mapping[str, RoleGuess]


def check_shape(guesses: Guesses, names: Sequence[str], positions: Floats) -> dict[str, RoleGuess]:
    """Return the guesses with the confidence that poses of the body leave them.

    names (J,): of the joints. positions (F, J, 3): in any unit and axes, right-handed.
    """
    index = {name: joint for joint, name in enumerate(names)}
    places = {role: positions[:, index[guess.joint]] for role, guess in guesses.items()}
    found = dict(guesses)
    for upper, lower in BONES:
        _check_lengths(found, places, upper, lower)
    if _is_swapped(places):
        sided = [role for role in found if role.startswith(SIDES)]
        _lower(found, sided, SWAPPED, "the joints named left lie on the right of the feet")
    angle = _trunk_angle(places)
    if angle is not None and angle < LEAST_ANGLE:
        said = f"the trunk stands {angle:.0f} degrees from the legs, as a quadruped's"
        _lower(found, list(found), LEVEL, said)
    return found


def _lower(found: dict[str, RoleGuess], roles: Sequence[str], factor: float, reason: str) -> None:
    for role in roles:
        found[role] = found[role].lowered(factor, reason)


def _check_lengths(
    found: dict[str, RoleGuess], places: Mapping[str, Floats], upper: str, lower: str
) -> None:
    """Lower the confidence of a bone that has no length, or differs from the other side's."""
    ends = [(side + upper, side + lower) for side in SIDES]
    if not all({first, second} <= places.keys() for first, second in ends):
        return
    left, right = (
        float(np.median(np.linalg.norm(places[first] - places[second], axis=-1)))
        for first, second in ends
    )
    if max(left, right) > LARGEST_RATIO * min(left, right) or max(left, right) == 0.0:
        said = f"the bones to it are {left:.3g} and {right:.3g} units long, left and right"
        _lower(found, [second for _, second in ends], UNEVEN, said)


def _is_swapped(places: Mapping[str, Floats]) -> bool:
    """Return whether the left leg is on the right of where the toes point in most poses."""
    needed = [side + role for side in SIDES for role in ("UpperLeg", "Foot", "Toes")]
    if not {*needed, "head"} <= places.keys():
        return False
    feet = 0.5 * (places["leftFoot"] + places["rightFoot"])
    ahead = 0.5 * (places["leftToes"] + places["rightToes"]) - feet
    left = np.cross(places["head"] - feet, ahead)
    across = places["leftUpperLeg"] - places["rightUpperLeg"]
    return bool(np.median(np.sum(left * across, axis=-1)) < 0.0)


def _trunk_angle(places: Mapping[str, Floats]) -> float | None:
    """Return the angle between legs and trunk, degrees, in most poses at least; None if unknown."""
    top = next((places[role] for role in ("neck", "upperChest", "chest") if role in places), None)
    if top is None or not {"hips", "leftFoot", "rightFoot"} <= places.keys():
        return None
    down = 0.5 * (places["leftFoot"] + places["rightFoot"]) - places["hips"]
    trunk = top - places["hips"]
    lengths = np.linalg.norm(down, axis=-1) * np.linalg.norm(trunk, axis=-1)
    cosines = np.sum(down * trunk, axis=-1) / np.maximum(lengths, 1e-12)
    angles = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    return float(np.percentile(angles, POSES_SHARE))
