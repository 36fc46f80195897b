"""Skeletons of a USD stage: their joints, poses at rest and transforms; and the one of a rig."""

from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Ar, Sdf, Tf, Usd, UsdGeom, UsdSkel, UsdUtils

from posefield.common.errors import MotionFileError
from posefield.common.units import UpAxis
from posefield.rigs import rest_joints
from posefield.rigs.rest_joints import MAX_JOINTS, JointTree, RestJoints, Transform


@dataclass(frozen=True)
class SkelStage:
    """An open stage. cache: of UsdSkel. quiet: keeps warnings, which are notes, from stderr."""

    source: str
    stage: Any
    cache: Any
    quiet: Any

    def error(self, message: str) -> MotionFileError:
        """Return an error that names the file."""
        return MotionFileError(self.source, message)

    def prims(self, schema: Any) -> list[Any]:
        """Return the prims of a schema, of several instances the first."""
        prims: dict[Any, Any] = {}
        for prim in Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies()):
            if prim.IsA(schema):
                shared = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
                prims.setdefault(shared.GetPath(), prim)
        return list(prims.values())

    def notes(self, *prims: Any) -> list[str]:
        """Return notes on what the stage lacks; MotionFileError where it may be part of prims.

        prims: skeleton and animation that are read.
        """
        notes, needed = [], [prim.GetPath() for prim in prims]
        # Clients of the service read the notes: they do not tell where the folder is.
        folder = f"{Path(self.stage.GetRootLayer().realPath).parent}/"
        for fault in self.stage.GetCompositionErrors():
            site = fault.rootSite.path
            message = " ".join(str(fault).replace(folder, "").split())[:200]
            # A layer as a whole has the root's path.
            is_part = any(path.HasPrefix(site) or site.HasPrefix(path) for path in needed)
            if is_part and not site.IsAbsoluteRootPath():
                raise self.error(f"refers to what cannot be read: {message}")
            notes.append(f"{site} refers to what cannot be read, which was left out: {message}")
        return notes

    def skeleton(self, prims: Sequence[Any], joint_names: Set[str]) -> tuple[Any, list[str]]:
        """Return the one of some skeletons that has named joints or roles, and a note on others."""
        trees = list(map(joint_tree, prims))
        skeleton = prims[rest_joints.one_skeleton(self.source, trees, joint_names)]
        skeletons = self.prims(UsdSkel.Skeleton)
        other_paths = ", ".join(
            str(prim.GetPath()) for prim in skeletons[:SHOWN] if prim != skeleton
        )
        note = f"skeleton {skeleton.GetPath()} was read: {other_paths} left out"
        return skeleton, [note] if other_paths else []

    def query(self, skeleton: Any) -> Any:
        """Return the query of UsdSkel for a skeleton; MotionFileError if it is not valid."""
        schema = UsdSkel.Skeleton(skeleton)
        query = self.cache.GetSkelQuery(schema)
        if query:
            return query
        joints = schema.GetJointsAttr().Get()
        valid, reason = UsdSkel.Topology(joints).Validate() if joints else (False, "no joints")
        cause = "its transforms are not one for each joint" if valid else reason
        raise self.error(f"skeleton {skeleton.GetPath()} is not valid: {cause}")


SHOWN = 20
"""Prims that a message lists."""


def joint_tree(skeleton: Any) -> JointTree:
    """Return the last names of the joints of a Skeleton, those that USD calls illegal too."""
    tokens = [str(token) for token in UsdSkel.Skeleton(skeleton).GetJointsAttr().Get() or ()]
    joint_of_token = {token: joint for joint, token in enumerate(tokens)}
    parents = []
    for token in tokens:
        above = token.rpartition("/")[0]
        while above and above not in joint_of_token:
            above = above.rpartition("/")[0]
        parents.append(joint_of_token.get(above, -1))
    names = tuple(token.rpartition("/")[2] for token in tokens)
    return JointTree(str(skeleton.GetPath()), names, tuple(parents))


def expect_inside(path: Path, source: str) -> None:
    """Raise MotionFileError for a file that is composed of layers out of its folder."""
    resolved = path.resolve()
    layers = [str(resolved)]
    for layer_path in layers:  # It grows.
        try:
            layer = Sdf.Layer.FindOrOpen(layer_path)
            names = [*set().union(*UsdUtils.ExtractExternalReferences(layer_path))]
        except Tf.ErrorException:
            continue  # It has no part in the stage.
        for name in sorted(names):
            reference = layer.ComputeAbsolutePath(name)
            file = Ar.SplitPackageRelativePathOuter(Sdf.Layer.SplitIdentifier(reference)[0])[0]
            if not Sdf.FileFormat.FindByExtension(Path(file).suffix[1:]):
                continue  # Textures and other files are not read.
            if not Path(file).resolve().is_relative_to(resolved.parent):
                raise MotionFileError(
                    source, f"refers to {name!r}, expected a path below its folder"
                )
            layers += [reference] if reference not in layers else []


def open_stage(path: Path, source: str) -> SkelStage:
    """Return the stage of a file; MotionFileError if it does not open.

    source: name of the file in messages.
    """
    quiet = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as fault:
        message = str(fault).rpartition(" : ")[2].strip().strip("'")[:200]
        raise MotionFileError(source, f"does not open as USD: {message}") from fault
    cache = UsdSkel.Cache()
    opened = SkelStage(source, stage, cache, quiet)
    for prim in opened.prims(UsdSkel.Root):
        cache.Populate(UsdSkel.Root(prim), Usd.TraverseInstanceProxies())
    return opened


@dataclass(frozen=True)
class SkelJoints:
    """A skeleton. prim: its own. query: of UsdSkel."""

    opened: SkelStage
    prim: Any
    query: Any

    def tree(self) -> JointTree:
        """Return names and parents of the joints; MotionFileError unless they are one tree."""
        paths = tuple(str(path) for path in self.query.GetJointOrder())
        label, names, parents = joint_tree(self.prim)
        roots = [path for path, parent in zip(paths, parents, strict=True) if parent < 0]
        if len(roots) != 1 or any(parent >= joint for joint, parent in enumerate(parents)):
            root_names = ", ".join(roots[:5]) or "no joints"
            raise self.opened.error(
                f"skeleton {self.prim.GetPath()} has the root joints {root_names}, "
                "expected one before all others"
            )
        stated = tuple(self.query.GetSkeleton().GetJointNamesAttr().Get() or ())
        labels = next(
            labels
            for labels in (stated, names, paths)
            if len({*labels}) == len(labels) == len(paths)
        )
        return JointTree(label, tuple(map(str, labels)), parents)

    def rest(
        self, parents: Sequence[int], outer: Transform, frame: Transform | None = None
    ) -> tuple[Transform, Transform, list[str]]:
        """Return the transforms (J, ...) that the file states, and those of the bind pose; notes.

        outer: from the skeleton to the world. frame: of the motion, for a file without poses.
        """
        count, path, notes = len(parents), self.prim.GetPath(), list[str]()
        local = self.query.ComputeJointLocalTransforms(0.0, atRest=True)
        world = np.array(self.query.GetJointWorldBindTransforms(), float)
        bind = {}
        if len(world) == count:
            bind = {
                joint: rest_joints.of_matrix(matrix, path) for joint, matrix in enumerate(world)
            }
        if len(local) == count:
            frame = self._transforms(local)
        elif bind:
            above = np.array(UsdGeom.XformCache(0.0).GetLocalToWorldTransform(self.prim), float)
            above = np.concatenate([above[None], world[list(parents[1:])]])
            frame = self._transforms(world @ np.linalg.inv(above))
            notes = [f"{path} has no restTransforms: the bindTransforms were taken"]
        elif frame is not None:
            notes = [f"{path} has no restTransforms: the first frame was taken"]
        else:
            raise self.opened.error(
                f"{path} has neither restTransforms nor bindTransforms, expected one"
            )
        # The format says which frame bindTransforms are in, whatever pose restTransforms show.
        return frame, rest_joints.bound_rest(frame, parents, outer, bind, 0.0), notes

    def world(self, codes: Sequence[float]) -> Transform:
        """Return transforms (F, ...) of the skeleton in the world."""
        caches = (UsdGeom.XformCache(Usd.TimeCode(code)) for code in codes)
        return self._transforms(cache.GetLocalToWorldTransform(self.prim) for cache in caches)

    def _transforms(self, matrices: Iterable[Any]) -> Transform:
        path = self.prim.GetPath()
        transforms = [rest_joints.of_matrix(np.array(matrix, float), path) for matrix in matrices]
        return rest_joints.stacked(transforms)

    def moving_parents(self) -> list[Any]:
        """Return the transforms of the skeleton and its ancestors that change over time."""
        moving, prim = [], self.prim
        while prim and not prim.IsPseudoRoot():
            xformable = UsdGeom.Xformable(prim)
            if xformable and xformable.TransformMightBeTimeVarying():
                moving.append(xformable)
            prim = prim.GetParent()
        return moving


def read(
    path: Path, source: str, joint_names: Set[str]
) -> tuple[RestJoints, tuple[str, ...], str, tuple[str, ...]]:
    """Return the joints of a .usd, .usda, .usdc or .usdz file.

    Further the tokens of its `joints`, the path of its Skeleton, and notes. source: name of the
    file in messages. joint_names: of the skeleton that is meant. Raises MotionFileError for a file
    without a skeleton or with several, for a skeleton whose prim moves over time, and for layers
    out of the file's folder.
    """
    expect_inside(path, source)
    opened = open_stage(path, source)
    skeletons = opened.prims(UsdSkel.Skeleton)
    if not skeletons:
        raise opened.error("found no Skeleton, expected a SkelRoot with one")
    prim, notes = opened.skeleton(skeletons, joint_names)
    joints = SkelJoints(opened, prim, opened.query(prim))
    notes += opened.notes(prim)
    moving = joints.moving_parents()
    if moving:
        raise opened.error(
            f"{moving[0].GetPath()} moves over time, expected a skeleton that stands still: its "
            "joints move it"
        )
    _, names, parents = joints.tree()
    if len(names) > MAX_JOINTS:
        raise opened.error(f"found {len(names)} joints, expected at most {MAX_JOINTS}")
    outer = Transform(*(array[0] for array in joints.world([0.0])))
    _, bound, rest_notes = joints.rest(parents, outer)
    stage = opened.stage
    up: UpAxis = "z" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else "y"
    unit = float(UsdGeom.GetStageMetersPerUnit(stage))
    rest = RestJoints(source, names, parents, *bound, outer, unit, up)
    paths = tuple(str(path_token) for path_token in joints.query.GetJointOrder())
    if not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        notes.append(f"the file states no metersPerUnit, {unit:g} is USD's default")
    return rest, paths, str(prim.GetPath()), (*notes, *rest_notes)
