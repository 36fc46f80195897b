"""One walker: the gait of a model with one set of labels, and controls at requested rates."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common.errors import InvalidField, did_you_mean
from posefield.common.units import Floats, Indices, PerPoint, PointControls, PointLabels
from posefield.locomotion import floor_plane, stride
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.gait import ITERATIONS, Gait, requested_labels
from posefield.locomotion.stride import Strides
from posefield.model_file.model_card import ModelCard
from posefield.motion import skeleton
from posefield.question.motion_question import LabelValue, check_number, check_range
from posefield.synthesis import walking_feet
from posefield.validation.question_validation import label_weights

# Phases at which a cycle is averaged, and at which its feet are measured.
AVERAGED_PHASES, MEASURED_PHASES = 16, 60
# Largest deviation from the requested speed with given controls, as a share.
SPEED_TOLERANCE = 0.03


WalkerKey = tuple[str, bytes, bytes, tuple[tuple[int, float], ...]]


@dataclass(frozen=True)
class Walker:
    """One walker.

    weights: of the labels (1, p). offset: residual (d,) of the controls of its labels. given:
    values of controls by column.
    """

    gait: Gait
    weights: Annotated[Floats, "1 labels"]
    offset: Annotated[Floats, "controls"]
    given: Mapping[int, float]

    @property
    def card(self) -> ModelCard:
        """Card of the model."""
        return self.gait.session.card

    @property
    def key(self) -> WalkerKey:
        """Key of values that follow from the walker alone."""
        controls = tuple(sorted(self.given.items()))
        return self.gait.session.digest, self.weights.tobytes(), self.offset.tobytes(), controls

    def is_same(self, other: "Walker") -> bool:
        """Return whether another walker has the same labels and given controls."""
        same = self.gait.session is other.gait.session and dict(self.given) == dict(other.given)
        return same and bool(np.array_equal(self.weights, other.weights))

    def labels(self, count: int) -> PointLabels:
        """Return the weights (B, p) of the labels of B rows."""
        return np.repeat(self.weights, count, axis=0)

    def strides(self, controls: PointControls, level: int = 0) -> Strides:
        """Return the cycles of controls (B, d)."""
        return stride.strides(self.gait.session, controls, self.labels(len(controls)), level)

    def controls(self, speeds: PerPoint, turning: PerPoint) -> PointControls:
        """Return the controls (B, d) that lead to speeds (B,), m/s, and turning (B,), rad/s.

        Raises InvalidField if the given controls do not let the model walk at these speeds.
        """
        speed, turn = speeds, turning
        for _ in range(ITERATIONS):
            done = self.strides(self._mean_controls(speed, turn))
            speed, turn = speed + speeds - done.speeds, turn + turning - done.turning
        controls = self._mean_controls(speed, turn)
        if self.given:
            self._check_speeds(speeds, controls)
        return controls

    def _mean_controls(self, speeds: PerPoint, turning: PerPoint) -> PointControls:
        unseen = np.full(len(speeds), -1)
        controls = self.gait.mean_controls(speeds, turning, unseen) + self.offset
        for column, value in self.given.items():
            controls[:, column] = value
        return controls

    def _check_speeds(self, expected: PerPoint, controls: PointControls) -> None:
        speeds = self.strides(controls).speeds
        at = int(np.argmax(np.abs(speeds - expected)))
        if abs(speeds[at] - expected[at]) > SPEED_TOLERANCE * expected[at]:
            names = [self.card.controls[column].name for column in self.given]
            raise InvalidField(
                f"controls/{names[0]}",
                f"with it the model walks at {speeds[at]:.2f} m/s where {expected[at]:.2f} m/s is "
                "asked for; expected other controls than those of speed and turning",
            )

    def mean_offsets(self, controls: PointControls) -> Annotated[FloorVectors, "points"]:
        """Return the mean places (B,) of the root over a cycle, in the frame that travels."""
        phases = np.arange(AVERAGED_PHASES) / AVERAGED_PHASES
        labels = self.labels(len(controls))
        roots = stride.root_places(self.gait.session, controls, labels, phases)
        return np.asarray(roots.mean(axis=1))

    @cached_property
    def slowest(self) -> Annotated[Floats, "1 controls"]:
        """Controls (1, d) of the slowest walk straight ahead."""
        return self._mean_controls(np.array([self.gait.region.speeds[0]]), np.zeros(1))

    @cached_property
    def double_supports(self) -> Annotated[Floats, "phases"]:
        """Phases at which all feet stand, at the slowest speed: one in each half of the cycle.

        They are where the smallest probability of a contact is largest, or, for a model without
        contacts, where the fastest foot is slowest. Empty for a model without feet.
        """
        if not self.card.feet:
            return np.zeros(0)
        controls, phases = self.slowest, np.arange(MEASURED_PHASES) / MEASURED_PHASES
        by_contacts = len(walking_feet.foot_contacts(self.card)) > 1
        values = self._swings(controls, phases) if by_contacts else self._paces(controls, phases)
        return phases[_lowest(values)]

    def _swings(
        self, controls: Annotated[Floats, "1 controls"], phases: Annotated[Floats, "phases"]
    ) -> Annotated[Floats, "phases"]:
        """Return the largest probability (B,) that a foot does not stand, at phases (B,)."""
        columns = [
            self.card.contacts.index(contact) for contact in walking_feet.foot_contacts(self.card)
        ]
        rows, labels = np.repeat(controls, len(phases), axis=0), self.labels(len(phases))
        session = self.gait.session
        likely = stride.contact_probabilities(session, rows, labels, phases)
        return np.asarray(1.0 - likely[:, columns].min(axis=1))

    def _paces(
        self, controls: Annotated[Floats, "1 controls"], phases: Annotated[Floats, "phases"]
    ) -> Annotated[Floats, "phases"]:
        """Return the distances (B,), m, of the fastest foot from phases (B,) to the next ones."""
        rows, labels = np.repeat(controls, len(phases), axis=0), self.labels(len(phases))
        session, done = self.gait.session, self.strides(controls)
        posed = stride.synthesize_poses(session, rows, labels, phases)
        roots = posed.places + phases * done.travels[0]
        bones = stride.bones(session, controls, self.labels(1)).astype(float)
        local = skeleton.translations(bones, floor_plane.at_height(roots, posed.heights)[None])
        joints = skeleton.positions(self.card.skeleton.parents, posed.rotations[None], local)[0]
        feet = floor_plane.project(joints[:, list(self.card.feet)])
        after = np.vstack([feet[1:], feet[:1] + done.travels[0]])
        return np.asarray(np.abs(after - feet).max(axis=1))


def _lowest(values: Annotated[Floats, "phases"]) -> Annotated[Indices, "some"]:
    """Return the places of the lowest local minima of a cycle, more than a quarter apart."""
    half = len(values) / 2.0
    minima = (values <= np.roll(values, 1)) & (values < np.roll(values, -1))
    chosen: list[int] = []
    for index in sorted(np.flatnonzero(minima).tolist(), key=lambda index: float(values[index])):
        distances = [abs((index - one + half) % (2.0 * half) - half) for one in chosen]
        if len(chosen) < 2 and all(gap > 0.5 * half for gap in distances):
            chosen.append(index)
    return np.array(sorted(chosen), dtype=np.int64)


def find_walker(
    gait: Gait, labels: Mapping[str, LabelValue], controls: Mapping[str, float]
) -> Walker:
    """Return the walker with names or weights by label set, and given controls by name.

    Raises InvalidField for labels and controls that the model does not have.
    """
    card = gait.session.card
    weights = label_weights(card, None, labels)
    names = [control.name for control in card.controls]
    given_controls = {}
    for name, value in controls.items():
        field = f"controls/{name}"
        if name not in names:
            problem = f"unknown control{did_you_mean(name, names)}"
            raise InvalidField(field, f"{problem}, expected one of {', '.join(names)}")
        bounds = card.controls[names.index(name)]
        number = check_number(field, value)
        check_range(field, number, bounds.minimum, bounds.maximum, bounds.unit)
        given_controls[names.index(name)] = number
    # The mean residual of the controls for the labels; zeros for none.
    offset = np.zeros(gait.performer_offsets.shape[1])
    shares = requested_labels(card, labels).shares if labels else None
    if shares is not None and shares.any():
        offset = np.asarray(shares @ gait.performer_offsets[:-1] / max(1.0, shares.sum()))
    return Walker(gait, weights, offset, given_controls)
