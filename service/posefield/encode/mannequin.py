"""Mannequin of a human rig: a stored skin, fitted to its bones by the roles of its joints.

`mannequin.npz` was made once, for a rig of 1.75 m, by the generator of version 0.3.0 (rings of
points along the bones, welded, with smoothed weights). Its parts are the trunk and the bones of the
limbs. Each point lies where its parts carry it: a bone's part is turned, stretched along the bone
and scaled across it, and the trunk is stretched between hips, shoulders and head.

points (P, 3): m, to the left, up and ahead of the middle of the hips. counts, corners: of the
faces; coarse (T, 3): fewer triangles on the same points. parts, weights (P, 3): the parts that move
each point, and their weights out of 255. bone, share (P,): the part with which a point moves where
bones have other lengths, and its share of the way along it; its height, m, on the trunk. ends
(19, 2, 3): near and far end of each part, m.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, Indices
from posefield.encode import skinned_mesh
from posefield.encode.skinned_mesh import FULL_WEIGHT, Bytes, Integers, SkinnedMesh
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield.roles import joint_recognition

LIMB = (
    "Shoulder", "UpperArm", "LowerArm", "Hand", "Fingers", "UpperLeg", "LowerLeg", "Foot", "Toes"
)  # fmt: skip
SIDES = ("left", "right")
PARTS = ("trunk", *(side + part for side in SIDES for part in LIMB))
NEEDED = ("UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot")
"""Roles that a human rig has on both sides, beside hips and head."""
INFLUENCES = 4
# Heights beside a person of the stored size, m: of the head joint above the shoulders, at least, of
# the skin that the joint of the arms moves above them, of the sole below the toe joint and its tip,
# and below the ankle of a foot without toes.
CHIN, NECK, SOLE, TIP, ANKLE = 0.157, 0.055, 0.024, 0.002, 0.075
HAND, FINGERTIP = 0.185, 0.02
"""Length of a hand at least, and of the skin beyond its last bone, m."""
BELOW, HEAD = 0.12, 0.18
"""Lengths of the skin below the hips and above the head joint, m."""
SOFTNESS, SHORTEST = 1.0, 0.03
"""Half of the height over which two joints of the trunk both move the skin: as a share of the
shorter bone, and at least, m."""


@cache
def stored_mesh() -> Mapping[str, npt.NDArray[Any]]:
    """Return the arrays of the stored skin."""
    with files("posefield.encode").joinpath("mannequin.npz").open("rb") as file:
        return dict(np.load(file))


class _Fit(NamedTuple):
    """Joints and ends of the parts of a rig.

    joints (19,): the joint that moves each part; the hips for the trunk. anchors (19, 2): ends of
    each part, as joints or, after all joints, tips. bone_ends (19, 2, 3): m, to the left, up and
    ahead of the middle of the hips. scale: size beside the stored rig, by the length of the legs.
    spine: joints from the hips to the head. arms: index in the spine of the joint that holds the
    arms. crown: height of the end of the head, m.
    """

    joints: Indices
    anchors: Indices
    bone_ends: Floats
    scale: float
    spine: list[int]
    arms: int
    crown: float


def mannequin(skeleton: Skeleton) -> SkinnedMesh | None:
    """Return the mannequin of a skeleton; None if it has not the roles or the form of a person."""
    roles = joint_recognition.roles_of(skeleton.names, skeleton.parents)
    if not {"hips", "head", *(side + n for side in SIDES for n in NEEDED)} <= set(roles):
        return None
    index = {name: joint for joint, name in enumerate(skeleton.names)}
    positions = skeleton.at_rest(skeleton.offsets)
    positions = np.concatenate(
        [positions, positions[list(skeleton.tip_joints)] + skeleton.tip_offsets]
    )
    joints = {role: index[name] for role, name in roles.items()}
    if not all(joints["hips"] in _path(skeleton.parents, joint) for joint in joints.values()):
        return None
    hips = positions[[joints["leftUpperLeg"], joints["rightUpperLeg"]]]
    side = (hips[0] - hips[1]) * (1.0, 0.0, 1.0)
    if not side.any():
        return None
    side /= np.linalg.norm(side)
    axes = np.stack([side, [0.0, 1.0, 0.0], np.cross(side, [0.0, 1.0, 0.0])])
    middle = hips.mean(axis=0)
    fit = _fit(skeleton, joints, (positions - middle) @ axes.T)
    if not _upright(fit.bone_ends):
        return None
    stored = stored_mesh()
    fitted = _fitted_points(stored, fit)
    points = fitted @ axes + middle
    marks = np.array([(positions[joint] - middle) @ axes[1] for joint in fit.spine])
    movers, weights = _weights(stored, fit, len(skeleton), fitted[:, 1], marks)
    counts, corners = stored["counts"].astype(np.int32), stored["corners"].astype(np.int32)
    return SkinnedMesh(
        points.astype(np.float32),
        skinned_mesh.vertex_normals(points, skinned_mesh.triangles(counts, corners)),
        *skinned_mesh.distinct_places(*_places(stored, fit, marks)),
        movers,
        weights,
        counts,
        corners,
        np.zeros(len(points), np.int32),
        stored["coarse"].astype(np.int32),
    )


def _fit(skeleton: Skeleton, roles: Mapping[str, int], positions: Floats) -> _Fit:
    """Return the parts of a rig with joints and tips at places (J + E, 3)."""
    above = (*skeleton.parents, *skeleton.tip_joints)

    def furthest(joint: int) -> list[int]:
        """Return the path from a joint to the joint or tip below it that is furthest from it."""
        below = [[joint]]
        for path in below:
            below += [[*path, point] for point, parent in enumerate(above) if parent == path[-1]]
        return max(
            below, key=lambda path: float(np.linalg.norm(positions[path[-1]] - positions[joint]))
        )

    spine = _path(above, roles["head"])[::-1]
    spine = spine[spine.index(roles["hips"]) :]
    joints_of_parts = {"trunk": (roles["hips"], roles["hips"], furthest(roles["head"])[-1])}
    for side in SIDES:
        upper, lower, hand = (roles[side + name] for name in NEEDED[:3])
        thigh, shin, foot = (roles[side + name] for name in NEEDED[3:])
        fingers, tip = furthest(hand), furthest(foot)[-1]
        toes = roles.get(f"{side}Toes", tip)
        bent = [
            joint
            for joint in fingers[1:]
            if joint < len(skeleton) and any(abs(positions[joint] - positions[hand]) > 1e-3)
        ]
        joints_of_parts |= {
            f"{side}Shoulder": (above[upper], above[upper], upper),
            f"{side}UpperArm": (upper, upper, lower),
            f"{side}LowerArm": (lower, lower, hand),
            f"{side}Hand": (hand, hand, fingers[-1]),
            f"{side}Fingers": (bent[0] if bent else hand, hand, fingers[-1]),
            f"{side}UpperLeg": (thigh, thigh, shin),
            f"{side}LowerLeg": (shin, shin, foot),
            f"{side}Foot": (foot, foot, toes),
            f"{side}Toes": (roles.get(f"{side}Toes", foot), toes, tip),
        }
    rows = np.array([joints_of_parts[part] for part in PARTS])
    bone_ends = positions[rows[:, 1:]]
    holder = max(at for at, joint in enumerate(spine) if joint in _path(above, rows[2, 0]))
    scale = _leg_length(bone_ends) / _leg_length(stored_mesh()["ends"])
    crown = float(bone_ends[0, 1, 1])
    bone_ends[0, 1] = positions[roles["head"]]
    return _Fit(rows[:, 0], rows[:, 1:], bone_ends, scale, spine, holder, crown)


def _path(above: Sequence[int], point: int) -> list[int]:
    """Return a point and its ancestors, up to the root."""
    path = [point]
    while above[path[-1]] >= 0:
        path.append(above[path[-1]])
    return path


def _limb(bone_ends: Floats, side: str, *segments: str) -> Floats:
    """Return the ends (K, 2, 3) of some parts of a side."""
    limb: Floats = bone_ends[[PARTS.index(side + part) for part in segments]]
    return limb


def _leg_length(bone_ends: Floats) -> float:
    legs = np.stack([_limb(bone_ends, side, "UpperLeg", "LowerLeg") for side in SIDES])
    return float(np.linalg.norm(legs[:, :, 1] - legs[:, :, 0], axis=-1).sum() / 2.0)


def _landmarks(bone_ends: Floats) -> tuple[Floats, Floats]:
    """Return the middles (2, 3) of hips and shoulders, and half their widths (2,), m."""
    pairs = np.stack([_limb(bone_ends, side, "UpperLeg", "UpperArm")[:, 0] for side in SIDES])
    return pairs.mean(axis=0), 0.5 * (pairs[0] - pairs[1])[:, 0]


def _upright(bone_ends: Floats) -> bool:
    """Return whether a rig stands as people do: head above arms above hips above ankles."""
    leg_length = _leg_length(bone_ends)
    (_, shoulders), widths = _landmarks(bone_ends)
    ankles = np.mean([_limb(bone_ends, side, "Foot")[0, 0] for side in SIDES], axis=0)
    arms = [np.ptp(_limb(bone_ends, side, "UpperArm", "LowerArm"), axis=1) for side in SIDES]
    return bool(
        -ankles[1] > 0.7 * leg_length
        and shoulders[1] > 0.3 * leg_length
        and bone_ends[0, 1, 1] - shoulders[1] > -0.1 * leg_length
        and widths.min() > 0.02 * leg_length
        and min(float(np.linalg.norm(arm, axis=-1).sum()) for arm in arms) > 0.3 * leg_length
    )


def _fitted_points(stored: Mapping[str, Any], fit: _Fit) -> Floats:
    """Return the points (P, 3) as the parts carry them, m, in the axes of the parts' ends."""
    points, stored_ends = stored["points"].astype(float), stored["ends"].astype(float)
    carried = np.empty((len(PARTS), *points.shape))
    for part, name in enumerate(PARTS):
        if name == "trunk" or name.endswith("Shoulder"):
            carried[part] = _on_trunk(points, stored_ends, fit)
        elif name.endswith(("Foot", "Toes")):
            foot = PARTS.index(f"{name[:-4]}Foot")
            carried[part] = _on_foot(
                points, stored_ends[foot : foot + 2], fit.bone_ends[foot : foot + 2], fit
            )
        else:
            is_hand = name.endswith(("Hand", "Fingers"))
            carried[part] = _on_bone(
                points, stored_ends[part], fit.bone_ends[part], fit.scale, is_hand
            )
    rows = np.arange(len(points))
    shares = stored["weights"].astype(float)[..., None] / FULL_WEIGHT
    points_of_rows: Floats = np.sum(shares * carried[stored["parts"], rows[:, None]], axis=1)
    # The shin has no part in the feet, so that their soles are flat.
    feet = [part for part, name in enumerate(PARTS) if name.endswith(("Foot", "Toes"))]
    standing = np.isin(stored["bone"], feet)
    points_of_rows[standing] = carried[stored["bone"], rows][standing]
    return points_of_rows


def _on_bone(points: Floats, stored: Floats, bone: Floats, scale: float, is_hand: bool) -> Floats:
    """Return points turned and stretched with a bone, and scaled across it."""
    stored_direction, direction = stored[1] - stored[0], bone[1] - bone[0]
    stored_length, length = (
        float(np.linalg.norm(stored_direction)),
        float(np.linalg.norm(direction)),
    )
    stored_direction /= stored_length
    direction = direction / length if length > 0.0 else stored_direction
    if is_hand:
        stored_length, length = (
            stored_length + FINGERTIP,
            max(HAND * scale, length + FINGERTIP * scale),
        )
    offsets = points - stored[0]
    along = offsets @ stored_direction
    across = scale * (offsets - along[:, None] * stored_direction)
    # The shortest turn from one direction to the other.
    turn = np.cross(stored_direction, direction)
    once = np.cross(turn, across)
    turned = (
        across + once + np.cross(turn, once) / max(1.0 + float(stored_direction @ direction), 1e-9)
    )
    fitted: Floats = bone[0] + (length / stored_length) * along[:, None] * direction + turned
    return fitted


def _on_trunk(points: Floats, stored: Floats, fit: _Fit) -> Floats:
    """Return points stretched between hips, shoulders and head, and widened with them."""
    (stored_middles, stored_widths), (middles, widths) = (
        _landmarks(stored),
        _landmarks(fit.bone_ends),
    )
    head, scale = fit.bone_ends[0, 1].copy(), fit.scale
    head[1] = max(head[1], middles[1, 1] + scale * CHIN)
    before, after = (
        np.vstack([some, top]) for some, top in ((stored_middles, stored[0, 1]), (middles, head))
    )
    x, y, z = points.T
    low, high = before[0, 1], before[2, 1]
    height = np.interp(y, before[:, 1], after[:, 1])
    height += scale * (np.minimum(y - low, 0.0) + np.maximum(y - high, 0.0))
    centres = [
        np.interp(y, before[:, 1], some[:, axis]) for axis in (0, 2) for some in (before, after)
    ]
    waist = 0.5 * (before[0, 1] + before[1, 1])
    rates = widths / stored_widths
    widening = np.interp(y, [low, waist, before[1, 1], high], [rates[0], scale, rates[1], scale])
    fitted: Floats = np.stack(
        [centres[1] + widening * (x - centres[0]), height, centres[3] + scale * (z - centres[2])],
        axis=-1,
    )
    return fitted


def _on_foot(points: Floats, stored: Floats, bone_ends: Floats, fit: _Fit) -> Floats:
    """Return points of a flat foot; stored, bone_ends (2, 2, 3): of foot and toes, m."""
    scale = fit.scale
    (ankle, ball), (_, tip) = bone_ends
    stored_ankle, stored_ball = stored[0]
    toe_heights = [ball[1] - scale * SOLE, tip[1] - scale * TIP] if np.any(ball != ankle) else []
    sole = min(toe_heights, default=ankle[1] - scale * ANKLE)
    stored_sole = min(stored_ball[1] - SOLE, stored[1, 1, 1] - TIP)
    x, y, z = points.T
    length, stored_length = ball[2] - ankle[2], stored_ball[2] - stored_ankle[2]
    share = np.clip((z - stored_ankle[2]) / stored_length, 0.0, 1.0)
    stretch = length / stored_length if length > 0.3 * scale * stored_length else scale
    sideways = share * (
        ball[0] - ankle[0] if toe_heights else scale * (stored_ball[0] - stored_ankle[0])
    )
    fitted: Floats = np.stack(
        [
            ankle[0]
            + sideways
            + scale * (x - stored_ankle[0] - share * (stored_ball[0] - stored_ankle[0])),
            sole + (y - stored_sole) * (ankle[1] - sole) / (stored_ankle[1] - stored_sole),
            ankle[2]
            + np.where(share < 1.0, stretch, scale) * (z - stored_ankle[2])
            + np.where(share < 1.0, 0.0, (stretch - scale) * stored_length),
        ],
        axis=-1,
    )
    return fitted


def _spine_marks(fit: _Fit, marks: Floats) -> Floats:
    """Return the heights (K,) from which on the joints of the spine move the skin, m.

    The joint that holds the arms moves the shoulders, although the neck may begin below them.
    """
    shoulders = _landmarks(fit.bone_ends)[0][1, 1]
    raised = marks.copy()
    raised[fit.arms + 1 :] = np.maximum(raised[fit.arms + 1 :], shoulders + fit.scale * NECK)
    return np.maximum.accumulate(raised)


def _weights(
    stored: Mapping[str, Any], fit: _Fit, joints: int, heights: Floats, marks: Floats
) -> tuple[Integers, Bytes]:
    """Return the joints (P, 4) that move each point, heaviest first, and their weights.

    heights (P,): of the points, m; marks: of the joints of the spine, which share what the trunk
    moves by height. The weights of a point sum to FULL_WEIGHT.
    """
    rows = np.arange(len(heights))
    part_weights = np.zeros((len(heights), len(PARTS)))
    np.add.at(part_weights, (rows[:, None], stored["parts"]), stored["weights"] / FULL_WEIGHT)
    joint_weights = np.zeros((len(heights), joints))
    np.add.at(joint_weights, (rows[:, None], fit.joints[None, 1:]), part_weights[:, 1:])
    marks = _spine_marks(fit, marks)
    gaps = np.diff([*marks, marks[-1] + HEAD * fit.scale])
    gaps[0] += BELOW * fit.scale
    half = np.maximum(SOFTNESS * np.minimum(gaps[:-1], gaps[1:]), SHORTEST * fit.scale)
    shares = 0.5 + 0.5 * (heights[:, None] - marks[1:]) / half
    passed = np.minimum.accumulate(quat.smoothstep(np.clip(shares, 0.0, 1.0)), axis=1)
    passed = np.pad(passed, ((0, 0), (1, 1)), constant_values=((0, 0), (1, 0)))
    np.add.at(
        joint_weights,
        (rows[:, None], np.array(fit.spine)),
        part_weights[:, :1] * -np.diff(passed, axis=1),
    )
    movers = np.argsort(-joint_weights, axis=1, kind="stable")[:, :INFLUENCES].astype(np.int32)
    shares_of_movers = np.take_along_axis(joint_weights, movers, axis=1)
    shares_of_movers /= shares_of_movers.sum(axis=1, keepdims=True)
    rounded = np.floor(FULL_WEIGHT * shares_of_movers + 1e-9).astype(np.int64)
    rounded[:, 0] += FULL_WEIGHT - rounded.sum(axis=1)
    movers[rounded == 0] = 0
    return movers, rounded.astype(np.uint8)


def _places(stored: Mapping[str, Any], fit: _Fit, marks: Floats) -> tuple[Integers, Floats]:
    """Return the anchors (P, 2) between which points lie, and their share of the way (P,)."""
    anchors, shares = fit.anchors[stored["bone"]].copy(), stored["share"].astype(float)
    trunk = np.flatnonzero(stored["bone"] == 0)
    level = np.zeros((len(trunk), 3))
    level[:, 1] = shares[trunk]
    heights = _on_trunk(level, stored["ends"].astype(float), fit)[:, 1]
    path = np.array([*fit.spine, fit.anchors[0, 1]])
    spine_and_crown = np.append(_spine_marks(fit, marks), fit.crown)
    first = np.clip(np.searchsorted(spine_and_crown, heights, "right") - 1, 0, len(path) - 2)
    anchors[trunk] = np.stack([path[first], path[first + 1]], axis=-1)
    lengths = np.maximum(spine_and_crown[first + 1] - spine_and_crown[first], 1e-6)
    shares[trunk] = np.clip((heights - spine_and_crown[first]) / lengths, 0.0, 1.0)
    return anchors.astype(np.int32), shares
