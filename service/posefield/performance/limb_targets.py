"""Exact targets on the character of a performance: limbs are bent so that joints meet them.

A model meets its targets with its own bones before it is joined to what comes before. What other
bones and the joins leave is the work of the limb alone. Its joints are turned as far as the target
needs it, and before and after that by a share of these turns, so that no limb is jerked straight.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Frames, Indices, RootPath, Vector
from posefield.feet import limbs
from posefield.feet.footsteps import Character, Led
from posefield.feet.limbs import Limb, LimbPoses, LimbTurns, Turns
from posefield.motion import quat, skeleton
from posefield.motion.quat import smoothstep
from posefield.performance.passage import RATE, Passage

EASING, LONGEST_EASING = 0.5, 1.2
"""Shortest and longest time before and after a target over which a limb goes to and from it, s."""
EASE, FAR = 0.02, 0.1
"""Length by which a limb stays shorter than it could, m, for a target this much or more out of
reach, m: a stretched limb leaves the pelvis no room to be lowered for the feet."""
GENTLE = 8.0
"""Acceleration of a limb's end on its way to and from a target, m/s²; the longest time limits it
less."""

HeldTurns = tuple[
    Annotated[Floats, "held 4"], Annotated[Floats, "held 4"], Annotated[Floats, "held 4"]
]
"""Rotations (H, 4) of the joints of a limb in the frames in which its target holds."""


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
        target.joint: limbs.find_kept_limb(
            character.parents, character.bones, target.joint, character.hinges
        )
        for target in targets
    }


def meet_targets(
    character: Character, passage: Passage, targets: Sequence[WorldTarget]
) -> tuple[Passage, tuple[float, ...]]:
    """Return the passage whose joints meet targets, and the distances that are left, m.

    A target out of reach is approached as far as its limb extends. A joint of the trunk stays where
    it is.
    """
    limb_of_joint = find_limbs(character, targets)
    for target in targets:
        limb = limb_of_joint[target.joint]
        if limb is not None:
            same_limb = [
                other_target
                for other_target in targets
                if (other := limb_of_joint[other_target.joint])
                and set(_chain(other)).intersection(_chain(limb))
            ]
            passage = _moved(character, passage, limb, target, same_limb)
    return passage, tuple(_miss(character, passage, target) for target in targets)


def find_leads(
    character: Character, targets: Sequence[WorldTarget], frames: range
) -> tuple[Character, Led]:
    """Return the character with the limbs that targets lead, and when they are led.

    frames: of the motion in the time of the targets. A foot with a target is led while the target
    holds, and planned as any other foot before and after. Another limb keeps the path of its end
    while its way is eased. Where a target is met by neither, such as one of the trunk, the whole
    body stays as it is.
    """
    count, around = len(frames), EASING * RATE
    feet, root = np.zeros((len(character.legs), count), bool), np.zeros(count, bool)
    arms: dict[Limb, Frames] = {}
    limb_of_joint = find_limbs(character, targets)
    used = {joint for leg in character.legs for joint in _chain(leg)}
    for target in targets:
        limb, share = (
            limb_of_joint[target.joint],
            _share(np.array(frames, float), target, around, around),
        )
        above = skeleton.joint_chain(character.parents, target.joint)
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


def _moved(
    character: Character,
    passage: Passage,
    limb: Limb,
    target: WorldTarget,
    same_limb: Sequence[WorldTarget],
) -> Passage:
    """Return the passage with one limb bent so that its tip meets a target.

    same_limb: targets of joints of the same limb, at which this one does not act.
    """
    distance, target_turns = _hold(
        _poses(character, passage, limb, range(target.begin, target.end + 1)), limb, target
    )
    # A cosine over a time T has the acceleration 0.5 (pi / T)^2 times the way.
    around = float(np.sqrt(0.5 * np.pi**2 * distance / GENTLE))
    frames = round(float(np.clip(around, EASING, LONGEST_EASING)) * RATE)
    before = min(
        [frames, *(target.begin - other.end for other in same_limb if other.end < target.begin)]
    )
    after = min(
        [frames, *(other.begin - target.end for other in same_limb if other.begin > target.end)]
    )
    rows = range(max(target.begin - before, 0), min(target.end + after + 1, len(passage)))
    share = _share(np.array(rows, float), target, before, after)
    poses = _poses(character, passage, limb, rows)
    rotations = passage.rotations.copy()
    turned = rotations[rows.start : rows.stop]
    turned[:, limb.upper], turned[:, limb.middle], turned[:, limb.lower] = _eased(
        poses, limb, target_turns, share, target.begin - rows.start
    )
    return replace(passage, rotations=rotations)


def _poses(character: Character, passage: Passage, limb: Limb, rows: range) -> LimbPoses:
    return passage.part(rows.start, rows.stop).limbs(character, [limb.tip])


def _hold(poses: LimbPoses, limb: Limb, target: WorldTarget) -> tuple[float, HeldTurns]:
    """Return the turns of a limb, while a target holds, with its tip there or nearest to it.

    First is the way along which its end goes there, m, as an arc.
    """
    upper, lower = poses.position(limb.upper), poses.position(limb.lower)
    target_end = target.position - poses.position(limb.tip) + lower
    goal = target_end + _shortfall(poses, limb, upper, target_end)
    end = goal - upper
    distance = np.linalg.norm(end, axis=-1)
    length = np.maximum(distance, 1.001 * limbs.distances(poses, limb)[0] + 1e-6)
    end = end * (length / np.maximum(distance, 1e-9))[:, None]
    before = (lower - upper)[:1]
    sine, cosine = np.linalg.norm(quat.cross(before, end[:1])), np.sum(before * end[:1])
    arc = float(np.arctan2(sine, cosine) * np.linalg.norm(end[0]))
    stretch = float(np.linalg.norm(end[0]) - np.linalg.norm(before))
    return float(np.hypot(arc, stretch)), limbs.solve(poses, limb, end)


def _shortfall(poses: LimbPoses, limb: Limb, upper: RootPath, target_end: RootPath) -> Vector:
    """Return by how much the end of a limb stays away from where it is wanted (3,), m.

    It is the same in all frames, so that what is held stays still while the body sways.
    """
    firm = limbs.firm_reach(poses, limb)
    if (np.linalg.norm(target_end - upper, axis=-1) <= firm + 1e-9).all():
        return np.zeros(3)
    centre = upper.mean(axis=0)
    spread = float(np.linalg.norm(upper - centre, axis=-1).max())
    away = target_end.mean(axis=0) - centre
    distance = max(float(np.linalg.norm(away)), 1e-9)
    length = float(limbs.distances(poses, limb)[1][0])
    reached = float(limbs.soften(np.array([distance + spread]), firm[:1], length)[0]) - spread
    beyond = np.clip((distance + spread - firm[:1]) / FAR, 0.0, 1.0)
    reached -= EASE * float(smoothstep(beyond)[0])
    shortfall: Vector = away * (reached / distance - 1.0)
    return shortfall


def _eased(
    poses: LimbPoses, limb: Limb, target_turns: HeldTurns, share: Frames, first: int
) -> LimbTurns:
    """Return the turns of a limb's joints on the way to a target, while it holds, and after it.

    share: of the turns that the target needs (F,). first: frame from which on it holds. The
    orientation of the limb's end is kept.
    """
    count = len(target_turns[0])
    near = np.clip(np.arange(len(share)) - first, 0, count - 1)
    above = poses.parent_orientation(limb.upper)
    predicted = [
        quat.mul(quat.conj(above), poses.orientation(limb.upper)),
        quat.mul(quat.conj(poses.orientation(limb.upper)), poses.orientation(limb.middle)),
    ]
    upper, middle = (
        _turned(before, after, share, near, first)
        for before, after in zip(predicted, target_turns[:2], strict=True)
    )
    turned = quat.mul(above, quat.mul(upper, middle))
    return upper, middle, quat.mul(quat.conj(turned), poses.orientation(limb.lower))


def _turned(
    before: Turns,
    target_turns: Annotated[Floats, "held 4"],
    share: Frames,
    near: Annotated[Indices, "frames"],
    first: int,
) -> Turns:
    """Return a joint's rotations (F, 4) with a share of the turn that it has at a target.

    near: for each frame, that of the held ones (H, 4) that is nearest to it.
    """
    difference = quat.mul(target_turns, quat.conj(before[first : first + len(target_turns)]))
    difference = difference * np.where(difference[:, :1] < 0.0, -1.0, 1.0)
    return quat.mul(quat.exp(share[:, None] * quat.log(difference)[near]), before)


def _share(frames: Frames, target: WorldTarget, before: float, after: float) -> Frames:
    """Return the share (F,) of a target: 1 while it holds, 0 some frames `before` and `after`."""
    early, late = (target.begin - frames) / before, (frames - target.end) / after
    away = np.clip(np.maximum(early, late), 0.0, 1.0)
    share: Frames = 0.5 + 0.5 * np.cos(np.pi * away)
    return share


def _miss(character: Character, passage: Passage, target: WorldTarget) -> float:
    """Return the largest distance of a joint from its target while it holds, m."""
    target_frames = passage.part(target.begin, min(target.end + 1, len(passage)))
    path = target_frames.limbs(character, [target.joint]).position(target.joint)
    return float(np.linalg.norm(path - target.position, axis=-1).max())
