"""Controls, landmarks and contacts of a clip, from its row or measured.

They are measured on the clip that training uses: cut, heading and origin removed, cycles closed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import get_args

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import UP, Floats
from posefield.motion import measures, quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.measures import Measure, MeasuredMotion, MeasureMoment
from posefield.motion.skeleton import Skeleton
from posefield_train.source.clip_table import ClipRow
from posefield_train.source.control_sources import TIME_NAMES, Auto, Control, ControlMeasured
from posefield_train.source.recipe import Recipe

MOMENT_NAMES: dict[str, MeasureMoment] = {name: name for name in get_args(MeasureMoment)}
"""Moments by name."""
# Decimals of a measured value. Differences below a micrometre are rounding errors, and would give
# one performer's leg a different length in every clip.
DECIMALS = 6


def control_values(recipe: Recipe, row: ClipRow, clip: Clip, landmarks: Sequence[float]) -> Floats:
    """Return all controls (d,) of a clip, from its row or measured, in the recipe's order.

    landmarks: shares of the clip. Raises TrainingError for a leg whose ends are not on one chain.
    """
    if not recipe.measured:
        return row.controls
    typed, quantities = iter(row.controls.tolist()), measured_quantities(clip)

    def value(control: Control) -> float:
        if not isinstance(control, ControlMeasured):
            return float(next(typed))
        at = _landmark_time(recipe, control, landmarks)
        moment = replace(quantities, landmark=(at or 0.0) * (len(clip) - 1))
        measured = measures.evaluate(control_measure(recipe, control, clip.skeleton), moment)
        # Adding zero turns minus zero into zero.
        return round(measured, DECIMALS) + 0.0

    return np.array([value(control) for control in recipe.controls])


def control_measure(
    recipe: Recipe, control: ControlMeasured, joints: Skeleton, share: float = 0.0
) -> Measure:
    """Return the measure of a control on a skeleton that has the named joints.

    share: of canonical time, of the control's landmark, if it has one.
    """
    auto = control.auto
    if auto.quantity == "root_height":
        return Measure("height", (0,), *_moment(auto, share))
    if auto.quantity == "leg_length":
        return Measure(auto.quantity, _chain(control, recipe.leg_ends(auto), joints))
    names = auto.joint_names or recipe.leg_ends(auto)
    indices = tuple(joints.names.index(name) for name in names)
    return Measure(auto.quantity, indices, *_moment(auto, share))


def card_measure(
    recipe: Recipe, control: Control, joints: Skeleton, landmarks: Floats
) -> Measure | None:
    """Return the measure of a control for the model card; None for a control of the table.

    landmarks: (N, m), of all clips; canonical time has them at their mean.
    """
    if not isinstance(control, ControlMeasured):
        return None
    share = _landmark_time(recipe, control, landmarks.mean(axis=0).tolist())
    return control_measure(recipe, control, joints, round(share or 0.0, 4))


def travel(roots: Floats, path: Floats) -> Floats:
    """Return the travel (..., 3) of a root (..., F, 4) along its path (..., F, 3).

    Its components are left and forward, m, and the change of heading, rad.
    """
    turned = quat.mul(roots[..., -1, :], quat.conj(roots[..., 0, :]))
    displacement = path[..., -1, :] - path[..., 0, :]
    return np.stack([displacement[..., 0], displacement[..., 2], quat.twist(turned, UP)], axis=-1)


def bone_offsets(clip: Clip) -> Floats:
    """Return the bone offsets (J, 3), m, of the performer, zero for the root."""
    offsets = clip.translations.mean(axis=0)
    offsets[0] = 0.0
    return offsets


def measured_quantities(clip: Clip) -> MeasuredMotion:
    """Return the quantities of a clip that measures use."""
    offsets, parents = bone_offsets(clip), clip.skeleton.parents
    local = skeleton.translations(offsets, clip.root_path)
    positions = skeleton.positions(parents, clip.rotations, local)
    gone = travel(clip.rotations[:, 0], clip.root_path)
    return MeasuredMotion(positions, clip.duration, gone, parents, offsets)


def moment_share(clip: Clip, joint: int, at: str) -> float:
    """Return the moment at which a joint is highest, lowest or farthest, as a share of the clip."""
    positions = measured_quantities(clip).positions
    moment = MOMENT_NAMES[at]
    frame = measures.moment_frame(Measure("height", (joint,), moment), positions, 0.0)
    return frame / (len(clip) - 1)


def _landmark_time(
    recipe: Recipe, control: ControlMeasured, landmarks: Sequence[float]
) -> float | None:
    """Return the time of the control's landmark; None if it uses none."""
    at = control.auto.at
    is_landmark = at is not None and at not in TIME_NAMES
    return landmarks[recipe.clips.landmarks.index(str(at))] if is_landmark else None


def _moment(auto: Auto, share: float) -> tuple[MeasureMoment | None, float | None]:
    match auto.at:
        case None | "start" | "end" | "highest" | "lowest" | "farthest":
            return auto.at, None
        case _:
            return "landmark", share


def _chain(control: ControlMeasured, end_names: Sequence[str], joints: Skeleton) -> tuple[int, ...]:
    """Return the joints below the upper end down to the lower; their offsets are the bones."""
    upper, lower = map(joints.names.index, end_names)
    chain = [lower]
    while chain[-1] > upper and joints.parents[chain[-1]] != upper:
        chain.append(joints.parents[chain[-1]])
    if joints.parents[chain[-1]] != upper or lower == upper:
        raise TrainingError(
            f"controls.{control.name}.auto: {end_names[1]!r} does not hang below {end_names[0]!r}, "
            "expected the upper end of a leg and its lower"
        )
    return tuple(reversed(chain))


Spans = tuple[tuple[float, float], ...]
"""Intervals of shares of a clip."""


def landmarks(row: ClipRow, last: int, columns: Sequence[str]) -> tuple[float, ...]:
    """Return the landmarks of a row as fractions of its clip.

    last: its last frame in the file. columns: of the landmarks. Raises RecipeError for a landmark
    out of the clip, and for two that do not rise.
    """
    columns_and_frames = [*zip(columns, row.landmarks, strict=True)]
    for column, frame in columns_and_frames:
        if not row.first_frame < frame < last:
            raise row.error(
                f"column {column!r}: frame {frame} is out of the clip, expected one between its "
                f"frames {row.first_frame} and {last} of {row.file.name}, without these two"
            )
    for (before, earlier), (column, later) in pairwise(columns_and_frames):
        if later <= earlier:
            raise row.error(
                f"column {column!r}: frame {later}, expected one after frame {earlier} of column "
                f"{before!r}, as in clips.landmarks"
            )
    return tuple((frame - row.first_frame) / (last - row.first_frame) for frame in row.landmarks)


def event_landmark(row: ClipRow, joint: str, at: str, share: float) -> float:
    """Return the share of the clip of a row at which its event is.

    Raises RecipeError for an end of the clip, which alignment cannot move.
    """
    if 0.0 < share < 1.0:
        return share
    end = "start" if share == 0.0 else "end"
    raise row.error(
        f"{joint} is {at} at the {end} of {row.file.name}, expected a moment within the clip: cut "
        f"it longer, set event.at to '{end}', or name a column of clips.landmarks"
    )


def expect_same_order(
    names: Sequence[str], rows: Sequence[ClipRow], landmarks: Sequence[tuple[float, ...]]
) -> None:
    """Raise RecipeError for a clip whose event lies between other landmarks than elsewhere.

    names: of the landmarks. landmarks: of each row, as shares of its clip.
    """
    expected = np.argsort(landmarks[0]).tolist()
    for row, marks in zip(rows, landmarks, strict=True):
        order = np.argsort(marks).tolist()
        if order != expected or len(set(marks)) < len(marks):
            listed = ", ".join(f"{names[mark]} at {marks[mark]:.0%}" for mark in order)
            raise row.error(
                f"found {listed} of {row.file.name}, expected the order of line "
                f"{rows[0].line}, {', '.join(names[i] for i in expected)}"
            )


def contact_spans(row: ClipRow, last: int, columns: Mapping[str, str]) -> dict[str, Spans]:
    """Return the contacts of a row by joint, first and last share of its clip.

    last: its last frame in the file. A contact lasts from half a frame before its first frame to
    half a frame behind its last.
    """
    first, steps = row.first_frame, last - row.first_frame
    return {
        joint: tuple(
            ((begin - 0.5 - first) / steps, (end + 0.5 - first) / steps)
            for begin, end in row.contacts[column]
        )
        for joint, column in columns.items()
    }
