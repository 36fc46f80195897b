"""Samples of a SkelAnimation in the order of its skeleton, and of the transforms above it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from posefield.common.array_shapes import Positions, Rotations
from posefield.common.errors import MotionFileError
from posefield.common.units import Floats
from posefield.motion import quat
from posefield_train.source.motion_files.posed_joints import PosedJoints

SKEW = 1e-3
"""Largest cosine between axes of a matrix that are perpendicular."""


@dataclass(frozen=True)
class SkelMotion:
    """A skeleton with one animation.

    prim: of the skeleton. query, animation: their queries of UsdSkel.
    """

    source: str
    prim: Any
    query: Any
    animation: Any

    @property
    def path(self) -> str:
        """Return the path of the animation."""
        return str(self.animation.GetPrim().GetPath())

    def error(self, message: str) -> MotionFileError:
        """Return an error that names the file."""
        return MotionFileError(self.source, message)

    def sample_codes(self) -> Floats:
        """Return the time codes (K,) of all samples of joints and of transforms above them."""
        codes = set(self.animation.GetJointTransformTimeSamples())
        if codes:
            for above in self._moving_parents():
                codes |= set(above.GetTimeSamples())
        return np.array(sorted(codes), float)

    def _moving_parents(self) -> list[Any]:
        """Return the transforms of the skeleton and its ancestors that change over time."""
        found, prim = [], self.prim
        while prim and not prim.IsPseudoRoot():
            own = UsdGeom.Xformable(prim)
            if own and own.TransformMightBeTimeVarying():
                found.append(own)
            prim = prim.GetParent()
        return found

    def posed_joints(self, codes: Floats) -> PosedJoints:
        """Return rest pose and motion at time codes (F,), the root's in the stage's world."""
        names, parents = self._tree()
        rest_turns, rest_places = self._rest(parents)
        rotations, translations, scales = self._samples(codes, len(names))
        moving = bool(self._moving_parents())
        outer = self._world(codes if moving else codes[:1])
        turns, places, sizes = (np.broadcast_to(own, (len(codes), own.shape[-1])) for own in outer)
        translations[:, 0] = places + quat.rotate(turns, sizes * translations[:, 0])
        rotations[:, 0] = quat.mul(turns, rotations[:, 0])
        scales[:, 0] *= sizes
        rest_places[0] = places[0] + quat.rotate(turns[0], sizes[0] * rest_places[0])
        rest_turns[0] = quat.mul(turns[0], rest_turns[0])
        return PosedJoints(
            self.source,
            names,
            parents,
            rest_turns,
            rest_places,
            rotations,
            translations,
            scales,
        )

    def _tree(self) -> tuple[tuple[str, ...], tuple[int, ...]]:
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

    def _rest(self, parents: tuple[int, ...]) -> tuple[Floats, Floats]:
        """Return local rotations of the bind pose, and local translations of the rest pose."""
        rest = np.array(self.query.ComputeJointLocalTransforms(0.0, atRest=True), float)
        bind = np.array(self.query.GetJointWorldBindTransforms(), float)
        if len(rest) != len(parents):
            raise self.error(f"found {len(rest)} restTransforms, expected {len(parents)}")
        turns = np.stack([self._decomposed(matrix)[0] for matrix in rest])
        if len(bind) == len(parents):
            world = np.stack([self._decomposed(matrix)[0] for matrix in bind])
            turns[0] = world[0]
            turns[1:] = quat.mul(quat.conj(world[list(parents[1:])]), world[1:])
        return turns, rest[:, 3, :3].copy()

    def _samples(self, codes: Floats, joints: int) -> tuple[Rotations, Positions, Positions]:
        """Return rotations, translations and scales; joints that it does not name are at rest."""
        order = [str(path) for path in self.query.GetJointOrder()]
        own = [str(path) for path in self.animation.GetJointOrder()]
        known = [(order.index(path), column) for column, path in enumerate(own) if path in order]
        if not known:
            raise self.error(f"{self.path} moves no joint of {self.prim.GetPath()}")
        targets, columns = map(list, zip(*known, strict=True))
        parts = [self._components(code, len(own)) for code in codes.tolist()]
        moved = [np.stack(part) for part in zip(*parts, strict=True)]
        rest = np.array(self.query.ComputeJointLocalTransforms(0.0, atRest=True), float)
        still = [np.stack(part) for part in zip(*map(self._decomposed, rest), strict=True)]
        full = []
        for part, one in zip(moved, still, strict=True):
            values = np.tile(one, (len(codes), 1, 1))
            values[:, targets] = part[:, columns]
            full.append(values)
        rotations, translations, scales = full
        return rotations, translations, scales

    def _components(self, code: float, joints: int) -> tuple[Floats, Floats, Floats]:
        """Return rotations w x y z, translations and scales of the animation at a time code."""
        try:
            found = self.animation.ComputeJointLocalTransformComponents(code)
        except RuntimeError as fault:
            raise self.error(f"{self.path} cannot be read at time code {code:g}") from fault
        places, turns, scales = (np.array(part, float) for part in found)
        if len(places) != joints or len(turns) != joints or len(scales) != joints:
            raise self.error(
                f"{self.path} has {len(places)} translations, {len(turns)} rotations and "
                f"{len(scales)} scales at time code {code:g}, expected {joints} of each"
            )
        turns = turns[:, [3, 0, 1, 2]]
        lengths = np.linalg.norm(turns, axis=-1, keepdims=True)
        if not np.all(np.isfinite(places)) or not np.all(lengths > 0.5):
            raise self.error(f"{self.path} has broken numbers at time code {code:g}")
        return turns / lengths, places, scales

    def _world(self, codes: Floats) -> tuple[Floats, Floats, Floats]:
        """Return rotations, translations and scales (F, ...) of the skeleton in the world."""
        found = []
        for code in codes.tolist():
            matrix = UsdGeom.XformCache(Usd.TimeCode(code)).GetLocalToWorldTransform(self.prim)
            found.append(self._decomposed(np.array(matrix, float)))
        turns, places, sizes = (np.stack(part) for part in zip(*found, strict=True))
        return turns, places, sizes

    def _decomposed(self, matrix: Floats) -> tuple[Floats, Floats, Floats]:
        """Return rotation, translation and scale of a matrix (4, 4) for row vectors."""
        sizes = np.linalg.norm(matrix[:3, :3], axis=1)
        axes = matrix[:3, :3] / np.maximum(sizes, 1e-30)[:, None]
        if np.abs(axes @ axes.T - np.eye(3)).max() > SKEW or np.linalg.det(axes) < 0.0:
            raise self.error(
                f"a transform of {self.prim.GetPath()} skews or mirrors, expected neither"
            )
        return quat.from_matrix(axes.T), matrix[3, :3], sizes
