"""Checks and normalization of skeletons: dummy roots, rest poses, stretching bones."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import UP, Floats
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield.roles import joint_recognition
from posefield_train.source.facing import Facing, FacingError, find_facing, turn_basis

STATIC = 1e-6
"""Largest change of a static joint: of its place, m, and of its quaternion's components."""
RIGID = 1e-4
"""Largest change of a translation that counts as rounding, m."""


def count_dummies(clips: Sequence[Clip]) -> int:
    """Return the number of dummy roots of a family's clips, which have one skeleton.

    Each has one child, and is static or slides over the floor: upright and at one height. The
    child of the last moves against it.
    """

    def is_static(clip: Clip) -> bool:
        channels = clip.rotations[:, joint], clip.translations[:, joint]
        return max(float(np.ptp(channel, axis=0).max()) for channel in channels) < STATIC

    def slides(clip: Clip) -> bool:
        """Return whether the joint slides over the floor upright and at one height."""
        upright = np.abs(clip.rotations[:, joint][:, [1, 3]]).max() < STATIC
        return bool(upright and np.ptp(clip.translations[:, joint] @ UP) < RIGID)

    joints = clips[0].skeleton
    count = joint = 0
    while joints.parents.count(joint) == 1 and joint not in joints.tip_joints:
        if not all(is_static(clip) or slides(clip) for clip in clips):
            break
        joint += 1
        if any(np.ptp(clip.translations[:, joint], axis=0).max() > RIGID for clip in clips):
            count = joint
    return count


def collapse_roots(clip: Clip, count: int) -> Clip:
    """Return the clip without its first `count` joints; the next one moves in the world as before.

    Each of these joints must have the next joint as its only child.
    """
    if not count:
        return clip
    joints = clip.skeleton
    chain = (-1, *range(count))
    positions, turns = skeleton.forward_kinematics(
        chain, clip.rotations[:, : count + 1], clip.translations[:, : count + 1]
    )
    rest = joints.offsets[count:].copy()
    rest[0] = joints.offsets[: count + 1].sum(axis=0)
    smaller = Skeleton(
        joints.names[count:],
        (-1, *(parent - count for parent in joints.parents[count + 1 :])),
        rest,
        tuple(joint - count for joint in joints.tip_joints),
        joints.tip_offsets,
    )
    rotations, translations = clip.rotations[:, count:].copy(), clip.translations[:, count:].copy()
    rotations[:, 0], translations[:, 0] = turns[:, -1], positions[:, -1]
    return Clip(smaller, quat.normalize(rotations), translations, clip.rate, clip.curves)


def describe_dummies(names: Sequence[str], count: int) -> str:
    """Return the note on collapsed roots. names: of all joints before."""
    dummies = " and ".join(map(repr, names[:count]))
    verb = "is a dummy root" if count == 1 else "are dummy roots"
    return f"{dummies} {verb} above {names[count]!r}, which moves on its own and became the root"


STRETCH_SHARE = 0.006
"""Largest stretch of a bone as a share of the body's size: 1 cm of an adult."""
FEW_FRAMES = 0.1
"""Share of frames below which a stretch counts as a jump of the solver."""
MANY_BONES = 0.5
"""Share of the bones above which the skeleton as a whole counts as elastic."""


@dataclass(frozen=True)
class Stretch:
    """Largest stretch of a family. clip: index of the clip. distance, limit: m."""

    clip: int
    joint: int
    distance: float
    limit: float
    cause: str

    def sentence(self, joints: Skeleton) -> str:
        """Return the stretch in words, for an error."""
        return (
            f"bones stretch: joint {joints.names[self.joint]!r} moves by up to "
            f"{100 * self.distance:.1f} cm against its parent "
            f"{joints.names[joints.parents[self.joint]]!r}, expected at most "
            f"{100 * self.limit:.2g} cm, because a model keeps each bone's mean length; "
            f"{self.cause}, or say motion.bones = 'stretch' to keep the mean"
        )


def body_size(clip: Clip) -> float:
    """Return the largest extent of the joints in any frame along an axis, m."""
    return float(np.ptp(clip.positions(), axis=1).max())


def find_stretch(clips: Sequence[Clip]) -> Stretch | None:
    """Return the largest stretch of the clips of one skeleton; None if it is within the limit."""
    stretches = np.stack([_stretches(clip).max(axis=0) for clip in clips])
    clip, joint = map(int, np.unravel_index(np.argmax(stretches), stretches.shape))
    limit = STRETCH_SHARE * float(
        np.median([body_size(clip_of_family) for clip_of_family in clips])
    )
    if stretches[clip, joint] <= max(limit, 1e-4):
        return None
    cause = _likely_cause(clips[clip], joint, limit)
    return Stretch(clip, joint, float(stretches[clip, joint]), limit, cause)


def _stretches(clip: Clip) -> Annotated[Floats, "frames joints"]:
    """Return the distance (F, J), m, of each joint's offset from its mean; zero for the root."""
    gaps = clip.translations - clip.translations.mean(axis=0)
    gaps[:, 0] = 0.0
    return np.asarray(np.linalg.norm(gaps, axis=-1))


def _likely_cause(clip: Clip, joint: int, limit: float) -> str:
    stretches = _stretches(clip)
    joints = clip.skeleton
    beyond = stretches.max(axis=0) > limit
    if np.mean(stretches[:, joint] > limit) < FEW_FRAMES:
        return "it does so in few frames, as after a marker was lost: repair them or cut them off"
    if np.mean(beyond[1:]) > MANY_BONES:
        return "most bones do, as in a solve without a fixed skeleton: solve it with rigid bones"
    if joint not in joints.parents:
        return (
            "it has no children, as a prop or a target of inverse kinematics: leave it out with "
            "motion.drop_joints"
        )
    if joints.parents[joint] == 0:
        siblings = [joints.names[j] for j, p in enumerate(joints.parents) if p == 0 and j != joint]
        listed = f" besides {', '.join(siblings)}" if siblings else ""
        return (
            f"it looks like the body's own root{listed}: leave the others out with "
            "motion.drop_joints, so that it becomes the root"
        )
    return "its position channels carry motion: bake it into rotations"


SMALLEST = 1e-6
"""Total length of bones below which all joints lie in one point, m."""
OTHER_BODY = 0.05
"""Root mean square difference of two bodies' bones, as a share of the bones' own."""


def is_degenerate(offsets: Floats) -> bool:
    """Return whether a skeleton of several joints with bone offsets (J, 3), m, is a point."""
    return len(offsets) > 1 and float(np.linalg.norm(offsets[1:], axis=-1).sum()) < SMALLEST


def _refuse_two_bodies(offsets: Floats, performers: Sequence[str], files: Sequence[str]) -> None:
    """Raise RigError for a performer with two bodies.

    offsets: of the bones (N, J, 3), m. performers: names (N,), "" for none. A single clip that
    differs from the others is no second body: the detection of outliers tells of it.
    """
    for performer in sorted(set(performers) - {""}):
        clips = np.flatnonzero(np.array(performers) == performer)
        bodies = _split(offsets[clips])
        if bodies:
            first, second, (several, few), distance = bodies
            raise RigError(
                f"two performers under the name {performer!r}: the bones of {few} clips, such as "
                f"{files[clips[second]]}, differ by {100 * distance:.1f} cm from those of "
                f"{several}, such as {files[clips[first]]}; expected one body for each name",
                int(clips[second]),
            )


def _split(offsets: Floats) -> tuple[int, int, tuple[int, int], float] | None:
    """Return a clip of each body, the clips of each, and their difference, m; None for one body.

    The clips that are like one of them are compared with those that are not.
    """
    size = float(np.sqrt(np.mean(np.sum(np.square(offsets), axis=-1))))
    distances = np.stack([_distances(offsets, one) for one in offsets])
    alike = distances <= OTHER_BODY * size
    first = int(np.argmax(alike.sum(axis=1)))
    different = np.flatnonzero(~alike[first])
    if len(different) < 2:
        return None
    second = int(different[np.argmax(alike[different].sum(axis=1))])
    count = int(alike[second].sum())
    if count < 2:
        return None
    return first, second, (int(alike[first].sum()), count), float(distances[first, second])


def _distances(offsets: Floats, one: Floats) -> Floats:
    """Return the root mean square distances (N,), m, of offsets (N, J, 3) from one's (J, 3)."""
    return np.asarray(np.sqrt(np.mean(np.sum(np.square(offsets - one), axis=-1), axis=-1)))


ADULT_LEG = 0.86
"""Length of the bones from hip to foot of an adult, m."""
OTHER_UNIT = 2.1
"""Least ratio of the legs of two bodies with the same joints that are in different units: legs of a
child and an adult differ by less, any two units by more."""
SMALLEST_BODY, LARGEST_BODY = 0.02, 20.0
"""Lengths of all bones together beyond which a body without legs is doubted, m."""


def leg_length(joints: Skeleton, roles: Mapping[str, str], bones: Floats) -> float | None:
    """Return the mean length of the legs, from hip to foot; None without their roles.

    roles: joints by role. bones (J,): length of the bone that leads to each joint.
    """
    lengths = []
    for side in ("left", "right"):
        if not {f"{side}UpperLeg", f"{side}Foot"} <= roles.keys():
            continue
        top, joint = (joints.names.index(roles[side + end]) for end in ("UpperLeg", "Foot"))
        length = 0.0
        while joint > top:
            length += float(bones[joint])
            joint = joints.parents[joint]
        lengths += [length] if joint == top and length else []
    return float(np.mean(lengths)) if lengths else None


def size_notes(clips: Sequence[Clip]) -> list[str]:
    """Return a note on a body that is far from a person's size, as in a wrong unit."""
    joints = clips[0].skeleton
    offsets = np.median([clip.translations.mean(axis=0) for clip in clips], axis=0)
    bones = np.linalg.norm(offsets, axis=-1) * (np.arange(len(offsets)) > 0)
    guesses = joint_recognition.recognise(joints.names, joints.parents)
    leg = leg_length(joints, joint_recognition.sure_roles(guesses), bones)
    doubt = "is source.metres_per_unit right?"
    if leg is not None and not ADULT_LEG / OTHER_UNIT < leg < ADULT_LEG * OTHER_UNIT:
        return [f"the legs are {leg:.3g} m long, of an adult about {ADULT_LEG} m: {doubt}"]
    if leg is None and len(joints) > 1 and not SMALLEST_BODY < bones.sum() < LARGEST_BODY:
        return [f"the bones are {bones.sum():.3g} m long together: {doubt}"]
    return []


class RigError(ValueError):
    """A skeleton that cannot be trained; clip: index of a clip that shows it."""

    def __init__(self, message: str, clip: int = 0) -> None:
        super().__init__(message)
        self.clip = clip


def normalize(
    clips: Sequence[Clip],
    performers: Sequence[str],
    files: Sequence[str],
    *,
    facing: Facing | None,
    stretches: bool,
    cyclic: bool,
    directed: bool,
    roles: Mapping[str, str],
    recipe_joints: Collection[str],
) -> tuple[list[Clip], float | None, list[str]]:
    """Return the clips of one skeleton in the basis of their facing, without dummy roots.

    The facing is in degrees to the left of the root's +z, None for a family without one; notes
    follow. performers, files: names by clip. stretches: bones may stretch. directed: controls
    depend on the facing. roles: joints by role. recipe_joints: those that it names. Raises
    RigError for a rest pose without extent, bones that stretch, two bodies under one name, and a
    facing that the motion contradicts.
    """
    names = clips[0].skeleton.names
    count = count_dummies(clips)
    gone = set(recipe_joints) & set(names[:count])
    if gone:
        raise RigError(
            f"the recipe names {', '.join(map(repr, sorted(gone)))}, but "
            f"{describe_dummies(names, count)}: name {names[count]!r} instead"
        )
    notes = [describe_dummies(names, count)] if count else []
    clips = [collapse_roots(clip, count) for clip in clips]
    offsets = np.stack([clip.translations.mean(axis=0) for clip in clips])
    offsets[:, 0] = 0.0
    for index, bones in enumerate(offsets):
        if is_degenerate(bones):
            raise RigError(
                f"the rest pose is degenerate: all {len(bones)} joints lie in one point, expected "
                "bones with a length",
                index,
            )
    stretch = None if stretches else find_stretch(clips)
    if stretch:
        raise RigError(stretch.sentence(clips[0].skeleton), stretch.clip)
    _refuse_two_bodies(offsets, performers, files)
    try:
        degrees, facing_notes = find_facing(clips, facing, roles, cyclic)
    except FacingError as fault:
        raise RigError(str(fault), fault.clip) from fault
    if facing or directed:
        notes += facing_notes
    return [turn_basis(clip, degrees or 0.0) for clip in clips], degrees, notes
