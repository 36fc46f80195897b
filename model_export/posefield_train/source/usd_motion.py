"""Motion of a USD stage: its skeleton, the animation to read, and its unit, up axis and rate."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import UsdGeom, UsdSkel

from posefield.common.units import Floats
from posefield.rigs import rest_joints, usd_rig
from posefield.rigs.rest_joints import MAX_JOINTS, JointTree, Transform
from posefield.rigs.usd_rig import SHOWN, SkelJoints, SkelStage
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

    def posed_joints(
        self, codes: Sequence[float]
    ) -> tuple[JointTree, Transform, Transform, list[str]]:
        """Return joints at rest and at time codes (F,), the root in the stage's world; notes."""
        tree = self.tree()
        world = self.world(codes if self.moving_parents() else codes[:1])
        first = Transform(*(component[0] for component in world))
        frame = None
        if not (self.query.HasRestPose() or self.query.HasBindPose()):
            frame = Transform(*(component[0] for component in self._samples(codes[:1], None)[0]))
        local, rest, notes = self.rest(tree.parents, first, frame)
        motion, lacking = self._samples(codes, local)
        note = f"{self.path} has no {' and '.join(lacking)}: those at rest were taken"
        notes += [note] if lacking else []
        return tree, rest.root_inside(first), motion.root_inside(world), notes

    def curves(self, codes: Sequence[float]) -> Mapping[str, Floats]:
        """Return the weights (F,) of blend shapes by name."""
        prim = UsdSkel.Animation(self.animation.GetPrim())
        names = [str(name) for name in prim.GetBlendShapesAttr().Get() or ()]
        values = [prim.GetBlendShapeWeightsAttr().Get(code) for code in codes]
        if not names or any(weights is None or len(weights) != len(names) for weights in values):
            return {}
        return dict(zip(names, np.array(values, float).T, strict=True))

    def _samples(
        self, codes: Sequence[float], still: Transform | None
    ) -> tuple[Transform, list[str]]:
        """Return transforms (F, J, ...) at time codes, and the parts that the animation lacks.

        still: of joints and parts that it does not have.
        """
        order = [str(path) for path in self.query.GetJointOrder()]
        paths = [str(path) for path in self.animation.GetJointOrder()]
        pairs = [(order.index(path), column) for column, path in enumerate(paths) if path in order]
        if not pairs:
            raise self.opened.error(f"{self.path} moves no joint of {self.prim.GetPath()}")
        targets, columns = map(list, zip(*pairs, strict=True))
        prim, components, lacking = self.animation.GetPrim(), list[Floats](), list[str]()
        for index, name in enumerate(("rotations", "translations", "scales")):
            values = [prim.GetAttribute(name).Get(code) for code in codes]
            is_missing = values[0] is None
            if still is None and (is_missing or len(pairs) < len(order)):
                raise self.opened.error(
                    f"{self.prim.GetPath()} has neither restTransforms nor bindTransforms, "
                    f"expected one of them: {self.path} leaves out joints or {name}"
                )
            width = 4 if name == "rotations" else 3
            full = np.zeros((len(codes), len(order), width))
            if still is not None:
                full[:] = still[index]
            lacking += [name] if is_missing else []
            for code, row, value in zip(codes, full, () if is_missing else values, strict=False):
                if len(value) != len(paths):
                    raise self.opened.error(
                        f"{self.path} has {len(value)} {name} at time code {code:g}, expected "
                        f"{len(paths)}, one for each joint"
                    )
                own_values = np.array(value, float)[columns]
                row[targets] = own_values[:, [3, 0, 1, 2]] if width == 4 else own_values
            components.append(full)
        lengths = np.linalg.norm(components[0], axis=-1, keepdims=True)
        if not np.all(np.isfinite(components[1])) or not np.all(lengths > 0.5):
            raise self.opened.error(f"{self.path} has broken numbers")
        return Transform(components[0] / lengths, *components[1:]).unmirrored(), lacking


MAX_POSES = 10_000_000
"""Limit of frames times joints, as for BVH."""


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
    motion, notes = _chosen(opened, options)
    notes += opened.notes(motion.prim, motion.animation.GetPrim())
    codes = motion.sample_codes()
    pace = _codes_per_second(opened, notes)
    if not len(codes):
        raise opened.error(f"{motion.path} moves no joints over time, expected an animation")
    try:
        times, rate, evidence = motion_file.sample_times(codes / pace, options.rate)
    except UnevenKeys as fault:
        raise opened.error(f"{motion.path}: {fault}") from fault
    joints = len(motion.query.GetJointOrder())
    if joints > MAX_JOINTS or len(times) * joints > MAX_POSES:
        raise opened.error(
            f"found {len(times)} frames of {joints} joints, expected at most {MAX_JOINTS} "
            f"joints and {MAX_POSES} poses of a joint"
        )
    # The samples themselves, where the rate is theirs.
    exact = (codes if options.rate is None else times * pace).tolist()
    tree, rest, posed, joint_notes = motion.posed_joints(exact)
    motion_file.expect_skeleton(source, tree, options)
    skeleton, rotations, translations, more = rest_joints.plain_motion(source, tree, rest, posed)
    curves, stage = motion.curves(exact), opened.stage
    begin, end = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    if stage.HasAuthoredTimeCodeRange() and (codes[0] < begin or codes[-1] > end):
        joint_notes.append(
            f"the stage states the time codes {begin:g} to {end:g}: all samples, {codes[0]:g} to "
            f"{codes[-1]:g}, were read"
        )
    has_unit = UsdGeom.StageHasAuthoredMetersPerUnit(stage)
    is_z_up = UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
    return MotionFile(
        source,
        "USD",
        skeleton,
        rotations,
        translations,
        rate,
        evidence,
        metres_per_unit=float(UsdGeom.GetStageMetersPerUnit(stage)) if has_unit else None,
        up=("z" if is_z_up else "y") if stage.HasAuthoredMetadata("upAxis") else None,
        notes=(*notes, *joint_notes, *more, *motion_file.curve_notes(curves)),
        curves=curves,
    )


def _chosen(opened: SkelStage, options: ReadOptions) -> tuple[SkelMotion, list[str]]:
    """Return the skeleton with the animation that is wanted, or that it is bound to; and notes."""
    skeletons = opened.prims(UsdSkel.Skeleton)
    animations = opened.prims(UsdSkel.Animation)
    if not skeletons:
        has = f"{len(animations)} animations and " if animations else ""
        raise opened.error(f"found {has}no Skeleton, expected a SkelRoot with one")
    if not animations:
        raise opened.error(
            f"found the skeleton {skeletons[0].GetPath()} without a SkelAnimation, expected one"
        )
    bound = {prim: _bound_animation(opened, prim) for prim in skeletons}
    candidates = _animations(opened, animations, options.animation)
    if len(candidates) > 1:
        candidates = [
            query for query in candidates if query.GetPath() in bound.values()
        ] or candidates
    if len(candidates) > 1:
        candidates = [query for query in candidates if _moves(opened, query)] or candidates
    paths = [query.GetPath() for query in candidates]
    owners = [prim for prim in skeletons if bound[prim] in paths]
    if len(candidates) > 1 and not owners:
        listed = ", ".join(map(str, paths[:SHOWN]))
        raise opened.error(
            f"found {len(candidates)} animations ({listed}), expected one: export each to a file "
            "of its own, or give path or number of one (--animation, the column clips.animation)"
        )
    tokens = UsdSkel.Animation(candidates[0]).GetJointsAttr().Get() or ()
    joint_names = {str(token).rpartition("/")[2] for token in tokens}
    prim, notes = opened.skeleton(
        owners or skeletons, {options.skeleton or ""} if owners else joint_names
    )
    animation = next(
        (query for query in candidates if query.GetPath() == bound[prim]), candidates[0]
    )
    unused = [str(query.GetPath()) for query in animations if query != animation]
    if options.animation is None and unused:
        note = f"{animation.GetPath()} moves {prim.GetPath()}: {', '.join(unused[:SHOWN])} left out"
        notes.append(note)
    query = opened.cache.GetAnimQuery(UsdSkel.Animation(animation))
    if not query:
        raise opened.error(f"{animation.GetPath()} names no joints, expected those of a skeleton")
    return SkelMotion(opened, prim, opened.query(prim), query), notes


def _animations(opened: SkelStage, animations: list[Any], requested: str | None) -> list[Any]:
    if requested is None:
        return animations
    paths = [str(prim.GetPath()) for prim in animations]
    is_path = requested.startswith("/")
    names = paths if is_path else [prim.GetName() for prim in animations]
    chosen = motion_file.choice(names, requested)
    if chosen is None:
        listed = ", ".join(paths[:SHOWN])
        raise opened.error(
            f"found the animations {listed}, expected one {requested!r}, or a number"
        )
    return [animations[chosen]]


def _moves(opened: SkelStage, animation: Any) -> bool:
    query = opened.cache.GetAnimQuery(UsdSkel.Animation(animation))
    return bool(query) and len(query.GetJointTransformTimeSamples()) > 1


def _bound_animation(opened: SkelStage, skeleton: Any) -> Any:
    query = opened.cache.GetSkelQuery(UsdSkel.Skeleton(skeleton))
    animation = query.GetAnimQuery() if query else None
    return animation.GetPrim().GetPath() if animation else None


def _codes_per_second(opened: SkelStage, notes: list[str]) -> float:
    """Return the time codes per second, and add a note if it is the format's default."""
    stage = opened.stage
    pace = float(stage.GetTimeCodesPerSecond())
    if not 0.0 < pace < 1e6:
        raise opened.error(f"states {pace:g} time codes a second, expected a positive number")
    if not any(map(stage.HasAuthoredMetadata, ("timeCodesPerSecond", "framesPerSecond"))):
        notes.append(f"{opened.source}: states no timeCodesPerSecond, {pace:g} is USD's default")
    return pace
