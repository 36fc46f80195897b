"""Limbs of a character: legs that are planted, and limbs whose ends keep their paths."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from posefield.common.array_shapes import Bones
from posefield.feet import limbs
from posefield.feet.footsteps import Character
from posefield.feet.limbs import Limb
from posefield.motion import skeleton


@dataclass(frozen=True)
class LimbChoice:
    """Limbs of a character. feet: places of the planted feet among the feet that were given.

    left: the other feet, each with the reason for which it is as predicted.
    """

    character: Character
    feet: tuple[int, ...]
    left: tuple[tuple[int, str], ...]


def choose_limbs(
    parents: tuple[int, ...], bones: Bones, feet: Sequence[int], held: Iterable[int]
) -> LimbChoice:
    """Return the legs of feet, and the limbs that keep the paths of joints with constraints.

    held: joints whose positions are exact. A leg with such a joint keeps its path; a joint of the
    trunk keeps the root at its height.
    """
    joints = set(held)
    legs: dict[int, Limb] = {}
    left: list[tuple[int, str]] = []
    kept: list[Limb] = []
    used: set[int] = set()
    for place, foot in enumerate(feet):
        leg = limbs.find_limb(parents, bones, foot)
        chain = set() if leg is None else {leg.upper, leg.middle, leg.lower}
        if leg is None:
            left.append((foot, "is as predicted: no two bones lead to it"))
        elif chain & used:
            left.append((foot, "is as predicted: its leg moves another foot"))
        elif own := _held_of(parents, leg, joints):
            left.append((foot, "is as predicted: its leg meets an exact target"))
            kept.append(leg)
            joints -= own
        else:
            legs[place] = leg
        used |= chain
    arms, fixed = _arms(parents, bones, joints, used)
    character = Character(parents, bones, tuple(legs.values()), (*kept, *arms), fixed)
    return LimbChoice(character, tuple(legs), tuple(left))


def _held_of(parents: tuple[int, ...], leg: Limb, joints: set[int]) -> set[int]:
    """Return those of the joints that a leg's end carries."""
    return {joint for joint in joints if leg.lower in skeleton.joint_chain(parents, joint)}


def _arms(
    parents: tuple[int, ...], bones: Bones, joints: set[int], used: set[int]
) -> tuple[list[Limb], bool]:
    """Return the limbs that keep the paths of joints, and whether a joint has none."""
    found: list[Limb] = []
    for joint in sorted(joints):
        limb = limbs.find_kept_limb(parents, bones, joint)
        chain = set() if limb is None else {limb.upper, limb.middle, limb.lower}
        if limb is None or chain & used:
            if limb in found or any(_carries(parents, own, joint) for own in found):
                continue
            return found, True
        used |= chain
        found.append(limb)
    return found, False


def _carries(parents: tuple[int, ...], limb: Limb, joint: int) -> bool:
    """Return whether the end of a limb, which keeps its pose, carries a joint."""
    return limb.lower in skeleton.joint_chain(parents, joint)
