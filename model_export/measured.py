"""Controls that are measured of the motion, so that nobody types them.

Measured is the clip that training sees: cut, its heading and origin taken out, a cycle closed.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from model_export.controls import MOMENTS, Auto, Control, ControlMeasured
from model_export.recipe import Recipe
from model_export.table import Row
from service.motion import measure, quat, skeleton
from service.motion.clip import Clip
from service.motion.conventions import UP, Floats
from service.motion.errors import TrainingError
from service.motion.measure import At, Measure, Seen
from service.motion.skeleton import Skeleton

# Decimals of a measured value: what lies below a micrometre is rounding, and would make as many
# lengths of one performer's leg as there are clips.
DECIMALS = 6


def controls(recipe: Recipe, row: Row, clip: Clip, landmarks: Sequence[float]) -> Floats:
    """All controls (d,) of a clip, in the recipe's order: those of its row and those measured.

    landmarks: shares of the clip. Raises TrainingError for a leg whose ends are on no chain.
    """
    if not recipe.measured:
        return row.controls
    typed, whole = iter(row.controls.tolist()), seen(clip)

    def value(control: Control) -> float:
        if not isinstance(control, ControlMeasured):
            return float(next(typed))
        at = _landmark(recipe, control, landmarks)
        place = replace(whole, landmark=(at or 0.0) * (len(clip) - 1))
        found = measure.value(of(recipe, control, clip.skeleton), place)
        # Of minus zero, zero.
        return round(found, DECIMALS) + 0.0

    return np.array([value(control) for control in recipe.controls])


def of(recipe: Recipe, control: ControlMeasured, joints: Skeleton, share: float = 0.0) -> Measure:
    """How a control is measured on a skeleton, which has the joints that are named.

    share: of canonical time, of its landmark, if that is its moment.
    """
    auto = control.auto
    if auto.quantity == "root_height":
        return Measure("height", (0,), *_moment(auto, share))
    if auto.quantity == "leg_length":
        return Measure(auto.quantity, _chain(control, recipe.ends(auto), joints))
    names = auto.places or recipe.ends(auto)
    own = tuple(joints.names.index(name) for name in names)
    return Measure(auto.quantity, own, *_moment(auto, share))


def on_the_card(
    recipe: Recipe, control: Control, joints: Skeleton, landmarks: Floats
) -> Measure | None:
    """How a control is measured, as the card says it; None where it was typed.

    landmarks (N, m): of all clips, whose mean is where canonical time has them.
    """
    if not isinstance(control, ControlMeasured):
        return None
    share = _landmark(recipe, control, landmarks.mean(axis=0).tolist())
    return of(recipe, control, joints, round(share or 0.0, 4))


def travel(roots: Floats, path: Floats) -> Floats:
    """How far a root (..., F, 4) on its path (..., F, 3) gets (..., 3): to the left and forward, m,
    and the change of heading, rad."""
    turned = quat.mul(roots[..., -1, :], quat.conj(roots[..., 0, :]))
    way = path[..., -1, :] - path[..., 0, :]
    return np.stack([way[..., 0], way[..., 2], quat.twist(turned, UP)], axis=-1)


def bones(clip: Clip) -> Floats:
    """Bone offsets (J, 3) of the performer, the root's zero, m."""
    offsets = clip.translations.mean(axis=0)
    offsets[0] = 0.0
    return offsets


def seen(clip: Clip) -> Seen:
    """A clip as it is measured."""
    offsets, parents = bones(clip), clip.skeleton.parents
    local = skeleton.translations(offsets, clip.root_path)
    positions, _ = skeleton.forward(parents, clip.rotations, local)
    gone = travel(clip.rotations[:, 0], clip.root_path)
    return Seen(positions, clip.duration, gone, parents, offsets)


def _landmark(recipe: Recipe, control: ControlMeasured, landmarks: Sequence[float]) -> float | None:
    """Which of the landmarks is the control's moment; None where none is."""
    at = control.auto.at
    own = at is not None and at not in MOMENTS
    return landmarks[recipe.clips.landmarks.index(str(at))] if own else None


def _moment(auto: Auto, share: float) -> tuple[At | None, float | None]:
    match auto.at:
        case None | "start" | "end" | "highest" | "lowest" | "farthest":
            return auto.at, None
        case _:
            return "landmark", share


def _chain(control: ControlMeasured, ends: Sequence[str], joints: Skeleton) -> tuple[int, ...]:
    """Joints below the upper end down to the lower: their offsets are the bones between."""
    upper, lower = map(joints.names.index, ends)
    chain = [lower]
    while chain[-1] > upper and joints.parents[chain[-1]] != upper:
        chain.append(joints.parents[chain[-1]])
    if joints.parents[chain[-1]] != upper or lower == upper:
        raise TrainingError(
            f"controls.{control.name}.auto: {ends[1]!r} does not hang below {ends[0]!r}, expected "
            "the upper end of a leg and its lower"
        )
    return tuple(reversed(chain))
