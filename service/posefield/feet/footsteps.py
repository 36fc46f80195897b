"""Plans of feet, and what they are made of: characters, and motions whose feet are planned.

A plan lies on a grid of equal steps of time over the whole motion, so that it does not depend on
the frames that a question asks for. `body_plans` makes it, and `foot_placement` applies it to
frames.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Annotated, NamedTuple, TypeVar

import numpy as np

from posefield.common.frame_groups import FrameGroups
from posefield.common.units import (
    UP,
    Bones,
    Booleans,
    Floats,
    Frames,
    Indices,
    RootPath,
    Rotations,
)
from posefield.feet import limbs
from posefield.feet.limbs import Limb, LimbPoses, Points, Turns, Values
from posefield.feet.stance_rows import LIFTED, UNEVEN, Cycle
from posefield.motion import quat, skeleton
from posefield.motion.contact_detection import FootContact
from posefield.motion.hinges import Hinge
from posefield.question.motion_question import LEVEL_FLOOR, Floor

# A foot that is led to two places that are farther apart does not stand on both, m.
SAME_PLACE = 1e-3

NO_TIPS: Mapping[int, tuple[float, float, float]] = MappingProxyType({})

Value = TypeVar("Value")
Result = TypeVar("Result")


def evaluate_by_kind(
    values: Sequence[Value],
    kinds: Sequence[object],
    evaluate: Callable[[Sequence[Value]], list[Result]],
) -> list[Result]:
    """Return the result of each value; those of one kind are evaluated at once."""
    results: dict[int, Result] = {}
    for kind in dict.fromkeys(kinds):
        indices = [index for index, other in enumerate(kinds) if other == kind]
        results |= zip(indices, evaluate([values[index] for index in indices]), strict=True)
    return [results[index] for index in range(len(values))]


def floor_planes(
    floors: Sequence[Floor], groups: FrameGroups
) -> tuple[Annotated[Floats, "frames 3"], Turns | None]:
    """Return the floors of the frames of motions: heights and slopes (N, 3), and tilts (N, 4).

    Tilts are rotations from the vertical to the floor's normal; None if all floors are level.
    """
    planes = np.array([[floor.height, floor.slope_x, floor.slope_z] for floor in floors])
    sloped = bool(planes[:, 1:].any())
    tilts = np.array([floor.tilt for floor in floors])[groups.group] if sloped else None
    return planes[groups.group], tilts


def floor_heights(planes: Annotated[Floats, "frames 3"], points: Points) -> Values:
    """Return the heights (N,), m, of floors below or above points (N, 3), m."""
    heights: Values = planes[:, 0] + planes[:, 1] * points[:, 0] + planes[:, 2] * points[:, 2]
    return heights


def tilted(planes: Annotated[Floats, "frames 3"], tilts: Turns, vectors: Points) -> Points:
    """Return vectors (N, 3) turned as the floors are tilted; level floors turn none."""
    sloped = (planes[:, 1:] != 0.0).any(axis=1)
    return np.where(np.asarray(sloped)[:, None], quat.rotate(tilts, vectors), vectors)


class Led(NamedTuple):
    """Frames in which parts of a character stay as the motion has them.

    feet: whether each foot of the legs is exactly on its predicted path (K, F). limbs: share (N, F)
    of the path of each kept limb's end that is kept; 1 is exact, at 0 the end moves with the root.
    root: whether the root keeps its height (F,).
    """

    feet: Annotated[Booleans, "feet frames"]
    limbs: Annotated[Floats, "limbs frames"]
    root: Annotated[Booleans, "frames"]

    def room(self, poses: LimbPoses, chains: Sequence[Limb]) -> tuple[Frames, Frames]:
        """Return how far the pelvis may be raised, and lowered (F,), m, for what is led.

        chains: the legs, then the kept limbs. Infinite where nothing is led.
        """
        exact = np.concatenate([self.feet, self.limbs == 1.0])
        up, down = (np.where(self.root, 0.0, np.inf) for _ in range(2))
        for limb, frames in zip(chains, exact, strict=True):
            if frames.any():
                higher, lower = limbs.room(poses, limb)
                up = np.minimum(up, np.where(frames, higher, np.inf))
                down = np.minimum(down, np.where(frames, lower, np.inf))
        return up, down


def joined(leads: Sequence[Led]) -> Led:
    """Return the leads of motions whose frames lie one after another."""
    feet, limbs = (
        np.concatenate([getattr(lead, n) for lead in leads], axis=1) for n in ("feet", "limbs")
    )
    return Led(feet, limbs, np.concatenate([lead.root for lead in leads]))


def always(feet: int, limbs: int, frames: int) -> Led:
    """Return the leads of a motion in which no foot is led, and kept limbs are all the time."""
    return Led(np.zeros((feet, frames), bool), np.ones((limbs, frames)), np.zeros(frames, bool))


def lead_stances(
    down: Annotated[Booleans, "frames"],
    path: RootPath,
    rate: float,
    contact: FootContact,
    exact: Annotated[Indices, "led"],
) -> None:
    """Change in which frames a foot stands (F,) so that they agree with where it is led.

    path: of the foot (F, 3), m. exact: frames in which the foot is led there. Where it is led to a
    point above or below the floor it swings, from when it leaves the floor until it is there again,
    and for the time of half a captured swing before and after the point at least. Between two
    points on the floor it steps.
    """
    heights = path @ UP
    for frame in exact[np.abs(heights[exact] - contact.height) > UNEVEN].tolist():
        begin, end = _swing_around(frame, heights, rate, contact)
        down[begin:end] = False
    standing = exact[down[exact]]
    for last, frame in zip(standing[:-1].tolist(), standing[1:].tolist(), strict=True):
        together = down[last:frame].all()
        if together and np.linalg.norm(path[frame] - path[last]) > SAME_PLACE:
            down[min(last + 1, frame - 1) : frame] = False


def _swing_around(
    frame: int, heights: Frames, rate: float, contact: FootContact
) -> tuple[int, int]:
    """Return the frames around one in the air in which a foot swings: first, and after the last."""
    half, count = round(0.5 * contact.swing * rate), len(heights)
    begin, end = max(frame - half, 0), min(frame + half + 1, count)
    high = heights >= contact.height + LIFTED
    while begin > 0 and high[begin - 1 : frame].all():
        begin -= 1
    while end < count and high[frame : end + 1].all():
        end += 1
    return begin, end


@dataclass(frozen=True)
class Character:
    """Skeleton and limbs of a character.

    parents: of the joints. bones: offsets (J, 3), m. legs: of the feet that are planted. kept:
    limbs whose ends keep their predicted paths while they are led there, such as the arm of a hand
    with an exact target.
    fixed: whether the pelvis keeps its height above the floor. raised: whether a fixed one follows
    the floor nevertheless. hinges: limits of its knees and elbows, as far as known.
    """

    parents: tuple[int, ...]
    bones: Bones
    legs: tuple[Limb, ...]
    kept: tuple[Limb, ...] = ()
    fixed: bool = False
    raised: bool = False
    hinges: tuple[Hinge, ...] = ()


class Footsteps(NamedTuple):
    """Places and frames at which one foot stands.

    stances: frames. anchors: places (S, 3), m, of the ball of a flat foot, in the coordinates of
    each stance's first frame. flats: first frames (S,) in which the foot is flat, and keeps its
    ball there; the stance's end where it is not.
    """

    stances: tuple[range, ...]
    anchors: Annotated[Floats, "stances 3"]
    flats: Annotated[Indices, "stances"]


class FeetPlan(NamedTuple):
    """Plan of the feet over the frames of a grid.

    rate: of the grid, frames a second. cycle: as of the motion. steps: of each leg. changes: of the
    path of each foot (K, F, 3), m. lowered: how much the root is lowered (F,), m. followed: the
    part of it that follows the floor (F,), m; the rest is the pelvis. grounded: how much a
    character that floats was lowered to the level on which it was captured, m. poses: predicted, of
    the limbs. led: what keeps its predicted path, and when. toe_heights: least heights of the ends
    of toes above the floor (K,), m; minus infinity without toes. floor: on which the feet stand.
    unreached: legs, by place, none of whose stances reaches it.
    """

    character: Character
    rate: float
    cycle: Cycle | None
    steps: tuple[Footsteps, ...]
    changes: Annotated[Floats, "feet frames 3"]
    lowered: Frames
    followed: Frames
    grounded: float
    poses: LimbPoses
    led: Led
    toe_heights: Annotated[Floats, "feet"]
    floor: Floor = LEVEL_FLOOR
    unreached: tuple[int, ...] = ()


class PlanRequest(NamedTuple):
    """A motion at equal steps of time, whose feet are planned.

    rotations: (F, J, 4). roots: (F, 3), m. rate: frames a second. contacts: statistics of each
    leg's foot, with the probabilities `likely` (F, K) of its contacts; both are estimated from the
    motion if they are not given. cycle: floor motion of a cycle, whose last frame is missing, as it
    is the first one of the next; None for other motions. walking: whether it walks in each frame
    (F,); None for a motion that is no walk. floor: on which the feet stand. The steps are those of
    a floor at height 0, moved to it. A cycle does not climb: its floor must be level. led: what
    keeps its predicted path; the kept limbs all the time if not given. A foot is led over a level
    floor only.
    """

    character: Character
    rotations: Rotations
    roots: RootPath
    rate: float
    contacts: Sequence[FootContact] = ()
    likely: Annotated[Floats, "frames feet"] | None = None
    cycle: Cycle | None = None
    walking: Annotated[Booleans, "frames"] | None = None
    floor: Floor = LEVEL_FLOOR
    led: Led | None = None


def choose_limbs(
    parents: tuple[int, ...],
    bones: Bones,
    feet: Sequence[int],
    exact_joints: Iterable[int],
    hinges: Sequence[Hinge] = (),
    tips: Mapping[int, tuple[float, float, float]] = NO_TIPS,
) -> tuple[Character, tuple[int, ...], tuple[tuple[int, str], ...]]:
    """Return the limbs of a character: the legs of feet, and those that keep the paths of joints.

    Then the indices of the planted feet among the given ones, and the other feet, each with the
    reason for which it is as predicted.

    exact_joints: joints whose positions are exact. A leg with such a joint keeps its path; a joint
    of the trunk keeps the root at its height. hinges: of the skeleton, as far as known. tips: end
    sites of the skeleton, of which those of feet are toes.
    """
    joints = set(exact_joints)
    legs: dict[int, Limb] = {}
    left: list[tuple[int, str]] = []
    kept_limbs: list[Limb] = []
    used: set[int] = set()
    for index, foot in enumerate(feet):
        leg = limbs.find_limb(parents, bones, foot, hinges)
        chain = set() if leg is None else {leg.upper, leg.middle, leg.lower}
        if leg is None:
            left.append((foot, "is as predicted: no two bones lead to it"))
        elif chain & used:
            left.append((foot, "is as predicted: its leg moves another foot"))
        elif below := {
            joint for joint in joints if leg.lower in skeleton.joint_chain(parents, joint)
        }:
            left.append((foot, "is as predicted: its leg meets an exact target"))
            kept_limbs.append(leg)
            joints -= below
        else:
            has_toes = parents[foot] == leg.lower
            legs[index] = replace(leg, toe=tips.get(foot)) if has_toes else leg
        used |= chain
    arms, fixed = _arms(parents, bones, joints, used, hinges) if joints else ([], False)
    character = Character(
        parents,
        bones,
        tuple(legs.values()),
        (*kept_limbs, *arms),
        fixed,
        hinges=tuple(hinges),
    )
    return character, tuple(legs), tuple(left)


def _arms(
    parents: tuple[int, ...],
    bones: Bones,
    joints: set[int],
    used: set[int],
    hinges: Sequence[Hinge],
) -> tuple[list[Limb], bool]:
    """Return the limbs that keep the paths of joints, and whether a joint has none."""
    arms: list[Limb] = []
    for joint in sorted(joints):
        limb = limbs.find_kept_limb(parents, bones, joint, hinges)
        chain = set() if limb is None else {limb.upper, limb.middle, limb.lower}
        if limb is None or chain & used:
            if limb in arms or any(
                arm.lower in skeleton.joint_chain(parents, joint) for arm in arms
            ):
                continue
            return arms, True
        used |= chain
        arms.append(limb)
    return arms, False
