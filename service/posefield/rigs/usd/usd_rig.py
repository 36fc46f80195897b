"""Joints at rest of the one skeleton of a USD file."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import UsdGeom, UsdSkel

from posefield.common.units import UpAxis
from posefield.rigs.joints.rest_joints import MAX_JOINTS, OuterTransform, RestJoints
from posefield.rigs.usd import usd_stage
from posefield.rigs.usd.skel_joints import SkelJoints
from posefield.rigs.usd.usd_stage import SkelStage

SHOWN = 20
"""Skeletons that a message lists."""


@dataclass(frozen=True)
class UsdRig:
    """Joints of a USD file. paths: tokens of its `joints`. prim: path of its Skeleton."""

    rest: RestJoints
    paths: tuple[str, ...]
    prim: str
    notes: tuple[str, ...]


def read(path: Path, source: str) -> UsdRig:
    """Return the joints of a .usd, .usda, .usdc or .usdz file.

    source: name of the file in messages. Raises MotionFileError for a file without a skeleton or
    with several, and for a skeleton whose prim moves over time.
    """
    opened = usd_stage.open_stage(path, source)
    joints = _only_skeleton(opened)
    moving = joints.moving_parents()
    if moving:
        raise opened.error(
            f"{moving[0].GetPath()} moves over time, expected a skeleton that stands still: its "
            "joints move it"
        )
    names, parents = joints.tree()
    if len(names) > MAX_JOINTS:
        raise opened.error(f"found {len(names)} joints, expected at most {MAX_JOINTS}")
    turns, places = joints.rest(parents)
    local = np.array(joints.query.ComputeJointLocalTransforms(0.0, atRest=True), float)
    sizes = np.stack([joints.decomposed(matrix)[2] for matrix in local])
    outer = OuterTransform(*(part[0] for part in joints.world(np.zeros(1))))
    stage = opened.stage
    up: UpAxis = "z" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else "y"
    unit = float(UsdGeom.GetStageMetersPerUnit(stage))
    rest = RestJoints(source, names, parents, turns, places, sizes, outer, unit, up)
    paths = tuple(str(own) for own in joints.query.GetJointOrder())
    return UsdRig(rest, paths, str(joints.prim.GetPath()), _notes(opened, unit))


def _only_skeleton(opened: SkelStage) -> SkelJoints:
    skeletons = opened.prims(UsdSkel.Skeleton)
    if not skeletons:
        raise opened.error("found no Skeleton, expected a SkelRoot with one")
    if len(skeletons) > 1:
        paths = ", ".join(str(prim.GetPath()) for prim in skeletons[:SHOWN])
        raise opened.error(
            f"found {len(skeletons)} skeletons ({paths}), expected one: export each character alone"
        )
    (prim,) = skeletons
    query = opened.cache.GetSkelQuery(UsdSkel.Skeleton(prim))
    if not query:
        raise opened.error(f"skeleton {prim.GetPath()} is not valid: {usd_stage.fault_of(prim)}")
    return SkelJoints(opened.source, prim, query)


def _notes(opened: SkelStage, unit: float) -> tuple[str, ...]:
    """Return a note on a unit that is the format's default."""
    if UsdGeom.StageHasAuthoredMetersPerUnit(opened.stage):
        return ()
    return (f"the file states no metersPerUnit, {unit:g} is USD's default",)
