"""Retargeting of a clip to a rig: orientations by role, then pelvis, feet and hands; its report."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import UP, Booleans, Floats, Frames, RootPath, Vector
from posefield.feet.limbs import shortest_turn
from posefield.motion import clip as clips
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.question.results import StanceResult, round_micrometres
from posefield.retarget import copied_pose, planted_legs, role_map
from posefield.retarget.copied_pose import FLOOR, Soles
from posefield.retarget.planted_legs import SourceFeet
from posefield.retarget.role_map import SIDES, Body, PosedBody
from posefield.rigs.rig import Rig

Travel = Literal["scaled", "kept"]
"""Way of the root: in proportion to the legs, or as the motion has it, for places in the world."""


@dataclass(frozen=True)
class HandGoal:
    """A point in the world that a hand meets: `position` (3,), m, at `time`, s, from the start.

    role: leftHand or rightHand. until: time until which it stays there, s; None for the moment.
    """

    role: str
    time: float
    position: Vector
    until: float | None = None

    @property
    def end(self) -> float:
        """Return the last time at which the hand is there, s."""
        return self.time if self.until is None else self.until


@dataclass(frozen=True)
class RetargetReport:
    """Facts about a retargeted motion.

    mapped: roles of the motion that the rig follows. missing: roles of the motion that the rig
    lacks. scale: length of the rig's legs over that of the motion's. skate_source, skate_copied,
    skate: mean foot skate of the motion in proportion to the legs, of its copied orientations, and
    of the result, while the motion's feet stand, m/s. legs_turned: mean angle between the bones of
    legs as copied and as given, rad. lowered: most by which the pelvis was lowered so that the legs
    reach, m. penetration: 99th percentile of the depth of soles below the floor, m. hands_missed:
    distance of each hand from its goal, m. warnings: sentences for the user.
    """

    mapped: tuple[str, ...]
    missing: tuple[str, ...]
    scale: float
    skate_source: float
    skate_copied: float
    skate: float
    legs_turned: float
    lowered: float
    penetration: float
    hands_missed: tuple[float, ...]
    warnings: tuple[str, ...]

    def facts(self) -> dict[str, Any]:
        """Return the fields as plain values, lengths rounded to micrometres."""
        facts = asdict(self)
        for name, value in facts.items():
            if isinstance(value, float):
                facts[name] = round_micrometres(value)
            elif isinstance(value, tuple):
                facts[name] = list(value)
        facts["hands_missed"] = list(map(round_micrometres, self.hands_missed))
        return facts


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


def legs_turned(copied: PosedBody, planted: PosedBody) -> float:
    """Return the mean angle between the bones of legs in two poses, rad."""
    angles = []
    for side in SIDES:
        for upper, lower in (("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot")):
            bones = [
                rig.of_role(side + lower) - rig.of_role(side + upper) for rig in (copied, planted)
            ]
            angles.append(np.linalg.norm(quat.log(shortest_turn(*bones)), axis=-1))
    return float(np.mean(angles))


FADE = 0.4
"""Time before and after a goal over which the arm turns to it and back, s."""
ARMS = {
    side + "Hand": tuple(side + part for part in ("UpperArm", "LowerArm", "Hand"))
    for side in ("left", "right")
}


def check_goals(goals: Sequence[HandGoal], rig: PosedBody, rate: float) -> None:
    """Raise InvalidField for a goal of no hand of the rig, or outside the motion."""
    last = (len(rig.roots) - 1) / rate
    for goal in goals:
        lacking = [role for role in ARMS.get(goal.role, ()) if role not in rig.body.joints]
        if goal.role not in ARMS or lacking:
            note = f", but the character has no {', '.join(lacking)}" if lacking else ""
            raise InvalidField(
                "character", f"with a goal of {goal.role!r}{note}; expected a hand of it"
            )
        if not -1e-6 <= goal.time <= goal.end <= last + 1e-6:
            raise InvalidField(
                "character",
                f"with a goal at {goal.time:g} s until {goal.end:g} s, expected 0 to {last:g} s",
            )


def meet_goals(rig: PosedBody, goals: Sequence[HandGoal], rate: float) -> PosedBody:
    """Return poses in which each hand is at its goals at their times.

    A hand is moved by its distance from the goal, less before and after it. Out of reach it comes
    near.
    """
    if not goals:
        return rig
    rotations = rig.rotations.copy()
    times = np.arange(len(rotations)) / rate
    for role, roles in ARMS.items():
        goals_of_role = [goal for goal in goals if goal.role == role]
        if not goals_of_role:
            continue
        hand, shift = rig.of_role(role), np.zeros(rig.roots.shape)
        for goal in goals_of_role:
            goal_times = np.clip(times, goal.time, goal.end)
            offset = np.asarray(goal.position) - _at(hand + shift, goal_times * rate)
            shift += _shares(times - goal_times, goal, goals_of_role)[:, None] * offset
        limb, poses = rig.limb(roles)
        planted_legs.turn_limb(rotations, limb, poses, np.zeros(rig.roots.shape), hand + shift)
    return PosedBody.of_rotations(rig.body, rotations, rig.roots)


def _at(path: RootPath, frames: Annotated[Floats, "places"]) -> Annotated[Floats, "places 3"]:
    """Return the points (N, 3) of a path (F, 3) at fractional frames (N,)."""
    if len(path) < 2:
        return path[[0] * len(frames)]
    return quat.interpolate_rows(path, np.clip(frames, 0, len(path) - 1))


def _shares(away: Frames, goal: HandGoal, goals: Sequence[HandGoal]) -> Frames:
    """Return the shares (F,) of a goal: 1 at its times, 0 from the next and the last goals on.

    away (F,): time since the goal, negative before it, s.
    """
    before = min([FADE, *(gap for other in goals if (gap := goal.time - other.end) > 0.0)])
    after = min([FADE, *(gap for other in goals if (gap := other.time - goal.end) > 0.0)])
    shares: Frames = quat.smoothstep(
        np.clip(1.0 - np.where(away < 0.0, -away / before, away / after), 0.0, 1.0)
    )
    return shares


def misses(rig: PosedBody, goals: Sequence[HandGoal], rate: float) -> tuple[float, ...]:
    """Return the largest distance of each hand from its goal, m."""
    distances = []
    for goal in goals:
        # Its first and last frame, which may be fractional, and all between them.
        first, last = goal.time * rate, goal.end * rate
        between = np.arange(np.floor(first) + 1.0, np.ceil(last))
        path = _at(rig.of_role(goal.role), np.concatenate([[first], between, [last]]))
        distances.append(float(np.linalg.norm(goal.position - path, axis=-1).max()))
    return tuple(distances)


SAME_BONE = 1e-4
"""Difference of the lengths of bones up to which they are the same, m."""
MISSED = 1e-3
"""Distance of a hand from its target, m, from which on it is told."""


def retarget(
    clip: Clip,
    rig: Rig,
    roles: Mapping[str, str],
    *,
    stances: Sequence[StanceResult] | None = None,
    hands: Sequence[HandGoal] = (),
    travel: Travel = "scaled",
) -> tuple[Clip, RetargetReport]:
    """Return a clip on the skeleton of a rig, and the report on it.

    roles: joint of the clip by role, of the model's card; recognised by names where it has none.
    stances: of the motion's feet; None to detect them. hands: exact targets of hands, which are
    kept. travel: of the root.
    The result has the rig's skeleton in metres with Y up, identity rotations at rest, constant bone
    offsets and a moving root, as clips of models have; `Rig.rest` gives the values of the rig's
    file. Curves stay. Raises InvalidField for a motion without hips and two legs.
    """
    source = role_map.body_of_motion(clip.skeleton, clip.translations[0], roles)
    joints = rig.skeleton
    body = Body(joints.names, joints.parents, joints.offsets, rig.joints)
    motion = PosedBody(
        source,
        clip.rotations,
        clip.root_path,
        *skeleton.forward_kinematics(clip.skeleton.parents, clip.rotations, clip.translations),
    )
    motion = copied_pose.with_upright_rest(motion)
    scale = body.leg_length / source.leg_length
    motion = _scaled(motion, scale, scale if travel == "scaled" else 1.0)
    feet = planted_legs.feet_of(motion, body, clip.rate, stances)
    soles, higher, heights_and_heels = _ground(motion, body, feet, scale)
    rotations = copied_pose.copy_orientations(motion.body, body, motion.orientations, soles)
    still = PosedBody.of_rotations(body, rotations, np.zeros((len(rotations), 3)))
    copied = still.moved(_hips(motion) + higher * UP - _hips(still))
    # A character of the same bones has the motion as it is.
    bones = motion.body.leg_bones, body.leg_bones
    limited = len(bones[0]) != len(bones[1]) or not np.allclose(*bones, rtol=0.0, atol=SAME_BONE)
    planted, copied, depths, lowered = planted_legs.plant(
        copied, feet, heights_and_heels, limited, clip.rate
    )
    check_goals(hands, planted, clip.rate)
    final = meet_goals(planted, hands, clip.rate)
    retargeted = clips.assemble(joints, final.rotations, final.roots, joints.offsets, clip.rate)
    missing = tuple(role for role in source.joints if role not in body.joints)
    distances = misses(final, hands, clip.rate)
    paths = [
        np.stack([poses.of_role(role) for role in feet.roles], axis=1)
        for poses in (copied, planted)
    ]
    skates = [skate(path, feet.standing, clip.rate) for path in (feet.paths, *paths)]
    report = RetargetReport(
        mapped=tuple(role for role in source.joints if role in body.joints),
        missing=missing,
        scale=scale,
        skate_source=skates[0],
        skate_copied=skates[1],
        skate=skates[2],
        legs_turned=legs_turned(copied, planted),
        lowered=float(lowered.max()),
        penetration=float(np.percentile(np.maximum(depths, 0.0), 99.0)),
        hands_missed=distances,
        warnings=(*rig.notes, *_warnings(missing, hands, distances)),
    )
    return replace(retargeted, curves=clip.curves), report


def _scaled(motion: PosedBody, scale: float, travel: float) -> PosedBody:
    """Return poses in another proportion: the body by `scale`, the way of its hips by `travel`.

    Both about the floor below the hips in the first frame.
    """
    hips = _hips(motion)
    level = hips * FLOOR
    roots = level[:1] + travel * (level - level[:1])
    positions = roots[:, None] + scale * (motion.positions - level[:, None])
    return replace(motion, positions=positions)


def _hips(rig: PosedBody) -> RootPath:
    """Return the path (F, 3), m, of the middle between both hips."""
    left, right = (rig.of_role(side + "UpperLeg") for side in SIDES)
    return 0.5 * (left + right)


def _ground(
    motion: PosedBody, body: Body, feet: SourceFeet, scale: float
) -> tuple[Soles, float, tuple[Floats, Floats]]:
    """Return the soles of a motion and of a rig, left and right, and how they stand.

    Second is how much higher ankles of the rig are than those of the motion in proportion, m, then
    the heights (2,) of the rig's joints that stand above its soles, and the vectors (2, 3) at rest
    from its ankles to the soles below, m. scale: length of the rig's legs over the motion's.
    """
    heights, standing = planted_legs.standing_heights(feet, body), feet.standing
    rig_soles = [copied_pose.sole_at_rest(body, side) for side in SIDES]
    source_soles = [
        copied_pose.sole_of_motion(motion, side, standing[:, foot], rig_soles[foot])
        for foot, side in enumerate(SIDES)
    ]
    left, right = zip(source_soles, rig_soles, strict=True)
    drops = [(scale * before.flat_toes - after.toes) @ UP for before, after in (left, right)]
    on_toes = feet.roles[0].endswith("Toes")
    higher = float(np.mean(heights - feet.heights) + on_toes * np.mean(drops))
    heels = [
        (on_toes * sole.toes @ UP - height) * UP
        for sole, height in zip(rig_soles, heights, strict=True)
    ]
    return (left, right), higher, (heights, np.stack(heels))


def _warnings(
    missing: Sequence[str], goals: Sequence[HandGoal], distances: Sequence[float]
) -> Iterator[str]:
    """Yield sentences on what the character lacks or does not reach."""
    if missing:
        yield f"the character has no joint for {', '.join(missing)}: they do not move"
    for goal, miss in zip(goals, distances, strict=True):
        if miss > MISSED:
            yield f"{goal.role} at {goal.time:g} s: {miss:.3f} m from its target, out of reach"
