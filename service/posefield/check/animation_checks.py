"""Checks of a skeleton's animation: completeness, time samples, values and quaternion order."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from posefield.check import skeleton_bindings as rigs
from posefield.check.finding import Finding, error, first_values, warning
from posefield.check.skeleton_bindings import SkeletonBinding
from posefield.common.units import Floats
from posefield.motion import quat

COMPONENTS = ("translations", "rotations", "scales")
LENGTH_TOLERANCE = 1e-3
"""Largest deviation of a quaternion's length from 1; half precision errs by 5e-4."""

# Joints are near their rest rotations most of the time. If the rotations of a file are near half
# turns, but small in another order of components, they were written in that order.
FAR, NEAR = np.radians(120), np.radians(60)
MIN_ROTATING_JOINTS = 4
"""Smallest number of joints from which the quaternion order can be judged."""


def joints(rig: SkeletonBinding) -> Iterator[Finding]:
    """Yield findings on animated joints missing in the skeleton, and joints not animated."""
    animated = rigs.attribute_tokens(rig.animation)
    unknown = [joint for joint in animated if joint not in rig.joints]
    still = [joint for joint in rig.joints if joint not in animated]
    if unknown:
        message = (
            f"animates {first_values(unknown)}, expected only joints of {rig.skeleton.GetPath()}"
        )
        yield error("unknown-joint", rig.animation, message)
    if still:
        message = (
            f"does not animate {first_values(still)}; expected all joints: some readers ask for it"
        )
        yield warning("joint-not-animated", rig.animation, message)


def components(rig: SkeletonBinding) -> Iterator[Finding]:
    """Yield findings on translations, rotations or scales that are missing or miscounted."""
    expected = len(rigs.attribute_tokens(rig.animation))
    for name in COMPONENTS:
        if not rigs.is_authored(rig.animation, name):
            message = f"no {name}, expected {', '.join(COMPONENTS)}: else the rest pose shows"
            yield error(f"missing-{name}", rig.animation, message)
            continue
        counts = {len(values) for _, values in samples(rig.animation, name)}
        if counts != {expected}:
            message = f"{first_values(sorted(counts))} {name}, expected {expected}, one a joint"
            yield error(f"{name}-count", rig.animation, message)


def times(rig: SkeletonBinding) -> Iterator[Finding]:
    """Yield findings on poses without time samples, samples outside the range, missing frames."""
    found = {time for name in COMPONENTS[:2] for time in _time_codes(rig.animation, name)}
    if not found:
        message = "a pose as default values, expected time samples: some readers know no others"
        yield error("no-time-samples", rig.animation, message)
        return
    start, end = rig.stage.GetStartTimeCode(), rig.stage.GetEndTimeCode()
    frames = np.arange(np.ceil(start), np.floor(end) + 1).tolist()
    for name in COMPONENTS[:2]:
        codes = set(_time_codes(rig.animation, name))
        missing = [f"{frame:g}" for frame in frames if codes and frame not in codes]
        if missing:
            message = (
                f"no {name} at {first_values(missing)}; expected one at each frame, since readers"
            )
            yield warning("missing-frame", rig.animation, f"{message} interpolate differently")
    outside = [f"{time:g}" for time in sorted(found) if not start <= time <= end]
    if outside:
        message = f"samples at {first_values(outside)}, expected them within {start:g} to {end:g}"
        yield warning("outside-range", rig.animation, message)


def values(rig: SkeletonBinding) -> Iterator[Finding]:
    """Yield findings on numbers that are not finite, lengths other than 1, and sign changes."""
    for name in COMPONENTS:
        found = samples(rig.animation, name)
        wrong = [f"{time:g}" for time, sample in found if not np.all(np.isfinite(sample))]
        if wrong:
            message = (
                f"{name} infinite or undefined at {first_values(wrong)}, expected finite numbers"
            )
            yield error("not-finite", rig.animation, message)
    stacked = _stacked_rotations(rig.animation)
    if stacked is not None:
        yield from _rotations(rig, stacked)


def samples(animation: Any, name: str) -> list[tuple[float, Floats]]:
    """Return times and values of an attribute; a lone default value counts as time 0."""
    codes = _time_codes(animation, name)
    if codes:
        return [(code, rigs.attribute_array(animation, name, code)) for code in codes]
    default = rigs.attribute_array(animation, name)
    return [(0.0, default)] if len(default) else []


def _time_codes(animation: Any, name: str) -> list[float]:
    return list(animation.GetAttribute(name).GetTimeSamples())


def _stacked_rotations(animation: Any) -> Floats | None:
    """Return the rotations (F, J, 4), w x y z; None for mixed shapes or non-finite values."""
    found = [sample for _, sample in samples(animation, "rotations")]
    if len({sample.shape for sample in found}) != 1 or not np.all(np.isfinite(found)):
        return None
    # In memory USD keeps the real part last.
    return np.roll(np.array(found), 1, axis=-1) if found[0].size else None


def _rotations(rig: SkeletonBinding, rotations: Floats) -> Iterator[Finding]:
    lengths = np.linalg.norm(rotations, axis=-1)
    if np.abs(lengths - 1).max() > LENGTH_TOLERANCE:
        worst = lengths.flat[np.argmax(np.abs(lengths - 1))]
        message = f"a rotation of length {worst:.4g}, expected unit quaternions"
        yield error("not-unit-rotation", rig.animation, message)
        return
    flips = int(np.sum(np.sum(rotations[1:] * rotations[:-1], axis=-1) < 0))
    if flips:
        message = f"{flips} changes of sign between frames, expected none: some readers spin there"
        yield warning("rotation-sign-flip", rig.animation, message)
    yield from _order(rig, rotations)


def _order(rig: SkeletonBinding, rotations: Floats) -> Iterator[Finding]:
    rest = _rest_rotations(rig)
    if rest is None or rest.shape != rotations.shape[1:] or len(rest) < MIN_ROTATING_JOINTS:
        return
    read = _median_angle(rest, rotations)
    for name, shift in (("x y z w", 1), ("w x y z", -1)):
        meant = _median_angle(rest, np.roll(rotations, shift, axis=-1))
        if read > FAR and meant < NEAR:
            message = (
                f"joints lie {np.degrees(read):.0f} degrees from rest, but {np.degrees(meant):.0f} "
                f"if {name} was written where the other order belongs; expected the right order"
            )
            yield warning("quaternion-order", rig.animation, message)


def _rest_rotations(rig: SkeletonBinding) -> Floats | None:
    """Return the rest rotations (J, 4) of the animated joints."""
    matrices = rigs.attribute_array(rig.skeleton, "restTransforms").reshape(-1, 4, 4)
    animated = rigs.attribute_tokens(rig.animation)
    whole = len(matrices) == len(rig.joints) and np.all(np.isfinite(matrices))
    if not whole or not set(animated) <= set(rig.joints):
        return None
    rows = matrices[[rig.joints.index(joint) for joint in animated]]
    return quat.from_matrix(np.swapaxes(rows[:, :3, :3], -1, -2))


def _median_angle(rest: Floats, rotations: Floats) -> float:
    """Return the median angle between rotations and rest, rad."""
    dots = np.abs(np.sum(rest * rotations, axis=-1))
    return float(np.median(2 * np.arccos(np.clip(dots, 0.0, 1.0))))
