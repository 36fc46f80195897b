"""Clips of different skeletons on one topology, with one rest pose and their own proportions.

Positions of the kept joints stay as they are: each joint takes the orientation of its file's joint,
turned by a constant, and the offset that leads to it. A bone on which a joint was left out is
turned to its end, so that only its length changes. Design and figures: decision record 0061.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source.topology import canonical_rest, common_topology, role_joints
from posefield_train.source.topology.canonical_rest import JointMotion
from posefield_train.source.topology.common_topology import JointPoint, Topology
from posefield_train.source.topology.role_joints import RoleJoints, StatedRoles, TopologyError

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
    lengths = [_bone_lengths(clips[kind.clips[0]]) for kind in kinds]
    bodies = [kind.joints for kind in kinds]
    topology = common_topology.common_topology(bodies)
    points = common_topology.joint_points(bodies, lengths, topology)
    found = dict[int, Clip]()
    for kind, places in zip(kinds, points, strict=True):
        motions = {at: joint_motion(clips[at], places) for at in kind.clips}
        aimed = _aimed_bones(kind.skeleton, topology, places)
        for group in _bodies(clips, kind.clips):
            turns = _body_turns(topology, [motions[at] for at in group])
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
            found.append(SkeletonKind(first, tuple(own), role_joints.role_joints(first, stated)))
        except TopologyError as fault:
            raise TopologyError(str(fault), own[0]) from fault
    return found


def _bone_lengths(clip: Clip) -> Floats:
    return np.asarray(np.linalg.norm(clip.translations.mean(axis=0), axis=-1))


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


def _body_turns(topology: Topology, motions: Sequence[JointMotion]) -> Floats:
    """Return the turns (J, 4) of a body to the T-pose, from poses spread over its clips."""
    picked = []
    for motion in motions:
        count = len(motion.positions)
        frames = np.unique(np.linspace(0, count - 1, min(count, MOST_POSES)).round().astype(int))
        picked.append(JointMotion(motion.positions[frames], motion.turns[frames]))
    return canonical_rest.mean_turns(topology, picked)


@dataclass(frozen=True)
class _AimedBone:
    """A bone on which a joint was left out: joints at its ends, and its direction at rest (3,)."""

    joint: int
    end: int
    direction: Floats


def _aimed_bones(
    own: Skeleton, topology: Topology, places: Mapping[str, JointPoint]
) -> list[_AimedBone]:
    """Return the bones whose ends move in the frames of the files' joints.

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
        _AimedBone(topology.index(name), topology.index(end), direction)
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
    aimed: Sequence[_AimedBone],
) -> Clip:
    """Return a clip on a topology. turns (J, 4): from the files' frames to the canonical ones."""
    frames = quat.mul(motion.turns, quat.conj(turns))
    places = motion.positions
    for bone in aimed:
        ahead = places[:, bone.end] - places[:, bone.joint]
        own = quat.rotate(frames[:, bone.joint], bone.direction)
        swings = canonical_rest.smallest_turns(own, ahead)
        frames[:, bone.joint] = quat.mul(swings, frames[:, bone.joint])
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
