"""Constraints of a motion: measured quantities, their target values and gradients."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from posefield.common import cancellation
from posefield.common.units import Floats, Gradients, ReducedMotions, Values, Variables
from posefield.constraints.constrained_motion import (
    CYCLE_VARIABLES,
    ConstrainedMotion,
    MotionVariables,
)
from posefield.model_file.model_card import ModelCard
from posefield.motion import measures
from posefield.motion.measures import POSITION_AXES, TRAVEL_QUANTITIES, Measure, MeasuredMotion

ValuesAndGradients = tuple[Values, Gradients]
"""Values (k,), and their gradients (k, numbers) with respect to the numbers of the motion."""

SLOPE_STEP = 1e-5
"""Difference of a logarithm of seconds, of metres and of radians, for slopes of travel."""

StackedValues = Annotated[Floats, "motions values"]
StackedGradients = Annotated[Floats, "motions values variables"]
StackedVariables = Annotated[Floats, "motions variables"]


class Constraint(Protocol):
    """A measured quantity with a target value (k,)."""

    @property
    def names(self) -> tuple[str, ...]:
        """One name for all values, or one name for each."""

    @property
    def unit(self) -> str:
        """Unit of the values."""

    @property
    def target(self) -> Values:
        """Target values (k,)."""

    def evaluate(self, scene: MotionVariables, numbers: Variables) -> ValuesAndGradients:
        """Return the values of a motion and their gradients."""

    @property
    def kind(self) -> Hashable:
        """Return what constraints of several motions that are evaluated at once have in common."""

    def evaluate_many(
        self, scenes: Sequence[MotionVariables], numbers: StackedVariables
    ) -> tuple[StackedValues, StackedGradients]:
        """Return the values (M, k) of motions and their gradients (M, k, numbers)."""

    def evaluate_motions(
        self, scene: MotionVariables, numbers: Variables, motions: ReducedMotions
    ) -> Annotated[Floats, "motions values"]:
        """Return the values (n, k) of other reduced motions (n, r2 r1) at the moment of this one.

        All other numbers, such as the travel, are those of this motion.
        """


@dataclass(frozen=True)
class PositionConstraint:
    """Constraint on the mean position of joints at a moment, along some axes, m.

    names: one for all axes, or one each. moment: rule that determines the moment. axes: indices of
    the coordinates. target: values (k,). at: canonical frame, where the moment is a given one.
    """

    names: tuple[str, ...]
    moment: Measure
    axes: tuple[int, ...]
    target: Values
    at: float = 0.0
    unit: str = "m"

    def frame(self, last: float) -> float | None:
        """Return the moment's canonical frame, 0 to last; None if the motion determines it."""
        frames = {"start": 0.0, "end": last, "landmark": self.at}
        return frames.get(self.moment.at or "")

    def frame_of(self, scene: MotionVariables, numbers: Variables) -> float:
        """Return the canonical frame at which a motion has the moment."""
        return _moment_frame(scene, numbers, self.moment, self.at)

    def evaluate(self, scene: MotionVariables, numbers: Variables) -> ValuesAndGradients:
        """Return the values and their gradients."""
        joints = self.moment.joints
        at = self.frame_of(scene, numbers)
        pairs = [scene.position_and_gradient(numbers, joint, at) for joint in joints]
        values = np.mean([value for value, _ in pairs], axis=0)
        gradients = np.mean([gradient for _, gradient in pairs], axis=0)
        return values[list(self.axes)], gradients[list(self.axes)]

    @property
    def kind(self) -> Hashable:
        """Return what constraints have in common that are evaluated at once: these are alone."""
        return type(self), self.moment, (self.axes, self.at)

    def evaluate_many(
        self, scenes: Sequence[MotionVariables], numbers: StackedVariables
    ) -> tuple[StackedValues, StackedGradients]:
        """Return the values (M, k) of motions and their gradients (M, k, numbers)."""
        return _stacked([self.evaluate(*motion) for motion in zip(scenes, numbers, strict=True)])

    def evaluate_motions(
        self, scene: MotionVariables, numbers: Variables, motions: ReducedMotions
    ) -> Annotated[Floats, "motions values"]:
        """Return the values (n, k) of other motions."""
        at = self.frame_of(scene, numbers)
        positions = [
            scene.evaluate_motions(numbers, motions, joint, at) for joint in self.moment.joints
        ]
        return np.asarray(np.mean(positions, axis=0)[:, list(self.axes)], np.float64)


@dataclass(frozen=True)
class StepLengthConstraint:
    """Constraint on the step length: the largest distance of one foot ahead of the other, m."""

    names: tuple[str, ...]
    moment: Measure
    target: Annotated[Floats, "1"]
    unit: str = "m"

    def evaluate(self, scene: MotionVariables, numbers: Variables) -> ValuesAndGradients:
        """Return the value and its gradient."""
        at = _moment_frame(scene, numbers, self.moment, 0.0)
        first, second = (
            scene.position_and_gradient(numbers, joint, at) for joint in self.moment.joints
        )
        distance = first[0][2] - second[0][2]
        sign = 1.0 if distance >= 0.0 else -1.0
        return np.array([sign * distance]), sign * (first[1] - second[1])[2:]

    @property
    def kind(self) -> Hashable:
        """Return what constraints have in common that are evaluated at once: these are alone."""
        return type(self), self.moment, None

    def evaluate_many(
        self, scenes: Sequence[MotionVariables], numbers: StackedVariables
    ) -> tuple[StackedValues, StackedGradients]:
        """Return the values (M, k) of motions and their gradients (M, k, numbers)."""
        return _stacked([self.evaluate(*motion) for motion in zip(scenes, numbers, strict=True)])

    def evaluate_motions(
        self, scene: MotionVariables, numbers: Variables, motions: ReducedMotions
    ) -> Annotated[Floats, "motions 1"]:
        """Return the values (n, 1) of other motions."""
        at = _moment_frame(scene, numbers, self.moment, 0.0)
        first, second = (
            scene.evaluate_motions(numbers, motions, j, at) for j in self.moment.joints
        )
        return np.abs(first - second)[:, 2:]


@dataclass(frozen=True)
class TravelConstraint:
    """Constraint on the travel of a cycle: distance, m, speed, m/s, turn, degrees, or velocity."""

    names: tuple[str, ...]
    quantity: str
    target: Annotated[Floats, "1"]
    unit: str

    def evaluate(self, scene: MotionVariables, numbers: Variables) -> ValuesAndGradients:
        """Return the value and its gradient."""
        values, gradients = self.evaluate_many([scene], numbers[None])
        return values[0], gradients[0]

    @property
    def kind(self) -> Hashable:
        """Return what constraints have in common that are evaluated at once."""
        return type(self), self.quantity

    def evaluate_many(
        self, scenes: Sequence[MotionVariables], numbers: StackedVariables
    ) -> tuple[StackedValues, StackedGradients]:
        """Return the values (M, 1) of cycles and their gradients (M, 1, numbers)."""
        gradients = np.zeros((len(numbers), 1, numbers.shape[1]))
        steps = 0.5 * SLOPE_STEP * np.eye(CYCLE_VARIABLES)
        tried = np.vstack([np.zeros(CYCLE_VARIABLES), steps, -steps])[:, None]
        outer = (numbers[:, -CYCLE_VARIABLES:] + tried).reshape(-1, CYCLE_VARIABLES)
        values = measures.travel_values(self.quantity, outer[:, 1:], np.exp(outer[:, 0]))
        value, *ends = values.reshape(len(tried), -1)
        rises = np.subtract(ends[:CYCLE_VARIABLES], ends[CYCLE_VARIABLES:])
        gradients[:, 0, -CYCLE_VARIABLES:] = rises.T / SLOPE_STEP
        return value[:, None], gradients

    def evaluate_motions(
        self, scene: MotionVariables, numbers: Variables, motions: ReducedMotions
    ) -> Annotated[Floats, "motions 1"]:
        """Return the values (n, 1) of other motions: all equal, without their own travel."""
        return np.repeat(self.evaluate(scene, numbers)[0][None], len(motions), axis=0)


def evaluate(
    aims: Sequence[Constraint], scene: MotionVariables, numbers: Variables
) -> ValuesAndGradients:
    """Return the concatenated values and gradients of several constraints of one motion."""
    values, gradients = evaluate_many(aims, [scene], numbers[None])
    return values[0], gradients[0]


def evaluate_many(
    aims: Sequence[Constraint], scenes: Sequence[MotionVariables], numbers: StackedVariables
) -> tuple[StackedValues, StackedGradients]:
    """Return the values (M, k) and gradients (M, k, numbers) of several constraints of motions."""
    cancellation.check()
    pairs = [aim.evaluate_many(scenes, numbers) for aim in aims]
    values, gradients = zip(*pairs, strict=True)
    return np.concatenate(values, axis=1), np.concatenate(gradients, axis=1)


def _stacked(
    pairs: Sequence[ValuesAndGradients],
) -> tuple[StackedValues, StackedGradients]:
    """Return the values (M, k) and gradients (M, k, numbers) of motions."""
    values, gradients = zip(*pairs, strict=True)
    return np.stack(values), np.stack(gradients)


def from_controls(controls: Sequence[tuple[str, Measure, float]], frames: int) -> list[Constraint]:
    """Return the constraints of measured controls, given as name, measure and target value.

    frames: number of canonical frames. Positions of the same joints at the same moment become one
    constraint, so that its error is one distance.
    """
    aims: list[Constraint] = []
    values_by_moment: dict[Measure, list[tuple[str, int, float]]] = {}
    for name, measure, goal in controls:
        if measure.quantity in TRAVEL_QUANTITIES:
            aims.append(TravelConstraint((name,), measure.quantity, np.array([goal]), measure.unit))
        elif measure.quantity == "step_length":
            aims.append(StepLengthConstraint((name,), measure, np.array([goal])))
        else:
            moment = Measure("height", measure.joints, measure.at, measure.share)
            values_by_moment.setdefault(moment, []).append(
                (name, POSITION_AXES[measure.quantity], goal)
            )
    for moment, coordinates in values_by_moment.items():
        names, axes, goals = zip(*coordinates, strict=True)
        aims.append(
            PositionConstraint(
                names, moment, axes, np.array(goals), (moment.share or 0.0) * (frames - 1)
            )
        )
    return aims


def measured(card: ModelCard, motion: ConstrainedMotion) -> dict[str, float]:
    """Return the values of the card's measured controls on a motion."""
    scene, values, moving = motion.scene, dict[str, float](), []
    for control in card.controls:
        if control.measure and control.measure.is_body_measure:
            still = np.zeros((1, len(scene.parents), 3))
            body = MeasuredMotion(still, 0.0, np.zeros(3), scene.parents, scene.bones)
            values[control.name] = measures.evaluate(control.measure, body)
        elif control.measure:
            moving.append((control.name, control.measure, 0.0))
    for aim in from_controls(moving, scene.reduced.frames):
        numbers, _ = aim.evaluate_many([scene], motion.numbers[None])
        values |= dict(zip(aim.names, map(float, numbers[0]), strict=True))
    return {
        control.name: values[control.name] for control in card.controls if control.name in values
    }


def _moment_frame(
    scene: MotionVariables, numbers: Variables, measure: Measure, landmark: float
) -> float:
    """Return the canonical frame at which a quantity is measured.

    landmark: frame of a landmark.
    """
    last = scene.reduced.frames - 1
    if measure.at in ("start", "end", "landmark"):
        return {"start": 0.0, "end": float(last), "landmark": landmark}[measure.at]
    # Determined by the motion: at an extreme, the gradient at that frame equals the gradient of the
    # extreme.
    joints = measure.joints if measure.at != "farthest" else (0, *measure.joints)
    frames = np.arange(last + 1.0)
    positions = np.stack([scene.positions(numbers, joint, frames) for joint in joints], axis=1)
    if measure.at == "farthest":
        away = positions[:, 1:].mean(axis=1) - positions[:, 0]
        return float(np.argmax(np.sum(np.square(away), axis=-1)))
    local = Measure(measure.quantity, tuple(range(len(joints))), measure.at)
    return measures.moment_frame(local, positions, 0.0)
