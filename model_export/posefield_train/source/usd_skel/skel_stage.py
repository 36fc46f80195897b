"""USD stage: its one skeleton, the animation to read, and its unit, up axis and rate."""

from pathlib import Path
from typing import Any

from pxr import UsdGeom, UsdSkel

from posefield.common.units import UpAxis
from posefield.rigs.joints import format_faults, posed_joints
from posefield.rigs.joints.rest_joints import MAX_JOINTS
from posefield.rigs.usd import usd_stage
from posefield.rigs.usd.usd_stage import SkelStage
from posefield_train.source.motion_files import key_times
from posefield_train.source.motion_files.key_times import UnevenKeys
from posefield_train.source.motion_files.motion_file import MotionFile, ReadOptions
from posefield_train.source.usd_skel.skel_samples import SkelMotion

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
    with format_faults.naming_faults(source, RuntimeError, ValueError, TypeError):
        return _read(path, source, options)


def _read(path: Path, source: str, options: ReadOptions) -> MotionFile:
    opened = usd_stage.open_stage(path, source)
    motion = _chosen(opened, options.animation)
    codes = motion.sample_codes()
    pace, notes = _codes_per_second(opened)
    if not len(codes):
        raise opened.error(f"{motion.path} has no samples over time, expected an animation")
    try:
        found = key_times.sample_times(codes / pace, options.rate)
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
    plain = posed_joints.plain_motion(motion.posed_joints(exact))
    stage = opened.stage
    has_unit = UsdGeom.StageHasAuthoredMetersPerUnit(stage)
    return MotionFile(
        source,
        "USD",
        plain.skeleton,
        plain.rotations,
        plain.translations,
        found.rate,
        found.evidence,
        metres_per_unit=float(UsdGeom.GetStageMetersPerUnit(stage)) if has_unit else None,
        up=_up(opened),
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
        raise opened.error(f"skeleton {prim.GetPath()} is not valid: {usd_stage.fault_of(prim)}")
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


def _up(opened: SkelStage) -> UpAxis | None:
    """Return the stated up axis; None if the file states none."""
    if not opened.stage.HasAuthoredMetadata("upAxis"):
        return None
    return "z" if UsdGeom.GetStageUpAxis(opened.stage) == UsdGeom.Tokens.z else "y"
