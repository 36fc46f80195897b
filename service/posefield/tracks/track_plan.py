"""Plans of people on tracks: steps along their paths, in the size of the model's body.

A person who is taller by a share walks a path that is shorter by it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Indices, PerCharacter
from posefield.locomotion.gait import Gait
from posefield.locomotion.locomotion_plan import LocomotionPlan
from posefield.locomotion.stepping import StandingPoses
from posefield.performance import step_plan
from posefield.performance.standing_pose import Walker
from posefield.performance.step_plan import StepPath, StepPlan, Strider
from posefield.tracks.track_path import TrackPath

KNOT_SECONDS = 0.2
"""Time between points at which controls are solved, s, with lines between."""


@dataclass(frozen=True)
class TrackWalkers:
    """Walkers of a model whose people follow tracks, by combination of labels."""

    gait: Gait

    @cached_property
    def walkers(self) -> tuple[Walker, ...]:
        """Walker of each combination of labels; the last one has none."""
        weights = self.gait.labels.weights
        return tuple(
            Walker(self.gait, weights[index : index + 1], self.gait.performer_offsets[index], {})
            for index in range(len(weights))
        )

    @cached_property
    def striders(self) -> tuple[Strider, ...]:
        """Strides of each combination of labels."""
        return tuple(step_plan.find_strider(walker) for walker in self.walkers)

    @cached_property
    def standing(self) -> StandingPoses | None:
        """Standing poses of all combinations; None for a model without two feet."""
        return step_plan.find_standing_poses(self.walkers)


def plan_people(
    walkers: TrackWalkers,
    paths: Sequence[TrackPath],
    combinations: Annotated[Indices, "people"],
    numbers: Annotated[Floats, "people 2"],
    scales: PerCharacter,
    rate: float,
) -> LocomotionPlan:
    """Return the plan of people (N) whose paths have equal lengths.

    combinations: of labels of each. numbers: random ones from 0 to 1, of the phase and of the
    sway. scales: heights over those of the model.
    """
    gait, frames = walkers.gait, len(paths[0])
    plans = [
        _plan_person(walkers, path, int(combination), draw, scale, rate)
        for path, combination, draw, scale in zip(
            paths, combinations, numbers, scales.tolist(), strict=True
        )
    ]
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
    steps = None
    if walkers.standing is not None:
        steps = step_plan.stepping_of(plans, walkers.standing, gait.session.card.skeleton.parents)
    return LocomotionPlan(
        controls,
        combinations,
        columns["phases"] % 1.0,
        columns["points"],
        columns["headings"],
        rate,
        gait.labels,
        steps,
    )


def _plan_person(
    walkers: TrackWalkers,
    path: TrackPath,
    labels: int,
    numbers: Annotated[Floats, "2"],
    scale: float,
    rate: float,
) -> StepPlan:
    poses = walkers.standing
    standing = None if poses is None else (poses, labels)
    scaled = StepPath(path.points / scale, path.velocities / scale, path.headings)
    plan = step_plan.plan_steps(walkers.striders[labels], standing, scaled, float(numbers[0]), rate)
    sway = step_plan.waves(len(path), rate, 2, int(numbers[1] * 2**31)) @ step_plan.SWAY
    sway *= plan.shares**2 * np.exp(1j * plan.headings)
    return replace(plan, points=plan.points + sway)
