"""Joints of a UsdSkel skeleton: their tree, their pose at rest, and the transforms above them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from posefield.common.errors import MotionFileError
from posefield.common.units import Floats
from posefield.motion import quat

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
