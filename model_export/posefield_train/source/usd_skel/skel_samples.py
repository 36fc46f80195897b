"""Samples of a SkelAnimation in the order of its skeleton, and of the transforms above it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield.common.array_shapes import Positions, Rotations
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.rigs.joints.posed_joints import PosedJoints
from posefield.rigs.usd.skel_joints import SkelJoints


@dataclass(frozen=True)
class SkelMotion(SkelJoints):
    """A skeleton with one animation.

    animation: its query of UsdSkel.
    """

    animation: Any

    @property
    def path(self) -> str:
        """Return the path of the animation."""
        return str(self.animation.GetPrim().GetPath())

    def sample_codes(self) -> Floats:
        """Return the time codes (K,) of all samples of joints and of transforms above them."""
        codes = set(self.animation.GetJointTransformTimeSamples())
        if codes:
            for above in self.moving_parents():
                codes |= set(above.GetTimeSamples())
        return np.array(sorted(codes), float)

    def posed_joints(self, codes: Floats) -> PosedJoints:
        """Return rest pose and motion at time codes (F,), the root's in the stage's world."""
        names, parents = self.tree()
        rest_turns, rest_places = self.rest(parents)
        rotations, translations, scales = self._samples(codes, len(names))
        moving = bool(self.moving_parents())
        outer = self.world(codes if moving else codes[:1])
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
        still = [np.stack(part) for part in zip(*map(self.decomposed, rest), strict=True)]
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
