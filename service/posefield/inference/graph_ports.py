"""Inputs and outputs of a model's graph by name, and a check of the graph's answers."""

from typing import Annotated, Any

import numpy as np

from posefield.common.errors import ModelError
from posefield.common.units import Floats
from posefield.inference.onnx_runtime import first_line
from posefield.model_file.model_card import ModelCard

LABELS, LEVEL = "labels", "level"
OUTPUTS = {
    "rotations": 4,
    "root_position": 3,
    "bone_offsets": 3,
    "duration": 1,
    "sigma": 1,
    "travel": 3,
}


CURVES = "curves"
"""Output of a model with curves."""
CONTACTS = "contacts"
"""Output of a model with contacts; only sessions that are asked for it compute it."""


def outputs(card: ModelCard) -> tuple[str, ...]:
    """Return the names of the outputs of a card's graph, but for the contacts."""
    return (*OUTPUTS, CURVES) if card.curves else tuple(OUTPUTS)


def all_outputs(card: ModelCard) -> tuple[str, ...]:
    """Return the names of all outputs of a card's graph."""
    return (*outputs(card), CONTACTS) if card.contacts else outputs(card)


def check(runtime: Any, card: ModelCard, source: str) -> None:
    """Check the answers of an onnxruntime session at each level of detail.

    Raises ModelError, which names `source`, where inputs or outputs do not fit the card.
    """
    for level in range(len(card.levels)):
        _check_outputs(runtime, card, source, level)


def default_controls(card: ModelCard) -> Annotated[Floats, "1 controls"]:
    """Return the controls (1, d) at their defaults."""
    return np.array([[control.default for control in card.controls]])


def _check_outputs(runtime: Any, card: ModelCard, source: str, level: int) -> None:
    """Check poses at three times of two clips; two rows and three times reveal mixed-up axes."""
    points = np.vstack([default_controls(card), card.examples[0]]).astype(np.float32)
    times = np.tile(np.linspace(0.0, card.durations[0], 3, dtype=np.float32), (2, 1))
    feed = {"controls": points, "time": times, LEVEL: np.array(level)}
    if card.labels:
        feed[LABELS] = np.eye(1, sum(card.label_counts), dtype=np.float32)
    try:
        names = all_outputs(card)
        answers = dict(zip(names, runtime.run([*names], feed), strict=True))
    except Exception as fault:  # onnxruntime's exceptions share no base of their own
        raise ModelError(source, f"does not run: {first_line(fault)}") from fault
    for name, shape in _shapes(len(points), times.shape[1], card).items():
        if answers[name].shape != shape:
            raise ModelError(source, f"{name} {answers[name].shape}, expected {shape}")
        if not np.isfinite(answers[name]).all():
            raise ModelError(source, f"its {name} are not finite numbers")
    if card.contacts and not ((answers[CONTACTS] >= 0.0) & (answers[CONTACTS] <= 1.0)).all():
        raise ModelError(source, f"its {CONTACTS} are not probabilities, expected 0 to 1")
    if not (answers["duration"] > 0.0).all():
        raise ModelError(source, f"its duration is {answers['duration'].min()} s, expected above 0")


def _shapes(rows: int, times: int, card: ModelCard) -> dict[str, tuple[int, ...]]:
    joints = len(card.skeleton)
    curves = {CURVES: (rows, times, len(card.curves))} if card.curves else {}
    contacts = {CONTACTS: (rows, times, len(card.contacts))} if card.contacts else {}
    return {
        **curves,
        **contacts,
        "rotations": (rows, times, joints, 4),
        "root_position": (rows, times, 3),
        "bone_offsets": (rows, joints, 3),
        "duration": (rows,),
        "sigma": (rows,),
        "travel": (rows, times, 3),
    }
