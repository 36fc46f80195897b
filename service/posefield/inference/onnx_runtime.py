"""Sessions of onnxruntime, each on one thread of the CPU, and checks of their answers."""

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
import onnxruntime

from posefield.common.errors import ModelError
from posefield.common.units import Floats, Singles
from posefield.model_file.model_card import ModelCard


def open_session(content: bytes, source: str) -> Any:
    """Return a session on an ONNX file.

    Raises ModelError, which names `source` and onnxruntime's reason.
    """
    options = onnxruntime.SessionOptions()
    # A pose takes microseconds: the overhead of threads would exceed their gain.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    # An arena keeps the memory of the longest clip in each session and saves no time.
    options.enable_cpu_mem_arena = False
    chosen = ["CPUExecutionProvider"]
    try:
        return onnxruntime.InferenceSession(content, options, providers=chosen, enable_fallback=0)
    except Exception as fault:  # onnxruntime's exceptions share no base of their own
        raise ModelError(source, f"onnxruntime cannot load it: {first_line(fault)}") from fault


def first_line(fault: Exception) -> str:
    """Return the first line of an exception's message, or its class where it has none."""
    return next(iter(str(fault).strip().splitlines()), type(fault).__name__)


TRIED_CLIPS, TRIED_TIMES = 16, 5
"""Captured clips and times, evenly spaced, whose answers are checked at opening."""
LENGTHENED = 4.0
"""Factor between the duration of such an answer and the captured ones."""
FASTEST, UNIT_TOLERANCE = 20.0, 1e-3
"""Largest speed of a root, m/s, and deviation of a quaternion's length from 1."""
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
    """Check poses at some times of some clips; more than one of each reveals mixed-up axes."""
    some = np.unique(np.linspace(0, len(card.examples) - 1, TRIED_CLIPS, dtype=int))
    points = np.vstack([default_controls(card), np.array(card.examples)[some]]).astype(np.float32)
    times = np.tile(
        np.linspace(0.0, card.durations[0], TRIED_TIMES, dtype=np.float32), (len(points), 1)
    )
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
    _check_bounds(answers, card, source)


def _check_bounds(answers: Mapping[str, Singles], card: ModelCard, source: str) -> None:
    """Raise ModelError for answers at captured clips that no motion of this skeleton has."""
    short, long = card.durations
    size = float(np.linalg.norm(card.skeleton.offsets, axis=1).sum())
    far = size + FASTEST * long
    bounds = {
        "duration": (short / LENGTHENED, long * LENGTHENED, "s"),
        "sigma": (0.0, far, "m"),
        "root_position": (-far, far, "m"),
        "travel": (-far, far, "m"),
        "bone_offsets": (-size, size, "m"),
    }
    for name, (low, high, unit) in bounds.items():
        values = answers[name]
        if not ((values >= low) & (values <= high)).all():
            worst = values.flat[np.argmax(np.maximum(low - values, values - high))]
            raise ModelError(
                source, f"its {name} is {worst:.3g} {unit}, expected {low:.3g} to {high:.3g} {unit}"
            )
    if not answers["sigma"].any():
        raise ModelError(source, "its sigma is 0 at all captured clips, expected more")
    sizes = np.linalg.norm(answers["rotations"], axis=-1)
    if not (np.abs(sizes - 1.0) < UNIT_TOLERANCE).all():
        raise ModelError(source, "its rotations are not of length 1, expected unit quaternions")


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
