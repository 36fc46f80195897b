"""Weights of the skin about the hips, where trunk and thighs meet.

A thigh takes over from the pelvis along its own direction: over a short way in front, where the
skin folds, and over a long one behind, where the seat is stretched when the hip bends. Weights
along the chains of bones know neither front nor back, and put the whole bend into one row of faces.
"""

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats
from posefield.encode.body.body_plan import Limb, PersonPlan
from posefield.encode.body.bone_chain import BoneChain
from posefield.encode.body.mesh_builder import MeshBuilder
from posefield.motion import blend

# Beside the hip joint, along the thigh, m: where the thigh begins to move the skin, and from where
# on it does so alone; for points ahead of the joint and for those behind it.
AHEAD, BEHIND = (-0.090, 0.140), (-0.110, 0.170)
DEPTH = 0.09
"""Distance ahead of or behind the joint, m, from which on these hold; in between they are mixed."""
MIDDLE = (-0.025, 0.065)
"""Distances from the middle to a leg's side, m, over which the leg begins to move the skin."""


def set_weights(found: Floats, mesh: MeshBuilder, plan: PersonPlan, trunk: BoneChain) -> None:
    """Set the weights (P, J) of points about the hips in place; the other points keep theirs."""
    points: Floats = np.array(mesh.points)
    of_trunk = np.array([chain is trunk for chain in mesh.chains])
    shares = []
    for leg, side in zip(plan.legs, (1.0, -1.0), strict=True):
        own = np.array([chain is leg.chain for chain in mesh.chains])
        share = np.where(own | of_trunk, _thigh_shares(points, plan, leg, side), 0.0)
        shares.append((leg, own, share))
    left, right = (share for _, _, share in shares)
    taken = np.maximum(left + right, 1.0)
    for leg, own, share in shares:
        _set_leg(found, leg, own, share / taken)
    found[of_trunk] *= (1.0 - ((left + right) / taken)[of_trunk])[:, None]
    for leg, _, share in shares:
        found[of_trunk, _thigh(leg)] += (share / taken)[of_trunk]


def _thigh(leg: Limb) -> int:
    return leg.chain.joints[leg.root]


def _thigh_shares(points: Floats, plan: PersonPlan, leg: Limb, side: float) -> Floats:
    """Return the share (P,) by which a thigh moves points of the trunk and of its leg."""
    hip = leg.point(leg.root)
    along = leg.point(leg.middle) - hip
    along /= np.linalg.norm(along)
    off = (points - hip) / plan.scale
    back = _smooth((DEPTH - off @ plan.front) / (2.0 * DEPTH))
    low, high = (
        (1.0 - back) * ahead + back * behind for ahead, behind in zip(AHEAD, BEHIND, strict=True)
    )
    middle = 0.5 * (plan.legs[0].point(plan.legs[0].root) + plan.legs[1].point(plan.legs[1].root))
    beside = side * ((points - middle) @ plan.side) / plan.scale
    own_side = _smooth((beside - MIDDLE[0]) / (MIDDLE[1] - MIDDLE[0]))
    return _smooth((off @ along - low) / (high - low)) * own_side


def _set_leg(found: Floats, leg: Limb, own: npt.NDArray[np.bool_], share: Floats) -> None:
    """Divide what pelvis and thigh move of a leg's points anew."""
    joints = leg.chain.joints
    above, thigh = list(dict.fromkeys(joints[: leg.root])), _thigh(leg)
    whole = found[own][:, [*above, thigh]].sum(axis=1)
    kept = found[own]
    kept[:, above] = 0.0
    kept[:, thigh] = whole * share[own]
    kept[:, leg.chain.anchors[0]] += whole * (1.0 - share[own])
    found[own] = kept


def _smooth(share: Floats) -> Floats:
    return blend.smoothstep(np.clip(share, 0.0, 1.0))
