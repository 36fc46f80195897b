"""Checks of a whole family before it is trained: controls of one value, motions all the same."""

from collections.abc import Sequence

import numpy as np

from posefield.common.errors import TrainingError
from posefield_train.source import measured_controls
from posefield_train.source.control_sources import Auto, Control, ControlMeasured
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

LEAST_RANGE = 10.0**-measured_controls.DECIMALS * 10
"""Range of a measured control below which its values differ by rounding only, in its unit."""
SAME_MOTION = 1e-6
"""Largest distance between joints of motions that are the same, m."""


def check_family(recipe: Recipe, examples: Sequence[Example]) -> None:
    """Raise TrainingError for a control with one value, with its cause, and for equal motions."""
    if len(examples) < 2:
        return
    for index, control in enumerate(recipe.controls):
        values = np.array([example.controls[index] for example in examples])
        measured = isinstance(control, ControlMeasured)
        if np.ptp(values) <= (LEAST_RANGE if measured else 0.0):
            raise TrainingError(
                f"control {control.name!r} has the value {values[0]:g} in all {len(values)} "
                f"samples, expected at least two values; {_cause(recipe, control)}; leave it out "
                "of the recipe, or add clips that differ in it"
            )
    if _all_equal(examples):
        raise TrainingError(
            f"all {len(examples)} clips have the same motion, expected motions that differ with "
            f"their controls: check column {recipe.clips.file!r} of the table and its frames"
        )


def _all_equal(examples: Sequence[Example]) -> bool:
    first = examples[0].clip
    whole = first.positions()
    return all(
        len(example.clip) == len(first)
        and bool(np.all(np.abs(example.clip.positions() - whole) < SAME_MOTION))
        for example in examples[1:]
    )


def _cause(recipe: Recipe, control: Control) -> str:
    """Return the reason for which a control has the same value in all clips."""
    if isinstance(control, ControlMeasured):
        return _measured_cause(recipe, control.auto)
    column = f"column {control.column!r} holds it in every row"
    if control.column in recipe.clips.where:
        return f"{column} that [clips.where] lets pass by this column"
    return f"{column} that [clips.where] lets pass" if recipe.clips.where else column


def _measured_cause(recipe: Recipe, auto: Auto) -> str:
    if auto.quantity in ("leg_length", "stature"):
        return f"{auto.quantity} is of the performer, and all clips have bones of the same size"
    if auto.quantity in ("left", "forward", "turn") and auto.at == "start":
        return "each clip begins at the origin, so that a root is there in all of them"
    if auto.quantity in ("left", "forward") and recipe.motion.root == "in_place":
        return "motion.root = 'in_place' takes the travel away"
    where = f" of {' and '.join(auto.joint_names)}" if auto.joint_names else ""
    when = f" at {auto.at}" if auto.at else ""
    return f"{auto.quantity}{where}{when} is measured, and no clip differs in it"
