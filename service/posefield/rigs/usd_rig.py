"""Skeletons of a USD stage: their joints, poses at rest and transforms; and the one of a rig."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Tf, Usd, UsdGeom, UsdSkel

from posefield.common.errors import MotionFileError
from posefield.common.units import Floats, UpAxis
from posefield.motion import quat
from posefield.rigs.rest_joints import MAX_JOINTS, OuterTransform, RestJoints


@dataclass(frozen=True)
class SkelStage:
    """An open stage. cache: of UsdSkel, with the bindings of all its skeletons."""

    source: str
    stage: Any
    cache: Any

    def error(self, message: str) -> MotionFileError:
        """Return an error that names the file."""
        return MotionFileError(self.source, message)

    def prims(self, schema: Any) -> list[Any]:
        """Return the prims of a schema, those within instances too."""
        seen = Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies())
        return [prim for prim in seen if prim.IsA(schema)]


def open_stage(path: Path, source: str) -> SkelStage:
    """Return the stage of a file; MotionFileError if it does not open whole.

    source: name of the file in messages.
    """
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as fault:
        said = str(fault).rpartition(" : ")[2].strip().strip("'")[:200]
        raise MotionFileError(source, f"does not open as USD: {said}") from fault
    faults = stage.GetCompositionErrors()
    if faults:
        said = " ".join(str(faults[0]).split())[:200]
        raise MotionFileError(source, f"refers to what cannot be read: {said}")
    cache = UsdSkel.Cache()
    opened = SkelStage(source, stage, cache)
    for prim in opened.prims(UsdSkel.Root):
        cache.Populate(UsdSkel.Root(prim), Usd.TraverseInstanceProxies())
    return opened


def fault_of(skeleton: Any) -> str:
    """Return why a skeleton has no query."""
    joints = UsdSkel.Skeleton(skeleton).GetJointsAttr().Get()
    if not joints:
        return "it names no joints"
    valid, reason = UsdSkel.Topology(joints).Validate()
    return "its transforms are not one for each joint" if valid else reason


SKEW = 1e-3
"""Largest cosine between axes of a matrix that are perpendicular."""


@dataclass(frozen=True)
class SkelJoints:
    """A skeleton. prim: its own. query: of UsdSkel."""

    source: str
    prim: Any
    query: Any

    def error(self, message: str) -> MotionFileError:
        """Return an error that names the file."""
        return MotionFileError(self.source, message)

    def tree(self) -> tuple[tuple[str, ...], tuple[int, ...]]:
        """Return names and parents of the joints; MotionFileError unless they are one tree."""
        paths = [str(path) for path in self.query.GetJointOrder()]
        valid, reason = self.query.GetTopology().Validate()
        parents = tuple(self.query.GetTopology().GetParentIndices())
        if not valid or not paths or parents[0] != -1:
            raise self.error(f"skeleton {self.prim.GetPath()}: {reason or 'no joints'}")
        roots = [path for path, parent in zip(paths, parents, strict=True) if parent < 0]
        if len(roots) > 1:
            raise self.error(f"found the root joints {', '.join(roots[:5])}, expected one")
        stated = self.query.GetSkeleton().GetJointNamesAttr().Get()
        for names in (stated or (), [path.rpartition("/")[2] for path in paths]):
            if len(names) == len(paths) == len(set(names)):
                return tuple(map(str, names)), parents
        return tuple(paths), parents

    def rest(self, parents: tuple[int, ...]) -> tuple[Floats, Floats]:
        """Return local rotations of the bind pose, and local translations of the rest pose."""
        rest = np.array(self.query.ComputeJointLocalTransforms(0.0, atRest=True), float)
        bind = np.array(self.query.GetJointWorldBindTransforms(), float)
        if len(rest) != len(parents):
            raise self.error(f"found {len(rest)} restTransforms, expected {len(parents)}")
        turns = np.stack([self.decomposed(matrix)[0] for matrix in rest])
        if len(bind) == len(parents):
            world = np.stack([self.decomposed(matrix)[0] for matrix in bind])
            turns[0] = world[0]
            turns[1:] = quat.mul(quat.conj(world[list(parents[1:])]), world[1:])
        return turns, rest[:, 3, :3].copy()

    def world(self, codes: Floats) -> tuple[Floats, Floats, Floats]:
        """Return rotations, translations and scales (F, ...) of the skeleton in the world."""
        found = []
        for code in codes.tolist():
            matrix = UsdGeom.XformCache(Usd.TimeCode(code)).GetLocalToWorldTransform(self.prim)
            found.append(self.decomposed(np.array(matrix, float)))
        turns, places, sizes = (np.stack(part) for part in zip(*found, strict=True))
        return turns, places, sizes

    def moving_parents(self) -> list[Any]:
        """Return the transforms of the skeleton and its ancestors that change over time."""
        found, prim = [], self.prim
        while prim and not prim.IsPseudoRoot():
            own = UsdGeom.Xformable(prim)
            if own and own.TransformMightBeTimeVarying():
                found.append(own)
            prim = prim.GetParent()
        return found

    def decomposed(self, matrix: Floats) -> tuple[Floats, Floats, Floats]:
        """Return rotation, translation and scale of a matrix (4, 4) for row vectors."""
        sizes = np.linalg.norm(matrix[:3, :3], axis=1)
        axes = matrix[:3, :3] / np.maximum(sizes, 1e-30)[:, None]
        if np.abs(axes @ axes.T - np.eye(3)).max() > SKEW or np.linalg.det(axes) < 0.0:
            raise self.error(
                f"a transform of {self.prim.GetPath()} skews or mirrors, expected neither"
            )
        return quat.from_matrix(axes.T), matrix[3, :3], sizes


SHOWN = 20
"""Skeletons that a message lists."""


def read(path: Path, source: str) -> tuple[RestJoints, tuple[str, ...], str, tuple[str, ...]]:
    """Return the joints of a .usd, .usda, .usdc or .usdz file.

    Further the tokens of its `joints`, the path of its Skeleton, and notes. source: name of the
    file in messages. Raises MotionFileError for a file without a skeleton or
    with several, and for a skeleton whose prim moves over time.
    """
    opened = open_stage(path, source)
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
    notes: tuple[str, ...] = ()
    if not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        notes = (f"the file states no metersPerUnit, {unit:g} is USD's default",)
    return rest, paths, str(joints.prim.GetPath()), notes


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
        raise opened.error(f"skeleton {prim.GetPath()} is not valid: {fault_of(prim)}")
    return SkelJoints(opened.source, prim, query)
