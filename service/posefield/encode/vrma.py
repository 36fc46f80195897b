"""VRM animations: binary glTF with `VRMC_vrm_animation`, which moves any VRM avatar.

Readers turn rotations against the rest pose of the file's nodes, which has to be the T-pose of VRM:
upright, facing +Z, straight arms along X, straight legs down, feet flat and forward. Rotations of
a motion are against its own rest, whatever that is; so the nodes rest as the motion's joints are
turned in a T-pose, and the motion stays as it is. The nodes are the humanoid bones alone, each
below the nearest one; joints between them are part of the bones below.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import UP, Bones, Floats, JointRotations, Vector
from posefield.encode import glb
from posefield.encode.character import Convention
from posefield.encode.glb import GlbBuffer
from posefield.feet.limbs import shortest_turn
from posefield.motion import clip as clips
from posefield.motion import joint_roles, quat, skeleton
from posefield.motion.curves import CurveValues
from posefield.motion.skeleton import Skeleton, joint_chain
from posefield.question.results import SampledClip
from posefield.rigs.rig import facing_of
from posefield.roles import joint_recognition

EXTENSION = "VRMC_vrm_animation"
SIDES = {"left": np.array([1.0, 0.0, 0.0]), "right": np.array([-1.0, 0.0, 0.0])}
"""Direction of the arm of each side in the T-pose."""
NEEDED = (
    "hips",
    "spine",
    "head",
    *(
        side + bone
        for side in SIDES
        for bone in ("UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot")
    ),
)
"""Bones that each VRM humanoid has."""
EXPRESSIONS = frozenset(
    "happy angry sad relaxed surprised neutral aa ih ou ee oh blink blinkLeft blinkRight".split()
)
"""Expressions that VRM defines, but for those of the gaze; others are custom ones."""
UPRIGHT = 0.7
"""Vertical part of the directions of trunk and legs at rest from which on a body stands."""


def humanoid(joints: Skeleton, roles: Mapping[str, int]) -> dict[str, int]:
    """Return the joint of each humanoid bone, hips first, parents before children.

    roles: of a motion's joints; recognised by their names where it has none. Raises InvalidField
    for a skeleton without the bones that VRM needs, and for one that does not stand at rest.
    """
    if not roles:
        recognised = joint_recognition.roles_of(joints.names, joints.parents)
        roles = joint_roles.role_joints(joints, recognised)
    if missing := [role for role in NEEDED if role not in roles]:
        raise InvalidField(
            "format",
            f"'vrma', but this model has no joint for {', '.join(missing)}; expected a body with "
            "all humanoid bones of VRM, by [roles] of its recipe or by the names of its joints",
        )
    if "upperChest" in roles and "chest" not in roles:
        roles = {"chest" if role == "upperChest" else role: j for role, j in roles.items()}
    bones = dict(sorted(roles.items(), key=lambda bone: (bone[0] != "hips", bone[1])))
    rest = joints.at_rest(joints.offsets)
    ways = [rest[bones["head"]] - rest[bones["hips"]]]
    ways += [rest[bones[side + "UpperLeg"]] - rest[bones[side + "Foot"]] for side in SIDES]
    if min(float(way @ UP) / max(float(np.linalg.norm(way)), 1e-9) for way in ways) < UPRIGHT:
        raise InvalidField(
            "format",
            "'vrma', but this model's skeleton does not stand upright at rest; expected one that "
            "does, or glb for a character of yours",
        )
    return bones


def t_pose(bones: Mapping[str, int], rest: Bones) -> dict[str, Floats]:
    """Return the orientation (4,) of each bone in a T-pose, against the rest of the motion.

    rest (J, 3): positions of the joints at rest, m.
    """
    across = rest[bones["leftUpperLeg"]] - rest[bones["rightUpperLeg"]]
    heading = quat.from_axis_angle(UP, np.array(-facing_of(across)))
    turns = dict.fromkeys(bones, heading)

    def straighten(upper: str, lower: str, direction: Vector) -> None:
        bone = quat.rotate(heading, rest[bones[lower]] - rest[bones[upper]])
        turns[upper] = quat.mul(shortest_turn(bone, direction), heading)

    for side, outwards in SIDES.items():
        straighten(side + "UpperLeg", side + "LowerLeg", -UP)
        straighten(side + "LowerLeg", side + "Foot", -UP)
        straighten(side + "UpperArm", side + "LowerArm", outwards)
        straighten(side + "LowerArm", side + "Hand", outwards)
        turns[side + "Hand"] = turns[side + "LowerArm"]
        if side + "Toes" in bones:
            toes = quat.rotate(heading, rest[bones[side + "Toes"]] - rest[bones[side + "Foot"]])
            outwards_angle = np.array(-np.arctan2(toes[0], toes[2]))
            forward = quat.mul(quat.from_axis_angle(UP, outwards_angle), heading)
            turns[side + "Foot"] = turns[side + "Toes"] = forward
    return turns


def vrma(answer: SampledClip, convention: Convention) -> bytes:
    """Return the VRM animation of a clip, with the provenance in `asset.extras.posefield`.

    Raises InvalidField as `humanoid` does.
    """
    clip, store = answer.clip, GlbBuffer()
    bones = humanoid(clip.skeleton, clip.roles)
    joints, names = list(bones.values()), list(bones)
    arms = clip.translations[0].copy()
    arms[0] = clip.skeleton.offsets[0]
    rest = clip.skeleton.at_rest(arms)
    turns = t_pose(bones, rest)
    above = [_above(clip.skeleton, bones, joint) for joint in joints]
    offsets = np.array([rest[j] - rest[joints[p]] for j, p in zip(joints, above, strict=True)])
    resting = np.stack([turns[name] for name in names])
    offsets[0] = _hips_height(clip.skeleton, arms, dict(zip(joints, resting, strict=True))) * UP
    parents = (-1, *above[1:])
    positions, world = skeleton.forward_kinematics(
        clip.skeleton.parents, clip.rotations, clip.translations
    )
    local = world[:, joints].copy()
    local[:, 1:] = quat.mul(quat.conj(world[:, [joints[p] for p in above[1:]]]), local[:, 1:])
    none = Skeleton(tuple(names), parents, offsets, (), np.empty((0, 3)))
    moved = clips.assemble(none, local, positions[:, joints[0]], offsets, clip.rate)
    document = {
        "extensionsUsed": [EXTENSION],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": _nodes(none, resting),
        **glb.animation(store, answer, moved, offsets),
    }
    human_bones = {name: {"node": node} for node, name in enumerate(names)}
    extension: dict[str, Any] = {"specVersion": "1.0", "humanoid": {"humanBones": human_bones}}
    if clip.curves is not None:
        extension["expressions"] = _expressions(document, store, clip.curves)
    return glb.container({**document, "extensions": {EXTENSION: extension}}, store)


def _above(joints: Skeleton, bones: Mapping[str, int], joint: int) -> int:
    """Return the number of the bone above a joint, among the bones; 0 for the hips, the first."""
    numbers = {bone: number for number, bone in enumerate(bones.values())}
    chain = joint_chain(joints.parents, joint)[:-1]
    return next((numbers[above] for above in reversed(chain) if above in numbers), 0)


def _hips_height(joints: Skeleton, arms: Bones, turns: Mapping[int, Floats]) -> float:
    """Return the height of the hips in the T-pose, m, in which feet are as low as at rest.

    arms (J, 3): offsets from the parents, m. turns: orientations (4,) of joints that are bones.
    """
    hips = next(iter(turns))
    heights = []
    for pose in ({}, turns):
        local: JointRotations = np.tile(quat.IDENTITY, (len(joints), 1))
        world = local.copy()
        for joint, parent in enumerate(joints.parents):
            above = world[parent] if parent >= 0 else quat.IDENTITY
            world[joint] = pose.get(joint, above)
            local[joint] = quat.mul(quat.conj(above), world[joint])
        positions = skeleton.positions(joints.parents, local, arms)
        owners = list(joints.tip_joints)
        tips = positions[owners] + quat.rotate(world[owners], joints.tip_offsets)
        lowest = min(positions[:, 1].min(), tips[:, 1].min(initial=np.inf))
        heights.append((float(positions[hips, 1]), float(lowest)))
    (_, floor), (height, lowest) = heights
    return height + floor - lowest


def _nodes(joints: Skeleton, resting: JointRotations) -> list[dict[str, Any]]:
    """Return the nodes of bones in the T-pose. resting (J, 4): their orientations in the world."""
    nodes: list[dict[str, Any]] = []
    for joint, parent in enumerate(joints.parents):
        turn = resting[joint]
        if parent >= 0:
            turn = quat.mul(quat.conj(resting[parent]), turn)
            nodes[parent].setdefault("children", []).append(joint)
        node = {
            "name": joints.names[joint],
            "translation": joints.offsets[joint].tolist(),
            "rotation": turn[[1, 2, 3, 0]].tolist(),
        }
        nodes.append(node)
    return nodes


def _expressions(
    document: dict[str, Any], store: GlbBuffer, curves: CurveValues
) -> dict[str, dict[str, Any]]:
    """Add a node for each curve, whose x is its weight, and return the expressions' nodes."""
    expressions: dict[str, dict[str, Any]] = {}
    nodes, (animation,) = document["nodes"], document["animations"]
    for name, values in zip(curves.names, curves.values.T, strict=True):
        track = np.zeros((len(values), 3), np.float32)
        track[:, 0] = values
        output = store.add(track, "VEC3")
        kind = "preset" if name in EXPRESSIONS else "custom"
        expressions.setdefault(kind, {})[name] = {"node": len(nodes)}
        animation["channels"].append(
            {
                "sampler": len(animation["samplers"]),
                "target": {"node": len(nodes), "path": "translation"},
            }
        )
        animation["samplers"].append({"input": animation["samplers"][0]["input"], "output": output})
        document["scenes"][0]["nodes"].append(len(nodes))
        nodes.append({"name": name})
    return expressions
