"""Parity check of a model file: its session against the float64 reference, at random inputs.

The file runs in the service's own session, and joints are compared in metres.
"""

from dataclasses import dataclass

import numpy as np

from posefield.common.errors import ExportRefused
from posefield.common.units import Floats
from posefield.inference import graph_ports, session
from posefield.inference.session import Session
from posefield.model_file.model_card import ModelCard
from posefield_train.graph.float_model import FloatModel, ModelOutputs
from posefield_train.kriging import thinning

POINTS, BATCH = 10_000, 1_000
# Largest distance of a joint of the graph from the reference's, m.
PARITY_LIMIT = 1e-4
# Largest difference of the probability of a contact.
CONTACT_LIMIT = 2e-3


def check_parity(model: FloatModel, content: bytes, own_card: ModelCard) -> float:
    """Return the largest joint distance, m, between file and reference at random inputs.

    Every level is checked. Raises ExportRefused, naming the joint and the input, if the distance
    exceeds PARITY_LIMIT.
    """
    opened = session.open_bytes(content, f"{own_card.name}.onnx")
    rng = np.random.Generator(np.random.PCG64(10_000))
    worst = 0.0
    for question in range(POINTS // BATCH):
        asked = _draw_inputs(rng, model, own_card, question % len(own_card.levels))
        gaps = _joint_distances(model, opened, asked)
        _check_contacts(model, opened, asked)
        at = np.unravel_index(int(np.argmax(gaps)), gaps.shape)
        worst = max(worst, float(gaps[at]))
        if worst > PARITY_LIMIT:
            named = [*own_card.skeleton.names, *(curve.name for curve in own_card.curves)]
            raise ExportRefused(
                f"the graph puts {named[at[2]]} {100 * worst:.4f} cm from where "
                f"the reference does, expected at most {100 * PARITY_LIMIT:g} cm; at "
                f"{asked.said(own_card, int(at[0]))}. Fewer controls, or a larger nugget, "
                "condition it better"
            )
    return worst


@dataclass(frozen=True)
class _ParityInputs:
    """Inputs of the parity check.

    points: controls (B, d) in their own units. times: (B, 1), s. labels: (B, p). level: of detail.
    All are float32 values, the only ones that the graph can receive.
    """

    points: Floats
    times: Floats
    labels: Floats
    level: int

    def said(self, own_card: ModelCard, row: int) -> str:
        """Describe one of the inputs in words."""
        controls = (control.name for control in own_card.controls)
        point = dict(zip(controls, self.points[row].tolist(), strict=True))
        names = [name for own in own_card.labels for name in own.names]
        who = "".join(f"{names[i]}, " for i in np.flatnonzero(self.labels[row]))
        return f"{who}{point}, {self.times[row, 0]:.3f} s, level {self.level}"


def _draw_inputs(
    rng: np.random.Generator, model: FloatModel, own_card: ModelCard, level: int
) -> _ParityInputs:
    """Draw random controls, labels and times of their clips.

    In each label set no name is as likely as each of the names.
    """
    low, high = ([getattr(c, end) for c in own_card.controls] for end in ("minimum", "maximum"))
    points = rng.uniform(low, high, (BATCH, len(low))).astype(np.float32).astype(np.float64)
    drawn = thinning.random_labels(rng, model.bank.labels, BATCH)
    labels = np.hstack([np.zeros((BATCH, 0)), *drawn])
    durations = model.durations(points, labels)
    times = rng.uniform(0.0, 1.0, (BATCH, 1)) * durations[:, None]
    return _ParityInputs(points, times.astype(np.float32).astype(np.float64), labels, level)


def _joint_distances(model: FloatModel, opened: Session, asked: _ParityInputs) -> Floats:
    """Return distances (B, 1, J + C), m, between joints and curves of graph and reference."""
    question, card = (asked.points, asked.times), opened.card
    parents, names = card.skeleton.parents, graph_ports.outputs(card)
    expected = model.evaluate(*question, asked.labels, asked.level).points(parents, card.curves)
    answers = opened.run(*question, *names, labels=asked.labels, level=asked.level)
    found = ModelOutputs(*answers).points(parents, card.curves)
    return np.asarray(np.linalg.norm(found - expected, axis=-1))


def _check_contacts(model: FloatModel, opened: Session, asked: _ParityInputs) -> None:
    """Raise ExportRefused where the graph's contacts differ from the reference's."""
    question, level = (asked.points, asked.times), asked.level
    expected = model.evaluate(*question, asked.labels, level).contacts
    if expected is None:
        return
    (found,) = opened.run(*question, graph_ports.CONTACTS, labels=asked.labels, level=level)
    gaps = np.abs(found - expected)
    if gaps.max() > CONTACT_LIMIT:
        row = int(np.unravel_index(int(np.argmax(gaps)), gaps.shape)[0])
        raise ExportRefused(
            f"the graph's probability of a contact is {gaps.max():.5f} off the reference's, "
            f"expected at most {CONTACT_LIMIT:g}; at {asked.said(opened.card, row)}"
        )
