"""A checked model file opened in onnxruntime, whose answers are bounded outside the sampled ranges.

Trends of the model are not followed without end: a control acts as if it were at most a quarter of
its range outside the sampled one, and a clip is at most a quarter shorter or longer than the
captured ones. Within the sampled ranges nothing is bounded.

onnxruntime computes whatever a session holds, asked for or not, so that each set of values that
the program asks for has a session of its own, opened at first use. The sets are those of the
program's calls, never of a request.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as field_of
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np

from posefield.common.units import (
    Bones,
    Booleans,
    Floats,
    Frames,
    Indices,
    PerControl,
    PointControls,
    Singles,
    Vector,
)
from posefield.inference import onnx_runtime, reduced_motion
from posefield.inference.onnx_runtime import CONTACTS, LABELS
from posefield.inference.trial_process import DEFAULT_LIMITS, TrialLimits
from posefield.kriging import support
from posefield.kriging.kriging_model import KrigingWeights
from posefield.model_file import checked_file, onnx_file
from posefield.model_file.model_card import ROW_VALUES, Control, ModelCard

MARGIN = 0.25
"""Margin of controls, as a share of the sampled range, and of durations, as a share of the captured
ones. Measured on three families of captured motion and the procedural one: up to 0.15 of the range
outside the samples, supported answers last 0.93 times the shortest to 1.25 times the longest
captured clip; paths of walking crowds need controls up to 0.2 of a range outside.
"""
SLACK = 1e-6
"""Share of the range that a control inside it may lie outside by rounding."""

DURATION = ROW_VALUES["duration"]
"""Value of the graph that is one where times are phases of a clip."""

SinglePoints = Annotated[Singles, "points controls"]
SingleValues = Annotated[Singles, "points"]


@dataclass(frozen=True)
class AnswerBounds:
    """Bounds of a model's answers.

    low, high (d,): sampled range of each control. durations: shortest and longest captured clip, s.
    """

    low: PerControl
    high: PerControl
    durations: tuple[float, float]

    @cached_property
    def _inside(self) -> tuple[PerControl, PerControl]:
        slack = SLACK * (self.high - self.low)
        return self.low - slack, self.high + slack

    @cached_property
    def limits(self) -> tuple[PerControl, PerControl]:
        """Smallest and largest value (d,) at which each control acts."""
        room = MARGIN * (self.high - self.low)
        return self.low - room, self.high + room

    @property
    def duration_limits(self) -> tuple[float, float]:
        """Smallest and largest duration, s, of an answer outside the sampled ranges.

        The duration at the nearest controls inside the ranges is never outside the limits.
        """
        return self.durations[0] * (1.0 - MARGIN), self.durations[1] * (1.0 + MARGIN)

    def is_inside(self, controls: PointControls | SinglePoints) -> bool:
        """Return whether all controls (B, d) lie within the sampled ranges."""
        low, high = self._inside
        return bool(((controls >= low) & (controls <= high)).all())

    def outside(self, controls: PointControls | SinglePoints) -> Annotated[Booleans, "points"]:
        """Return whether a control of each row (B, d) lies outside its sampled range, (B,)."""
        low, high = self._inside
        return np.asarray(((controls < low) | (controls > high)).any(axis=1))

    def limit(
        self,
        controls: Annotated[Floats, "*points controls"] | Annotated[Singles, "*points controls"],
    ) -> Annotated[Floats, "*points controls"] | Annotated[Singles, "*points controls"]:
        """Return the controls (..., d) at which the answer is computed; inside the limits the same.

        Keeps the type of the numbers.
        """
        low, high = (limit.astype(controls.dtype) for limit in self.limits)
        return np.asarray(np.clip(controls, low, high))

    def nearest_sampled(self, controls: PointControls | SinglePoints) -> PointControls:
        """Return the nearest controls (B, d) inside the sampled ranges."""
        return np.clip(controls.astype(np.float64), self.low, self.high)

    def limit_durations(self, durations: SingleValues, nearest: SingleValues) -> SingleValues:
        """Return durations (B,), s, limited to the margin about the captured ones.

        nearest (B,): durations at the nearest controls inside the sampled ranges, which may lie
        further out where a combination of controls was never captured.
        """
        shortest, longest = np.array(self.duration_limits, durations.dtype)
        low, high = np.minimum(shortest, nearest), np.maximum(longest, nearest)
        return np.clip(durations, low, high)


def limit_control(control: Control, value: float) -> float:
    """Return the value at which a control acts: at most the margin outside its sampled range."""
    room = MARGIN * (control.maximum - control.minimum)
    return min(max(value, control.minimum - room), control.maximum + room)


def shape_rows(
    output: str, rows: Annotated[Singles, "rows columns"], questions: int, joints: int
) -> Any:
    """Return an output of the graph in its shape, from its rows, without a copy.

    questions: B. Rotations are (B, S, J, 4), bone offsets (B, J, 3), durations and sigmas (B,), all
    others (B, S, n).
    """
    if output in ("duration", "sigma"):
        # Sigma has two equal columns, so that its sums have one order (`GraphBuilder.row_sums`).
        return rows[:, 0]
    if output == "rotations":
        return rows.reshape(questions, -1, joints, 4)
    if output == "bone_offsets":
        return rows.reshape(questions, joints, 3)
    return rows.reshape(questions, -1, rows.shape[1])


# Estimate of memory, by the shipped models: each level has up to six sessions, one for each set of
# values that is asked for, and a session takes four to five times the file.
BASE_MEMORY, COPIES_PER_LEVEL = 1 << 20, 24


class PredictionState(NamedTuple):
    """Intermediate values of the graph from which the poses of one question are computed.

    coefficients: sample coefficients (r3,). frames: canonical frames (S,) of the question's times.
    travel: travel (3,) of a cycle. bones: bone offsets (J, 3), m. duration: s. sigma: m, at the
    controls that were limited; asked_sigma: m, at the controls as asked.
    """

    coefficients: Annotated[Floats, "modes"]
    frames: Frames
    travel: Vector
    bones: Bones
    duration: float
    sigma: float
    asked_sigma: float


Feed = Mapping[str, Singles]
"""Inputs of a graph by name."""


class Graph(Protocol):
    """A model's graph, of which any values can be asked for."""

    def run(self, values: Sequence[str], feed: Feed, level: int) -> list[Any]:
        """Return float32 values of the graph, by name, at a level of detail.

        feed: inputs; those that the values do not depend on are ignored.
        """
        ...


class GraphParts:
    """Sessions on parts of one file's graph.

    Two threads that need a part at the same time each open a session; one of them is kept.
    """

    def __init__(self, content: bytes, source: str) -> None:
        """Take a checked file; source: its name in errors."""
        self._content, self._source = content, source
        self._parts: dict[tuple[tuple[str, ...], int, bool], tuple[Any, tuple[str, ...]]] = {}

    def run(self, values: Sequence[str], feed: Feed, level: int) -> list[Any]:
        """Return values as `Graph.run` does."""
        key = tuple(values), level, DURATION in feed
        graph_part = self._parts.get(key)
        if graph_part is None:
            graph_part = self._parts[key] = self._open(*key)
        session, names = graph_part
        outputs: list[Any] = session.run(key[0], {n: feed[n] for n in names if n in feed})
        return outputs

    def _open(
        self, values: tuple[str, ...], level: int, phases: bool
    ) -> tuple[Any, tuple[str, ...]]:
        """Return an onnxruntime session and the inputs that it has; phases: as of `Session.run`."""
        content = onnx_file.fix_level(self._content, level)
        content = onnx_file.select_outputs(content, *values, inputs=[DURATION] * phases)
        session = onnx_runtime.open_session(content, self._source)
        # Inputs with a default are not among the others.
        ports = [*session.get_inputs(), *session.get_overridable_initializers()]
        return session, tuple(port.name for port in ports)


@dataclass(frozen=True)
class Session:
    """An open model.

    card: its metadata. digest: identifies the file's bytes. graph: in onnxruntime. size: of the
    file, bytes. content: the file. golden: the answer at the default controls.
    """

    card: ModelCard
    digest: str
    graph: Graph
    size: int
    content: bytes = field_of(default=b"", repr=False)
    golden: bytes = b""

    def run(
        self,
        controls: PointControls | SinglePoints,
        times: Annotated[Floats, "points frames"] | Annotated[Singles, "points frames"] | None,
        *values: str,
        labels: Annotated[Floats, "_ labels"] | Annotated[Singles, "_ labels"] | None = None,
        level: int = 0,
        phases: bool = False,
    ) -> list[Any]:
        """Return values of the graph, in their order, for controls (B, d) and times (B, S).

        values: outputs, or "coefficients" (B, r3), "frame" (B, S) and "way" (B, 3): sample
        coefficients, canonical frames and the travel of a cycle. times: None for values that do not
        depend on it, as "duration" and "sigma". labels (B or 1, p): weights of the names of all
        label sets; all sets are left open if None. level: level of detail. phases: whether times
        are shares of the duration, which is then not computed. Outside the sampled ranges, answers
        are bounded (`AnswerBounds`), but sigma is that of the controls as asked. Raises ValueError
        for the contacts of a model without them.
        """
        if CONTACTS in values and not self.card.contacts:
            raise ValueError(f"model {self.card.name} has no contacts")
        if phases or values == ("sigma",) or self.bounds.is_inside(controls):
            controls = self.bounds.limit(controls) if phases else controls
            return self._run_unbounded(controls, times, values, labels, level, phases)
        rows, raw, bounded = self._outside_durations(controls, labels, level)
        if times is not None:
            # The graph places a time by the duration that it computes itself.
            stretch = np.ones((len(controls), 1), raw.dtype)
            stretch[rows, 0] = raw / bounded
            times = times * stretch
        limited = self.bounds.limit(controls)
        arrays = self._run_unbounded(limited, times, values, labels, level)
        if "duration" in values:
            changed = raw != bounded
            arrays[values.index("duration")][rows[changed]] = bounded[changed]
        if "sigma" in values:
            (sigma,) = self._run_unbounded(controls, None, ("sigma",), labels, level)
            arrays[values.index("sigma")][rows] = sigma[rows]
        return arrays

    def state(
        self,
        controls: Annotated[Floats, "1 controls"],
        times: Frames,
        labels: Annotated[Floats, "1 labels"] | None = None,
        level: int = 0,
    ) -> PredictionState:
        """Return the intermediate values for one question: controls (1, d), times (S,).

        Bounded as the answers of `run` are. Not by `run`, since a correction starts from the sigma
        of the limited controls, and stretches times in double precision.
        """
        stretch, asked_sigma = 1.0, None
        if not self.bounds.is_inside(controls):
            _, raw, bounded = self._outside_durations(controls, labels, level)
            stretch = float(raw[0]) / float(bounded[0])
            (sigma_as_requested,) = self._run_unbounded(controls, None, ("sigma",), labels, level)
            asked_sigma = float(sigma_as_requested[0])
            controls = np.asarray(self.bounds.limit(controls), np.float64)
        values = ("coefficients", "frame", "bone_offsets", "duration", "sigma", "way")
        arrays = self._run_unbounded(
            controls,
            (times * stretch)[None],
            values if self.card.cyclic else values[:-1],
            labels,
            level,
        )
        coefficients, frames, bones, duration, sigma, *travel = (
            array.astype(float)[0] for array in arrays
        )
        return PredictionState(
            coefficients,
            frames,
            travel[0] if travel else np.zeros(3),
            bones,
            float(duration) / stretch,
            float(sigma),
            float(sigma) if asked_sigma is None else asked_sigma,
        )

    @cached_property
    def bounds(self) -> AnswerBounds:
        """Bounds of the answers outside the sampled ranges."""
        return AnswerBounds(*self.card.sampled_ranges, self.card.durations)

    def _run_unbounded(
        self,
        controls: Floats | Singles,
        times: Floats | Singles | None,
        values: Sequence[str],
        labels: Floats | Singles | None,
        level: int,
        phases: bool = False,
    ) -> list[Any]:
        feed = {"controls": controls.astype(np.float32, copy=False)}
        if phases:
            feed[DURATION] = np.ones((len(controls), 1), np.float32)
        if times is not None:
            feed["time"] = times.astype(np.float32, copy=False)
        if labels is not None and self.card.labels:
            feed[LABELS] = labels.astype(np.float32, copy=False)
        rows = self.graph.run([ROW_VALUES.get(name, name) for name in values], feed, level)
        joints = len(self.card.skeleton)
        return [
            shape_rows(name, array, len(controls), joints) if name in ROW_VALUES else array
            for name, array in zip(values, rows, strict=True)
        ]

    def _outside_durations(
        self, controls: Floats | Singles, labels: Floats | Singles | None, level: int
    ) -> tuple[Indices, Singles, Singles]:
        """Return the rows (K,) outside the sampled ranges, and their raw and bounded durations."""
        rows = np.flatnonzero(self.bounds.outside(controls))
        # A matrix product with one row sums in another order, so no batch of several has one row.
        if len(rows) == 1 < len(controls):
            rows = np.repeat(rows, 2)
        outside = controls[rows]
        labels = labels if labels is None or len(labels) == 1 else labels[rows]
        raw, nearest = (
            self._run_unbounded(points, None, ("duration",), labels, level)[0]
            for points in (self.bounds.limit(outside), self.bounds.nearest_sampled(outside))
        )
        return rows, raw, self.bounds.limit_durations(raw, nearest)

    @cached_property
    def starts(self) -> list[tuple[Annotated[Floats, "3 modes"], Vector]]:
        """Root positions at the start of a cycle, m, by the sample coefficients, for each level.

        Weights (3, r3) and constants (3,).
        """
        weights = onnx_file.initializers(self.content)
        starts = []
        for level in self.card.levels:
            reduced = reduced_motion.read(weights, level, self.card)
            modes = np.eye(reduced.core.shape[2])
            # A cycle without its travel ends at its start.
            end = np.full(len(modes), reduced.frames - 1.0)
            moves = reduced.moves_of_coefficients(modes, end)
            starts.append(((moves @ reduced.directions[:, :3]).T.copy(), reduced.mean[:3]))
        return starts

    @cached_property
    def kriging_weights(self) -> KrigingWeights:
        """Kriging weights of the captured clips."""
        card = self.card
        points = support.half_ranges(np.array(card.examples), *card.sampled_ranges)
        return KrigingWeights(card.kriging, np.hstack([points, card.clip_labels]))

    @property
    def memory(self) -> int:
        """Estimated memory in bytes with all levels and all sets of values in use."""
        return BASE_MEMORY + COPIES_PER_LEVEL * len(self.card.levels) * self.size

    def run_trial(self) -> bytes:
        """Return the answer at the default controls; equals `golden` for a sound model."""
        names, controls = onnx_runtime.outputs(self.card), onnx_runtime.default_controls(self.card)
        answers = self.run(controls, np.zeros((1, 1)), *names)
        answers += self.run(controls, None, "duration")
        return b"".join(answer.tobytes() for answer in answers)


def load(path: Path) -> Session:
    """Return a session on a model file; raises as `load_bytes` does."""
    return load_bytes(checked_file.read(path), str(path))


def load_bytes(content: bytes, source: str, limits: TrialLimits = DEFAULT_LIMITS) -> Session:
    """Return a session on untrusted bytes, which a child process opens first.

    source: path or URL for messages. Raises ModelError for a file that cannot be served.
    """
    limits.check(content, source)
    return open_checked(content, checked_file.load_card(content, source), source)


def open_bytes(content: bytes, source: str) -> Session:
    """Return a session on bytes that this program wrote, checked without a child process."""
    card = checked_file.load_card(content, source)
    onnx_runtime.check(onnx_runtime.open_session(content, source), card, source)
    return open_checked(content, card, source)


def open_checked(content: bytes, card: ModelCard, source: str) -> Session:
    """Return a session on a checked file, after a trial of its finest level."""
    graph = GraphParts(content, source)
    session = Session(card, checked_file.digest(content), graph, len(content), content)
    return replace(session, golden=session.run_trial())
