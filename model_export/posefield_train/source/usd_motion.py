"""Motion of a USD stage: its skeleton, the animation to read, and its unit, up axis and rate."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import UsdGeom, UsdSkel

from posefield.common.array_shapes import Positions, Rotations
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.rigs import rest_joints, usd_rig
from posefield.rigs.rest_joints import MAX_JOINTS, PosedJoints
from posefield.rigs.usd_rig import SkelJoints, SkelStage
from posefield_train.source import motion_file
from posefield_train.source.motion_file import MotionFile, ReadOptions, UnevenKeys


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


MAX_POSES = 10_000_000
"""Limit of frames times joints, as for BVH."""
SHOWN = 20
"""Animations that a message lists."""


def read(path: Path, source: str, options: ReadOptions) -> MotionFile:
    """Return the motion of a .usd, .usda, .usdc or .usdz file, with the unit and axis it states.

    source: name of the file in messages. Raises MotionFileError for a file that does not open
    whole, that has no skeleton, no animation or several without one chosen, and for samples that
    are no frames.
    """
    # usd-core finds damage of values when they are read: its own errors are RuntimeErrors, and
    # names of joints may be no text.
    with rest_joints.naming_faults(source, RuntimeError, ValueError, TypeError):
        return _read(path, source, options)


def _read(path: Path, source: str, options: ReadOptions) -> MotionFile:
    opened = usd_rig.open_stage(path, source)
    motion = _chosen(opened, options.animation)
    codes = motion.sample_codes()
    pace, notes = _codes_per_second(opened)
    if not len(codes):
        raise opened.error(f"{motion.path} has no samples over time, expected an animation")
    try:
        found = motion_file.sample_times(codes / pace, options.rate)
    except UnevenKeys as fault:
        raise opened.error(f"{motion.path}: {fault}") from fault
    joints = len(motion.query.GetJointOrder())
    if joints > MAX_JOINTS or len(found.times) * joints > MAX_POSES:
        raise opened.error(
            f"found {len(found.times)} frames of {joints} joints, expected at most {MAX_JOINTS} "
            f"joints and {MAX_POSES} poses of a joint"
        )
    # The samples themselves, where the rate is theirs.
    exact = codes if options.rate is None else found.times * pace
    plain = rest_joints.plain_motion(motion.posed_joints(exact))
    stage = opened.stage
    has_unit = UsdGeom.StageHasAuthoredMetersPerUnit(stage)
    is_z_up = UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
    return MotionFile(
        source,
        "USD",
        plain.skeleton,
        plain.rotations,
        plain.translations,
        found.rate,
        found.evidence,
        metres_per_unit=float(UsdGeom.GetStageMetersPerUnit(stage)) if has_unit else None,
        up=("z" if is_z_up else "y") if stage.HasAuthoredMetadata("upAxis") else None,
        notes=notes,
    )


def _chosen(opened: SkelStage, wanted: str | None) -> SkelMotion:
    """Return the skeleton with the animation that is wanted, or with its only one."""
    skeletons = opened.prims(UsdSkel.Skeleton)
    animations = opened.prims(UsdSkel.Animation)
    if not skeletons:
        has = f"{len(animations)} animations and " if animations else ""
        raise opened.error(f"found {has}no Skeleton, expected a SkelRoot with one")
    if not animations:
        raise opened.error(
            f"found the skeleton {skeletons[0].GetPath()} without a SkelAnimation, expected one"
        )
    animation = _animation(opened, animations, wanted)
    bound = [prim for prim in skeletons if _bound_animation(opened, prim) == animation.GetPath()]
    if len(bound) != 1 and len(skeletons) > 1:
        paths = ", ".join(str(prim.GetPath()) for prim in skeletons[:SHOWN])
        raise opened.error(
            f"found {len(skeletons)} skeletons ({paths}), expected one that is bound to "
            f"{animation.GetPath()}: export each character alone"
        )
    prim = (bound or skeletons)[0]
    query = opened.cache.GetSkelQuery(UsdSkel.Skeleton(prim))
    if not query:
        raise opened.error(f"skeleton {prim.GetPath()} is not valid: {usd_rig.fault_of(prim)}")
    own = opened.cache.GetAnimQuery(UsdSkel.Animation(animation))
    if not own:
        raise opened.error(f"{animation.GetPath()} names no joints, expected those of a skeleton")
    return SkelMotion(opened.source, prim, query, own)


def _animation(opened: SkelStage, animations: list[Any], wanted: str | None) -> Any:
    """Return the animation with a path or name, or the only one."""
    paths = ", ".join(str(prim.GetPath()) for prim in animations[:SHOWN])
    if wanted is None:
        if len(animations) > 1:
            raise opened.error(
                f"found {len(animations)} animations ({paths}), expected one: export each to a "
                "file of its own, or name the path of one in the column clips.animation"
            )
        return animations[0]
    found = [prim for prim in animations if wanted in (str(prim.GetPath()), prim.GetName())]
    if len(found) != 1:
        raise opened.error(f"found the animations {paths}, expected one {wanted!r}")
    return found[0]


def _bound_animation(opened: SkelStage, skeleton: Any) -> Any:
    """Return the path of the animation that a skeleton is bound to, or None."""
    query = opened.cache.GetSkelQuery(UsdSkel.Skeleton(skeleton))
    own = query.GetAnimQuery() if query else None
    return own.GetPrim().GetPath() if own else None


def _codes_per_second(opened: SkelStage) -> tuple[float, tuple[str, ...]]:
    """Return the time codes per second, and a note if it is the format's default."""
    stage = opened.stage
    pace = float(stage.GetTimeCodesPerSecond())
    if not 0.0 < pace < 1e6:
        raise opened.error(f"states {pace:g} time codes a second, expected a positive number")
    authored = any(map(stage.HasAuthoredMetadata, ("timeCodesPerSecond", "framesPerSecond")))
    if authored:
        return pace, ()
    return pace, (f"{opened.source}: states no timeCodesPerSecond, {pace:g} is USD's default",)
