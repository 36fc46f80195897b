"""Plans of people on tracks: steps along their paths, in the size of the model's body.

A person who is taller by a share walks a path that is shorter by it.
"""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Indices, PerCharacter
from posefield.locomotion.gait import Gait
from posefield.locomotion.locomotion_plan import LocomotionPlan
from posefield.performance import step_plan
from posefield.performance.standing_pose import Walker
from posefield.performance.step_plan import StepPlan, Strider
from posefield.tracks.track_path import TrackPath

KNOT_SECONDS = 0.2
"""Time between points at which controls are solved, s, with lines between."""


def find_striders(gait: Gait) -> tuple[Strider, ...]:
    """Return the strides of each combination of labels; the last one has none."""
    pairs = zip(gait.labels.weights, gait.performer_offsets, strict=True)
    return step_plan.find_striders([Walker(gait, row[None], offset, {}) for row, offset in pairs])


def plan_people(
    striders: Sequence[Strider],
    paths: Sequence[TrackPath],
    combinations: Annotated[Indices, "people"],
    draws: Annotated[Floats, "people"],
    scales: PerCharacter,
    rate: float,
) -> LocomotionPlan:
    """Return the plan of people (N) whose paths have equal lengths.

    combinations: of labels of each. draws: random numbers from 0 to 1, of the phase. scales:
    heights over those of the model.
    """
    gait, frames, plans = striders[0].walker.gait, len(paths[0]), list[StepPlan]()
    for path, labels, draw, scale in zip(paths, combinations, draws, scales, strict=True):
        body = path.points / scale, path.headings
        plans.append(step_plan.plan_steps(striders[labels], body, float(draw), rate))
    names = "speeds", "turning", "phases", "points", "headings"
    columns = {name: np.stack([getattr(plan, name) for plan in plans]) for name in names}
    knots = np.unique(np.append(np.arange(0, frames, max(1, int(KNOT_SECONDS * rate))), frames - 1))
    everyone = np.repeat(combinations, len(knots))
    solved = gait.controls(
        columns["speeds"][:, knots].ravel(), columns["turning"][:, knots].ravel(), everyone
    ).reshape(len(paths), len(knots), -1)
    at = np.interp(np.arange(frames), knots, np.arange(len(knots)))
    before = np.minimum(at.astype(np.int64), max(len(knots) - 2, 0))
    share = (at - before)[:, None]
    after = np.minimum(before + 1, len(knots) - 1)
    controls = (1.0 - share) * solved[:, before] + share * solved[:, after]
    return LocomotionPlan(
        controls,
        combinations,
        columns["phases"] % 1.0,
        columns["points"],
        columns["headings"],
        rate,
        gait.labels,
        step_plan.stepping_of(striders[0].walker, striders[0].poses, plans),
    )
