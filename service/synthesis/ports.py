"""What the graph of a model file takes and gives, by name, and whether a file has it so."""

from typing import Any

import numpy as np

from service.motion.card import ModelCard
from service.motion.conventions import Floats
from service.motion.errors import ModelError

INPUTS = {"controls": 2, "time": 2}
PERFORMER, LEVEL = "performer", "level"
OUTPUTS = {
    "rotations": 4,
    "root_position": 3,
    "bone_offsets": 3,
    "duration": 1,
    "sigma": 1,
    "travel": 3,
}


def check(runtime: Any, card: ModelCard, source: str) -> None:
    """ModelError where onnxruntime's session of a file does not take or give what its card needs,
    at some level of detail; `source` names the file."""
    _check_ports(runtime, card, source)
    for level in range(len(card.levels)):
        _check_answer(runtime, card, source, level)


def middle(card: ModelCard) -> Floats:
    """Controls (1, d) in the middle of what was sampled."""
    return np.array([[control.default for control in card.controls]])


def _check_ports(runtime: Any, card: ModelCard, source: str) -> None:
    found = {p.name: len(p.shape) for p in runtime.get_inputs()}
    if found != INPUTS:
        raise ModelError(source, f"inputs (name: axes) {found}, expected {INPUTS}")
    found = {p.name: len(p.shape) for p in runtime.get_outputs()}
    if found != OUTPUTS:
        raise ModelError(source, f"outputs (name: axes) {found}, expected {OUTPUTS}")
    _check_options(runtime, card, source)


def _check_options(runtime: Any, card: ModelCard, source: str) -> None:
    """The graph takes a level, and as many labels as the card has names."""
    performers = len(card.performers)
    # onnxruntime lists inputs that have a default apart from the others.
    found = {p.name: p.shape[1:] for p in runtime.get_overridable_initializers()}
    expected: dict[str, list[Any]] = {PERFORMER: [performers]} if performers else {}
    expected |= {LEVEL: []}
    if found != expected:
        raise ModelError(source, f"optional inputs (name: width) {found}, expected {expected}")


def _check_answer(runtime: Any, card: ModelCard, source: str, level: int) -> None:
    """Ask for the pose in the middle: a file whose weights are damaged shows here."""
    feed = {"controls": middle(card).astype(np.float32), "time": np.zeros((1, 1), np.float32)}
    try:
        answers = runtime.run([*OUTPUTS], {**feed, LEVEL: np.array(level)})
    except Exception as fault:
        raise ModelError(source, f"does not run: {str(fault).splitlines()[0]}") from fault
    joints = len(card.skeleton)
    if answers[0].shape != (1, 1, joints, 4):
        raise ModelError(source, f"rotations {answers[0].shape}, expected (1, 1, {joints}, 4)")
    if not all(np.isfinite(answer).all() for answer in answers):
        raise ModelError(source, "answers with numbers that are not finite")
