"""Clips of different skeletons on one topology, with one rest pose and their own proportions.

Positions of the kept joints stay as they are: each joint takes the orientation of its file's joint,
turned by a constant of its body, and the offset that leads to it. A bone on which a joint was left
out is turned to its end, so that only its length changes. The rest pose is a T-pose that is found
from the motion, in which all frames are equal: x to the left, y up, z ahead. Two directions in a
joint's frame tell its turn. The first is the mean direction of the bone. The second tells the twist
about it: the hinge axis of elbow or knee, which is the mean of the normals of the limb's plane and
so counts bent poses most; else the mean of an axis of the parent. Both turn with the frame, so that
files in a T-pose and in an A-pose agree.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source import common_topology, skeleton_checks
from posefield_train.source.common_topology import (
    LIMB_ROLES,
    JointPoint,
    RoleJoints,
    StatedRoles,
    Topology,
    TopologyError,
)

X, Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
FOOT = np.array([0.0, -1.0, 2.0]) / np.sqrt(5.0)
"""Direction from the ankle to the ball of the foot in the T-pose."""
SHORTEST = 0.01
"""Distance below which a joint tells no direction, m."""
LEAST_BEND = 0.02
"""Least mean normal of a limb's plane that tells a hinge, as the sine of the bend: 1 degree."""
ELBOWS = ("UpperArm", "LowerArm")
KNEES = ("UpperLeg", "LowerLeg")
HINGES = {"UpperArm": "Hand", "LowerArm": "Hand", "UpperLeg": "Foot", "LowerLeg": "Foot"}


@dataclass(frozen=True)
class JointMotion:
    """Motion of a topology's joints in poses of a body.

    positions (F, J, 3), m. turns (F, J, 4): orientations of the files' joints.
    """

    positions: Floats
    turns: Floats


@dataclass(frozen=True)
class _RestAlignment:
    """Alignment of one joint after another, parents first. found (J, 4): turns so far."""

    topology: Topology
    motion: JointMotion
    found: Floats

    def turn(self, joint: int) -> Floats:
        """Return the turn (4,) of a joint."""
        name = self.topology.names[joint]
        if name == "hips":
            return _turn_between((self.across("UpperLeg", joint), X), (self.above(joint), Y))
        if name.startswith("spine"):
            return _turn_between((self.above(joint), Y), (self.across("UpperArm", joint), X))
        if name.startswith("neck"):
            return _turn_between((self.above(joint), Y), self.of_parent(joint, X))
        child, direction = limb_bone(name)
        if child not in self.topology.names:
            return _turn_between(self.of_parent(joint, X), self.of_parent(joint, Y))
        bone = self.towards(joint, self.topology.index(child)), direction
        second_axis = Y if abs(direction[0]) > 0.5 else X
        return _turn_between(bone, self.hinge(joint) or self.of_parent(joint, second_axis))

    def local(self, joint: int, vectors: Floats) -> Floats:
        """Return the mean (3,) of world vectors (F, 3) in the frame of a joint."""
        return np.asarray(quat.rotate(quat.conj(self.motion.turns[:, joint]), vectors).mean(axis=0))

    def towards(self, joint: int, target: int) -> Floats:
        """Return the mean vector (3,) from a joint to another in the former's frame."""
        positions = self.motion.positions
        return self.local(joint, positions[:, target] - positions[:, joint])

    def across(self, role: str, joint: int) -> Floats:
        """Return the mean vector from the right to the left joint of a role in a joint's frame."""
        left, right = (self.topology.index(side + role) for side in ("left", "right"))
        positions = self.motion.positions
        return self.local(joint, positions[:, left] - positions[:, right])

    def above(self, joint: int) -> Floats:
        """Return the mean vector to the first joint of the trunk that is farther up."""
        trunk = self.topology.trunk
        name = self.topology.names[joint]
        vectors = [
            self.towards(joint, self.topology.index(other))
            for other in trunk[trunk.index(name) + 1 if name in trunk else 0 :]
        ]
        return next((v for v in vectors if np.linalg.norm(v) > SHORTEST), vectors[-1])

    def of_parent(self, joint: int, axis: Floats) -> tuple[Floats, Floats]:
        """Return the mean of a canonical axis of the parent in a joint's frame, and the axis."""
        parent = self.topology.parents[joint]
        turns = quat.mul(self.motion.turns[:, parent], quat.conj(self.found[parent]))
        return self.local(joint, quat.rotate(turns, axis)), axis

    def hinge(self, joint: int) -> tuple[Floats, Floats] | None:
        """Return the mean hinge axis of an elbow or knee in a joint's frame, and its direction.

        None for other joints, and for a limb that is straight in all poses.
        """
        name = self.topology.names[joint]
        side = "left" if name.startswith("left") else "right"
        role = name.removeprefix(side)
        if role not in HINGES:
            return None
        limb = ELBOWS if role in ELBOWS else KNEES
        roles = (*limb, HINGES[role])
        first, middle, last = (
            self.motion.positions[:, self.topology.index(side + r)] for r in roles
        )
        normals = quat.cross(_units(middle - first), _units(last - middle))
        axis = self.local(joint, normals)
        if np.linalg.norm(axis) < LEAST_BEND:
            return None
        # A forearm bends ahead, a lower leg backwards.
        upright = X if limb == KNEES else (-Y if side == "left" else Y)
        return axis, upright


def limb_bone(name: str) -> tuple[str, Floats]:
    """Return the role at the end of a limb's bone, "" without one, and its direction at rest."""
    side = "left" if name.startswith("left") else "right"
    outwards = X if side == "left" else -X
    end, direction = {
        "Shoulder": ("UpperArm", outwards),
        "UpperArm": ("LowerArm", outwards),
        "LowerArm": ("Hand", outwards),
        "UpperLeg": ("LowerLeg", -Y),
        "LowerLeg": ("Foot", -Y),
        "Foot": ("Toes", FOOT),
    }.get(name.removeprefix(side), ("", X))
    return side + end if end else "", direction


def _units(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))


Directions = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]


def _turn_between(first: Directions, second: Directions) -> Floats:
    """Return the turn (4,) that brings one direction onto another, and a second one near its own.

    first, second: a direction in a joint's frame, of any length, and in the canonical frame. Where
    the second says nothing, the smallest turn of the first is taken.
    """
    local_axes, canonical_axes = (_basis(first[at], second[at]) for at in (0, 1))
    if local_axes is None or canonical_axes is None:
        return smallest_turns(first[0][None], first[1][None])[0]
    return np.asarray(quat.from_matrix(canonical_axes @ local_axes.T))


def _basis(along: Floats, second: Floats) -> Floats | None:
    """Return axes (3, 3) as columns: along, the rest of beside, and their normal; None if equal."""
    x = _units(along)
    rest = _units(second) - (_units(second) @ x) * x
    if np.linalg.norm(x) < 0.5 or np.linalg.norm(rest) < 1e-3:
        return None
    y = _units(rest)
    return np.stack([x, y, quat.cross(x, y)], axis=-1)


def smallest_turns(a: Floats, b: Floats) -> Floats:
    """Return the smallest turns (F, 4) between directions (F, 3); none between opposites."""
    start, end = _units(a), _units(b)
    halves = np.concatenate(
        [1.0 + np.sum(start * end, axis=-1, keepdims=True), quat.cross(start, end)], axis=-1
    )
    halves[np.linalg.norm(halves, axis=-1) < 1e-6] = (1.0, 0.0, 0.0, 0.0)
    return np.asarray(quat.normalize(halves))


def mean_turns(topology: Topology, motions: Sequence[JointMotion]) -> Floats:
    """Return the turns (J, 4) from a body's frames in the files to its canonical ones."""
    joined = JointMotion(
        np.concatenate([one.positions for one in motions]),
        np.concatenate([one.turns for one in motions]),
    )
    turns = np.zeros((len(topology.names), 4))
    turns[:, 0] = 1.0
    for joint in range(len(topology.names)):
        turns[joint] = _RestAlignment(topology, joined, turns).turn(joint)
    return turns


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
        used = self.joints.kept
        return tuple(name for at, name in enumerate(self.skeleton.names) if at not in used)


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
    unified = dict[int, Clip]()
    for kind, kind_points in zip(kinds, points, strict=True):
        motions = {at: joint_motion(clips[at], kind_points) for at in kind.clips}
        aimed = _aimed_bones(kind.skeleton, topology, kind_points)
        for group in _bodies(clips, kind.clips):
            # The axes of a body from poses spread over its clips.
            poses = []
            for motion in (motions[at] for at in group):
                count = len(motion.positions)
                frames = np.linspace(0, count - 1, min(count, MOST_POSES)).round().astype(int)
                picked = np.unique(frames)
                poses.append(JointMotion(motion.positions[picked], motion.turns[picked]))
            turns = mean_turns(topology, poses)
            for at in group:
                unified[at] = _unified(clips[at], topology, motions[at], turns, aimed)
    ordered = tuple(unified[at] for at in range(len(clips)))
    return UnifiedClips(ordered, topology, tuple(kinds), tuple(points))


def _find_kinds(clips: Sequence[Clip], stated: StatedRoles) -> list[SkeletonKind]:
    groups: dict[tuple[tuple[str, ...], tuple[int, ...]], list[int]] = {}
    for at, clip in enumerate(clips):
        groups.setdefault((clip.skeleton.names, clip.skeleton.parents), []).append(at)
    file_joints = {name for names, _ in groups for name in names}
    unknown = sorted({name for names in stated.values() for name in names} - file_joints)
    if unknown:
        raise TopologyError(f"skeleton.roles: no file has joint {', '.join(map(repr, unknown))}")
    kinds = []
    for indices in groups.values():
        first = clips[indices[0]].skeleton
        try:
            kinds.append(
                SkeletonKind(first, tuple(indices), common_topology.role_joints(first, stated))
            )
        except TopologyError as fault:
            raise TopologyError(str(fault), indices[0]) from fault
    return kinds


def _bodies(clips: Sequence[Clip], indices: Sequence[int]) -> list[list[int]]:
    """Return the clips of one skeleton by bodies with the same rest pose, in their order."""
    groups: list[tuple[Floats, list[int]]] = []
    for at in indices:
        offsets = clips[at].translations.mean(axis=0)[1:]
        for rest, members in groups:
            if np.linalg.norm(rest - offsets) <= SAME_REST * np.linalg.norm(rest):
                members.append(at)
                break
        else:
            groups.append((offsets, [at]))
    return [members for _, members in groups]


def joint_motion(clip: Clip, points_by_name: Mapping[str, JointPoint]) -> JointMotion:
    """Return positions and orientations of a topology's joints in a clip of a file."""
    positions, turns = skeleton.forward_kinematics(
        clip.skeleton.parents, clip.rotations, clip.translations
    )
    points = list(points_by_name.values())
    shares = np.array([point.share for point in points])[:, None]
    joints, following = (
        [getattr(point, name) for point in points] for name in ("joint", "following")
    )
    placed = positions[:, joints] + shares * (positions[:, following] - positions[:, joints])
    return JointMotion(placed, turns[:, joints])


def _aimed_bones(
    joints: Skeleton, topology: Topology, points: Mapping[str, JointPoint]
) -> list[tuple[int, int, Floats]]:
    """Return the bones on which a joint was left out: their ends, and direction (3,) at rest.

    The hips and the last joint of the spine carry several bones, and keep their orientation.
    """
    bones = [
        (name, above, Y)
        for name, above in zip(topology.trunk, topology.trunk[1:], strict=False)
        if name != f"spine{topology.spine}"
    ]
    limbs = [(name, *limb_bone(name)) for name in topology.names]
    bones += [bone for bone in limbs if bone[1] in topology.names]
    return [
        (topology.index(name), topology.index(end), direction)
        for name, end, direction in bones
        if not is_rigid(joints, points[name], points[end])
    ]


def is_rigid(joints: Skeleton, point: JointPoint, following: JointPoint) -> bool:
    """Return whether a point keeps its place in the frame of another by the tree alone."""
    is_child = following.share == 0.0 and joints.parents[following.joint] == point.joint
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
    positions = motion.positions
    for joint, end, direction in aimed:
        bones = positions[:, end] - positions[:, joint]
        swings = smallest_turns(quat.rotate(frames[:, joint], direction), bones)
        frames[:, joint] = quat.mul(swings, frames[:, joint])
    rotations, translations = frames.copy(), positions.copy()
    for joint, parent in list(enumerate(topology.parents))[1:]:
        back = quat.conj(frames[:, parent])
        rotations[:, joint] = quat.mul(back, frames[:, joint])
        translations[:, joint] = quat.rotate(back, positions[:, joint] - positions[:, parent])
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
    unified = unify(clips, stated)
    if not stretches:
        _expect_rigid(unified)
    return unified.clips, [*_kind_notes(clips, files, unified), *_lack_notes(files, unified)]


def _expect_rigid(unified: UnifiedClips) -> None:
    """Raise TopologyError for a joint that moves against its parent since one was left out."""
    stretch = skeleton_checks.find_stretch(unified.clips)
    if stretch is None:
        return
    number = next(at for at, kind in enumerate(unified.kinds) if stretch.clip in kind.clips)
    kind, points, topology = unified.kinds[number], unified.points[number], unified.topology
    name, parent = topology.names[stretch.joint], topology.names[topology.parents[stretch.joint]]
    if is_rigid(kind.skeleton, points[parent], points[name]):
        return
    raise TopologyError(
        f"skeleton.topology: joints between {parent} and {name} are left out, since other files "
        f"lack them or no role has them, and {name} moves by up to {100 * stretch.distance:.1f} cm "
        f"against {parent}, expected at most {100 * stretch.limit:.2g} cm; say motion.bones = "
        "'stretch' to keep the mean, or leave out the files with fewer joints",
        stretch.clip,
    )


def _kind_notes(clips: Sequence[Clip], files: Sequence[str], unified: UnifiedClips) -> list[str]:
    """Return the note on each kind of skeleton: joints left out, and how far the others moved."""
    names = unified.topology.names
    limbs = np.array([name in LIMB_ROLES for name in names])
    notes = []
    for kind, points in zip(unified.kinds, unified.points, strict=True):
        gaps = np.concatenate(
            [
                _distances_to(unified.clips[at], joint_motion(clips[at], points).positions)
                for at in kind.clips
            ]
        )
        limb, trunk = (100 * np.percentile(gaps[:, columns], FAR) for columns in (limbs, ~limbs))
        which = f"{len(kind.clips)} of {len(clips)} clips, such as {files[kind.clips[0]]}: "
        notes.append(
            f"{which}{len(kind.skeleton)} joints became {len(names)} by their roles"
            f"{_named(kind.left_out)}; {FAR} % of the joints lie within {limb:.2f} cm (limbs) and "
            f"{trunk:.2f} cm (trunk) of the files'"
        )
    return notes


def _named(left_out: Sequence[str]) -> str:
    more = len(left_out) - MOST_NAMED
    listed = ", ".join(left_out[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
    return f", without {listed}" if left_out else ""


def _distances_to(clip: Clip, positions: Floats) -> Floats:
    """Return the distances (F, J), m, of a clip's joints with mean offsets from positions."""
    translations = clip.translations.copy()
    translations[:, 1:] = translations[:, 1:].mean(axis=0)
    placed = replace(clip, translations=translations).positions()
    return np.asarray(np.linalg.norm(placed - positions, axis=-1))


def _lack_notes(files: Sequence[str], unified: UnifiedClips) -> list[str]:
    everyone = {role for kind in unified.kinds for role in kind.joints.limbs}
    notes = []
    for role in LIMB_ROLES:
        lacking = [kind for kind in unified.kinds if role not in kind.joints.limbs]
        if role in everyone and lacking:
            count = sum(len(kind.clips) for kind in lacking)
            notes.append(
                f"{role} is left out: {count} of {len(files)} clips, such as "
                f"{files[lacking[0].clips[0]]}, have no joint for it"
            )
    return notes
