"""Clips of different skeletons on one topology, with one rest pose and their own proportions.

Positions of the kept joints stay as they are: each joint takes the orientation of its file's joint,
turned by a constant, and the offset that leads to it. A bone on which a joint was left out is
turned to its end, so that only its length changes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source import canonical_rest, common_topology, skeleton_checks
from posefield_train.source.canonical_rest import JointMotion
from posefield_train.source.common_topology import (
    LIMB_ROLES,
    JointPoint,
    RoleJoints,
    StatedRoles,
    Topology,
    TopologyError,
)

MOST_POSES = 60
"""Poses of a clip that tell the axes of a body."""
SAME_REST = 0.02
"""Difference of the rest poses of one body, as a share of the bones: 1 degree."""


@dataclass(frozen=True)
class SkeletonKind:
    """Clips whose files have the same joints.

    skeleton: of the first of them. clips: indices. joints: by role.
    """

    skeleton: Skeleton
    clips: tuple[int, ...]
    joints: RoleJoints

    @property
    def left_out(self) -> tuple[str, ...]:
        """Return the joints that no role and no chain has."""
        kept = self.joints.kept
        return tuple(name for at, name in enumerate(self.skeleton.names) if at not in kept)


@dataclass(frozen=True)
class UnifiedClips:
    """Clips on one topology, in the order of the files' clips.

    points: place of each joint in the files of each kind.
    """

    clips: tuple[Clip, ...]
    topology: Topology
    kinds: tuple[SkeletonKind, ...]
    points: tuple[Mapping[str, JointPoint], ...]


def unify(clips: Sequence[Clip], stated: StatedRoles) -> UnifiedClips:
    """Return clips on the topology that their skeletons have in common.

    stated: joints by role of the recipe. Raises TopologyError for a skeleton without a needed role,
    and for a stated joint that no file has.
    """
    kinds = _find_kinds(clips, stated)
    lengths = [
        np.linalg.norm(clips[kind.clips[0]].translations.mean(axis=0), axis=-1) for kind in kinds
    ]
    bodies = [kind.joints for kind in kinds]
    topology = common_topology.common_topology(bodies)
    points = common_topology.joint_points(bodies, lengths, topology)
    found = dict[int, Clip]()
    for kind, places in zip(kinds, points, strict=True):
        motions = {at: joint_motion(clips[at], places) for at in kind.clips}
        aimed = _aimed_bones(kind.skeleton, topology, places)
        for group in _bodies(clips, kind.clips):
            # The axes of a body from poses spread over its clips.
            poses = []
            for motion in (motions[at] for at in group):
                count = len(motion.positions)
                frames = np.linspace(0, count - 1, min(count, MOST_POSES)).round().astype(int)
                picked = np.unique(frames)
                poses.append(JointMotion(motion.positions[picked], motion.turns[picked]))
            turns = canonical_rest.mean_turns(topology, poses)
            for at in group:
                found[at] = _unified(clips[at], topology, motions[at], turns, aimed)
    ordered = tuple(found[at] for at in range(len(clips)))
    return UnifiedClips(ordered, topology, tuple(kinds), tuple(points))


def _find_kinds(clips: Sequence[Clip], stated: StatedRoles) -> list[SkeletonKind]:
    """Return the kinds of skeletons in the order of their first clips."""
    groups: dict[tuple[tuple[str, ...], tuple[int, ...]], list[int]] = {}
    for at, clip in enumerate(clips):
        groups.setdefault((clip.skeleton.names, clip.skeleton.parents), []).append(at)
    known = {name for names, _ in groups for name in names}
    unknown = sorted({name for names in stated.values() for name in names} - known)
    if unknown:
        raise TopologyError(f"skeleton.roles: no file has joint {', '.join(map(repr, unknown))}")
    found = []
    for own in groups.values():
        first = clips[own[0]].skeleton
        try:
            found.append(
                SkeletonKind(first, tuple(own), common_topology.role_joints(first, stated))
            )
        except TopologyError as fault:
            raise TopologyError(str(fault), own[0]) from fault
    return found


def _bodies(clips: Sequence[Clip], own: Sequence[int]) -> list[list[int]]:
    """Return the clips of one skeleton by bodies with the same rest pose, in their order."""
    groups: list[tuple[Floats, list[int]]] = []
    for at in own:
        offsets = clips[at].translations.mean(axis=0)[1:]
        for rest, members in groups:
            if np.linalg.norm(rest - offsets) <= SAME_REST * np.linalg.norm(rest):
                members.append(at)
                break
        else:
            groups.append((offsets, [at]))
    return [members for _, members in groups]


def joint_motion(clip: Clip, places: Mapping[str, JointPoint]) -> JointMotion:
    """Return positions and orientations of a topology's joints in a clip of a file."""
    positions, turns = skeleton.forward_kinematics(
        clip.skeleton.parents, clip.rotations, clip.translations
    )
    points = list(places.values())
    shares = np.array([point.share for point in points])[:, None]
    joints, ends = ([getattr(point, name) for point in points] for name in ("joint", "following"))
    placed = positions[:, joints] + shares * (positions[:, ends] - positions[:, joints])
    return JointMotion(placed, turns[:, joints])


def _aimed_bones(
    own: Skeleton, topology: Topology, places: Mapping[str, JointPoint]
) -> list[tuple[int, int, Floats]]:
    """Return the bones on which a joint was left out: their ends, and direction (3,) at rest.

    The hips and the last joint of the spine carry several bones, and keep their orientation.
    """
    bones = [
        (name, above, canonical_rest.Y)
        for name, above in zip(topology.trunk, topology.trunk[1:], strict=False)
        if name != f"spine{topology.spine}"
    ]
    limbs = [(name, *canonical_rest.limb_bone(name)) for name in topology.names]
    bones += [bone for bone in limbs if bone[1] in topology.names]
    return [
        (topology.index(name), topology.index(end), direction)
        for name, end, direction in bones
        if not is_rigid(own, places[name], places[end])
    ]


def is_rigid(own: Skeleton, point: JointPoint, following: JointPoint) -> bool:
    """Return whether a point keeps its place in the frame of another by the tree alone."""
    is_child = following.share == 0.0 and own.parents[following.joint] == point.joint
    return following.joint == point.joint or is_child


def _unified(
    clip: Clip,
    topology: Topology,
    motion: JointMotion,
    turns: Floats,
    aimed: Sequence[tuple[int, int, Floats]],
) -> Clip:
    """Return a clip on a topology. turns (J, 4): from the files' frames to the canonical ones."""
    frames = quat.mul(motion.turns, quat.conj(turns))
    places = motion.positions
    for joint, end, direction in aimed:
        ahead = places[:, end] - places[:, joint]
        swings = canonical_rest.smallest_turns(quat.rotate(frames[:, joint], direction), ahead)
        frames[:, joint] = quat.mul(swings, frames[:, joint])
    rotations, translations = frames.copy(), places.copy()
    for joint, parent in list(enumerate(topology.parents))[1:]:
        back = quat.conj(frames[:, parent])
        rotations[:, joint] = quat.mul(back, frames[:, joint])
        translations[:, joint] = quat.rotate(back, places[:, joint] - places[:, parent])
    offsets = translations.mean(axis=0)
    offsets[0] = 0.0
    return replace(
        clip,
        skeleton=Skeleton(topology.names, topology.parents, offsets, (), np.zeros((0, 3))),
        rotations=quat.unroll(quat.normalize(rotations)),
        translations=translations,
    )


MOST_NAMED = 6
"""Joints that a note names."""
FAR = 99
"""Percentile of the distances that a note tells."""


def unify_recipe(
    clips: Sequence[Clip], files: Sequence[str], stated: StatedRoles, stretches: bool
) -> tuple[tuple[Clip, ...], list[str]]:
    """Return clips on the topology that their skeletons have in common, and notes.

    files: names by clip. stated: joints by role. stretches: whether a bone may change its length
    where a joint was left out on it. Raises TopologyError for a skeleton that lacks a role, and for
    such a change.
    """
    found = unify(clips, stated)
    if not stretches:
        _expect_rigid(found)
    return found.clips, [*_kind_notes(clips, files, found), *_lack_notes(files, found)]


def _expect_rigid(found: UnifiedClips) -> None:
    """Raise TopologyError for a joint that moves against its parent since one was left out."""
    stretch = skeleton_checks.find_stretch(found.clips)
    if stretch is None:
        return
    number = next(at for at, kind in enumerate(found.kinds) if stretch.clip in kind.clips)
    kind, places, topology = found.kinds[number], found.points[number], found.topology
    name, parent = topology.names[stretch.joint], topology.names[topology.parents[stretch.joint]]
    if is_rigid(kind.skeleton, places[parent], places[name]):
        return
    raise TopologyError(
        f"skeleton.topology: joints between {parent} and {name} are left out, since other files "
        f"lack them or no role has them, and {name} moves by up to {100 * stretch.distance:.1f} cm "
        f"against {parent}, expected at most {100 * stretch.limit:.2g} cm; say motion.bones = "
        "'stretch' to keep the mean, or leave out the files with fewer joints",
        stretch.clip,
    )


def _kind_notes(clips: Sequence[Clip], files: Sequence[str], found: UnifiedClips) -> list[str]:
    """Return the note on each kind of skeleton: joints left out, and how far the others moved."""
    names = found.topology.names
    limbs = np.array([name in LIMB_ROLES for name in names])
    notes = []
    for kind, places in zip(found.kinds, found.points, strict=True):
        gaps = np.concatenate(
            [
                _distances_to(found.clips[at], joint_motion(clips[at], places).positions)
                for at in kind.clips
            ]
        )
        limb, trunk = (100 * np.percentile(gaps[:, own], FAR) for own in (limbs, ~limbs))
        which = f"{len(kind.clips)} of {len(clips)} clips, such as {files[kind.clips[0]]}: "
        notes.append(
            f"{which}{len(kind.skeleton)} joints became {len(names)} by their roles"
            f"{_named(kind.left_out)}; {FAR} % of the joints lie within {limb:.2f} cm (limbs) and "
            f"{trunk:.2f} cm (trunk) of the files'"
        )
    return notes


def _named(left_out: Sequence[str]) -> str:
    """Return the joints that are left out as a part of a sentence."""
    more = len(left_out) - MOST_NAMED
    told = ", ".join(left_out[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
    return f", without {told}" if left_out else ""


def _distances_to(clip: Clip, positions: Floats) -> Floats:
    """Return the distances (F, J), m, of a clip's joints with mean offsets from positions."""
    translations = clip.translations.copy()
    translations[:, 1:] = translations[:, 1:].mean(axis=0)
    placed = replace(clip, translations=translations).positions()
    return np.asarray(np.linalg.norm(placed - positions, axis=-1))


def _lack_notes(files: Sequence[str], found: UnifiedClips) -> list[str]:
    """Return the note on roles that some skeletons have and others lack."""
    everyone = {role for kind in found.kinds for role in kind.joints.limbs}
    notes = []
    for role in LIMB_ROLES:
        lacking = [kind for kind in found.kinds if role not in kind.joints.limbs]
        if role in everyone and lacking:
            count = sum(len(kind.clips) for kind in lacking)
            notes.append(
                f"{role} is left out: {count} of {len(files)} clips, such as "
                f"{files[lacking[0].clips[0]]}, have no joint for it"
            )
    return notes
