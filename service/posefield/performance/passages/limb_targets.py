"""Exact targets on the character of a performance: limbs are bent so that joints meet them.

A model meets its targets with its own bones before it is joined to what comes before. What other
bones and the joins leave is the work of the limb alone, eased in and out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames, Vector
from posefield.common.units import Floats
from posefield.feet import limbs, two_bone
from posefield.feet.footsteps import Character
from posefield.feet.leads import Led
from posefield.feet.limbs import Limb
from posefield.motion import skeleton
from posefield.performance.passages.passage import RATE, Passage

EASING = 0.5
"""Time before and after a target over which a limb goes to and from it, s."""


@dataclass(frozen=True)
class WorldTarget:
    """Point at which a joint is from one frame until another.

    position: in the world, m. pointer: to the target in the script.
    """

    joint: int
    position: Vector
    begin: int
    end: int
    pointer: str


def find_limbs(character: Character, targets: Sequence[WorldTarget]) -> dict[int, Limb | None]:
    """Return the limb that moves each joint with a target; None for a joint of the trunk."""
    return {
        own.joint: limbs.find_kept_limb(character.parents, character.bones, own.joint)
        for own in targets
    }


def meet_targets(
    character: Character, passage: Passage, targets: Sequence[WorldTarget]
) -> tuple[Passage, tuple[float, ...]]:
    """Return the passage whose joints meet targets, and the distances that are left, m.

    A joint of the trunk stays where it is.
    """
    found, left = find_limbs(character, targets), []
    for own in targets:
        limb = found[own.joint]
        if limb is not None:
            passage = _moved(character, passage, limb, own)
        left.append(_miss(character, passage, own))
    return passage, tuple(left)


def find_leads(
    character: Character, targets: Sequence[WorldTarget], frames: range
) -> tuple[Character, Led]:
    """Return the character with the limbs that targets lead, and when they are led.

    frames: of the motion in the time of the targets. A foot with a target is led while the target
    holds, and planned as any other foot before and after. Another limb keeps the path of its end
    while its way is eased. Where a target is met by neither, such as one of the trunk, the whole
    body stays as it is.
    """
    count = len(frames)
    feet, root = np.zeros((len(character.legs), count), bool), np.zeros(count, bool)
    arms: dict[Limb, Frames] = {}
    found = find_limbs(character, targets)
    used = {joint for leg in character.legs for joint in _chain(leg)}
    for own in targets:
        limb, share = found[own.joint], _share(np.array(frames, float), own)
        above = skeleton.joint_chain(character.parents, own.joint)
        legs = [leg.lower in above for leg in character.legs]
        if limb is not None and (limb in arms or not used.intersection(_chain(limb))):
            arms[limb] = np.maximum(arms.get(limb, 0.0), share)
            used.update(_chain(limb))
        elif any(legs):
            feet[legs] |= share == 1.0
        else:
            feet[:] |= share == 1.0
            root |= share == 1.0
    shares = np.array(list(arms.values())).reshape(len(arms), count)
    return replace(character, kept=tuple(arms)), Led(feet, shares, root)


def _chain(limb: Limb) -> tuple[int, int, int]:
    return limb.upper, limb.middle, limb.lower


def _moved(character: Character, passage: Passage, limb: Limb, own: WorldTarget) -> Passage:
    """Return the passage with one limb bent so that its tip meets a target."""
    around = round(EASING * RATE)
    rows = slice(max(own.begin - around, 0), min(own.end + around + 1, len(passage)))
    part = passage.part(rows.start, rows.stop)
    poses = limbs.evaluate_poses(
        character.parents, character.bones, [limb], part.rotations, part.roots
    )
    gap = own.position - poses.position(limb.tip)[own.begin - rows.start]
    share = _share(np.arange(float(rows.start), rows.stop), own)
    # The joint stays in one place while the target holds, not only at the begin.
    still = poses.position(limb.tip)[own.begin - rows.start] - poses.position(limb.tip)
    held = (share == 1.0)[:, None] * still
    goal = poses.position(limb.lower) + share[:, None] * gap + held
    end = two_bone.reach(poses, limb, np.zeros_like(goal), goal)
    turns = two_bone.solve(poses, limb, end)
    rotations = passage.rotations.copy()
    rotations[rows, limb.upper] = turns.upper
    rotations[rows, limb.middle] = turns.middle
    rotations[rows, limb.lower] = turns.lower
    return replace(passage, rotations=rotations)


def _share(frames: Annotated[Floats, "frames"], own: WorldTarget) -> Annotated[Floats, "frames"]:
    """Return the share (F,) of a target's gap that is closed: 1 while it holds, 0 far from it."""
    away = np.maximum(np.maximum(own.begin - frames, frames - own.end), 0) / (EASING * RATE)
    found: Floats = 0.5 + 0.5 * np.cos(np.pi * np.minimum(away, 1.0))
    return found


def _miss(character: Character, passage: Passage, own: WorldTarget) -> float:
    """Return the largest distance of a joint from its target while it holds, m."""
    part = passage.part(own.begin, min(own.end + 1, len(passage)))
    moved = skeleton.translations(character.bones, part.roots)
    found = skeleton.positions(character.parents, part.rotations, moved)[:, own.joint]
    return float(np.linalg.norm(found - own.position, axis=-1).max())
