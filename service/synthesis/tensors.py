"""The graph asked as it is: tensors of controls and times in, tensors of its outputs out.

What it is asked passes the same limits as a question for poses, in columns.
"""

from dataclasses import dataclass

import numpy as np

from service.motion.card import ModelCard
from service.motion.conventions import Singles
from service.motion.errors import InvalidField, OutsideSamples
from service.synthesis import limits
from service.synthesis.ports import PERFORMER
from service.synthesis.session import Session

# Poses of a call: more leave a core's cache between one operator and the next.
BATCH = 1536
# Of a clip's duration: what float32 makes of a time that was read from an answer.
SLACK = 1e-5


@dataclass(frozen=True)
class TensorQuestion:
    """Controls (B, d) in the card's order, times (B, S), s, labels (B or 1, p) and a level of
    detail; without labels, nobody that was seen."""

    controls: Singles
    times: Singles
    labels: Singles | None = None
    level: int = 0


def outside(card: ModelCard, controls: Singles) -> list[str]:
    """A sentence for each control that some rows have outside what was sampled."""
    said = []
    for control, column in zip(card.controls, controls.T, strict=True):
        low, high = limits.sampled(control)
        # A bound that a client read from the card, as float32 has it, is not outside.
        count = np.count_nonzero((column < np.float32(low)) | (column > np.float32(high)))
        if count:
            sampled = f"{control.minimum:g} to {control.maximum:g} {control.unit}"
            said.append(f"{control.name} of {count} rows lies outside what was sampled, {sampled}")
    return said


def ask(session: Session, question: TensorQuestion, outputs: tuple[str, ...]) -> list[Singles]:
    """The outputs, in the order asked for, each with B rows.

    Raises InvalidField, with the name of the tensor at fault, for a shape or a number that the
    graph cannot take, OutsideSamples where extrapolation has lost all sense.
    """
    card = session.card
    _check_shapes(card, question)
    _check_numbers(card, question)
    rows = max(1, BATCH // question.times.shape[1])
    starts = range(0, len(question.controls), rows)
    parts = [_part(session, question, slice(at, at + rows), outputs) for at in starts]
    return [np.concatenate(column) for column in zip(*parts, strict=True)]


def _part(
    session: Session, question: TensorQuestion, rows: slice, outputs: tuple[str, ...]
) -> list[Singles]:
    labels = question.labels
    if labels is not None and len(labels) > 1:
        labels = labels[rows]
    controls, times = question.controls[rows], question.times[rows]
    durations = session.durations(controls, labels, question.level)
    _check_times(session.card, times, durations, rows.start)
    return session.run(controls, times, *outputs, labels=labels, level=question.level)


def _check_shapes(card: ModelCard, question: TensorQuestion) -> None:
    count, known = len(question.controls), len(card.performers)
    _expect("controls", question.controls, ((count, len(card.controls)),))
    _expect("time", question.times, ((count, question.times.shape[-1]),))
    if question.labels is not None:
        _expect(PERFORMER, question.labels, ((count, known), (1, known)))


def _expect(name: str, tensor: Singles, shapes: tuple[tuple[int, ...], ...]) -> None:
    if tensor.shape not in shapes or not tensor.size:
        expected = " or ".join(str(list(shape)) for shape in shapes)
        raise InvalidField(name, f"shape {list(tensor.shape)}, expected {expected}, not empty")


def _check_numbers(card: ModelCard, question: TensorQuestion) -> None:
    low, high = np.array([limits.reach(control) for control in card.controls]).T
    units = [control.unit for control in card.controls]
    _within("controls", question.controls, low, high, units)
    _within("time", question.times, 0.0, np.inf, ["s"])
    if question.labels is not None:
        _within(PERFORMER, question.labels, 0.0, 1.0, [""])
    if not 0 <= question.level < len(card.levels):
        raise InvalidField("level", f"{question.level}, expected 0 to {len(card.levels) - 1}")


def _within(
    name: str, tensor: Singles, low: np.ndarray | float, high: np.ndarray | float, units: list[str]
) -> None:
    """InvalidField for the first number that is not from low to high, or no number at all."""
    bad = np.argwhere(~((tensor >= low) & (tensor <= high) & np.isfinite(tensor)))
    if len(bad):
        place = tuple(bad[0].tolist())
        least, most = (np.broadcast_to(bound, tensor.shape)[place] for bound in (low, high))
        unit = units[place[-1] % len(units)]
        found = f"{list(place)} is {tensor[place]:g} {unit}".rstrip()
        raise InvalidField(name, f"{found}, expected {least:g} to {most:g} {unit}".rstrip())


def _check_times(card: ModelCard, times: Singles, durations: Singles, first: int) -> None:
    low, high = limits.durations(card)
    senseless = ~((durations >= low) & (durations <= high))
    if senseless.any():
        row = int(np.argmax(senseless))
        said = limits.senseless(card, float(durations[row]))
        raise OutsideSamples("controls", f"row {first + row} is {said}")
    late = np.argwhere(times > durations[:, None] * (1.0 + SLACK))
    if len(late):
        row, column = late[0].tolist()
        found = f"[{first + row}, {column}] is {times[row, column]:g} s"
        raise InvalidField("time", f"{found}, expected 0 to {durations[row]:g} s")
