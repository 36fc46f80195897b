"""A checked model file opened in onnxruntime."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from dataclasses import field as field_of
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from posefield.common.units import Bones, Floats, Frames, Indices, PointControls, Singles, Vector
from posefield.inference import onnx_runtime
from posefield.inference.onnx_runtime import CONTACTS, LABELS, Graph, GraphParts
from posefield.inference.trial_process import DEFAULT_LIMITS, TrialLimits
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import KrigingWeights
from posefield.model_file import answer_bounds, checked_file
from posefield.model_file.answer_bounds import AnswerBounds
from posefield.model_file.model_card import ROW_VALUES, ModelCard, shape_rows

# Estimate of memory, by the shipped models: each level has up to six sessions, one for each set of
# values that is asked for, and a session takes four to five times the file.
BASE_MEMORY, COPIES_PER_LEVEL = 1 << 20, 24


@dataclass(frozen=True)
class PredictionState:
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
        controls: PointControls | Annotated[Singles, "points controls"],
        time: Annotated[Floats, "points frames"] | Annotated[Singles, "points frames"],
        *outputs: str,
        labels: Annotated[Floats, "_ labels"] | Annotated[Singles, "_ labels"] | None = None,
        level: int = 0,
    ) -> list[Any]:
        """Return the graph's outputs, in their order, for controls (B, d) and times (B, S).

        labels (B or 1, p): weights of the names of all label sets; all sets are left open if None.
        level: level of detail. Outside the sampled ranges, answers are bounded (`answer_bounds`),
        but sigma is that of the controls as asked. Raises ValueError for the contacts of a model
        without them.
        """
        if CONTACTS in outputs and not self.card.contacts:
            raise ValueError(f"model {self.card.name} has no contacts")
        if self.bounds.is_inside(controls):
            return self._run(controls, time, outputs, labels, level)
        rows, raw, bounded = self._outside_durations(controls, labels, level)
        # The graph places a time by the duration that it computes itself.
        stretched = time * _stretch(len(controls), rows, raw / bounded)
        answers = self._run(self.bounds.limit(controls), stretched, outputs, labels, level)
        if "duration" in outputs:
            apart = raw != bounded
            answers[outputs.index("duration")][rows[apart]] = bounded[apart]
        if "sigma" in outputs:
            sigma = self._run(controls, time, ("sigma",), labels, level)[0]
            answers[outputs.index("sigma")][rows] = sigma[rows]
        return answers

    def durations(
        self,
        controls: PointControls | Annotated[Singles, "points controls"],
        labels: Annotated[Floats, "_ labels"] | Annotated[Singles, "_ labels"] | None = None,
        level: int = 0,
    ) -> Annotated[Singles, "points"]:
        """Return the durations (B,), s, of `run`, in a quarter of its time."""
        if self.bounds.is_inside(controls):
            return self._durations(controls, labels, level)
        found = self._durations(self.bounds.limit(controls), labels, level)
        rows, _, bounded = self._outside_durations(controls, labels, level, found)
        found[rows] = bounded
        return found

    def state(
        self,
        controls: Annotated[Floats, "1 controls"],
        time: Frames,
        labels: Annotated[Floats, "1 labels"] | None = None,
        level: int = 0,
    ) -> PredictionState:
        """Return the intermediate values for one question: controls (1, d), times (S,).

        Bounded as the answers of `run` are.
        """
        if self.bounds.is_inside(controls):
            return self._state(controls, time, labels, level)
        _, raw, bounded = self._outside_durations(controls, labels, level)
        asked = float(self._run(controls, np.zeros((1, 1)), ("sigma",), labels, level)[0][0])
        stretch = float(raw[0]) / float(bounded[0])
        found = self._state(self.bounds.limit(controls), time * stretch, labels, level)
        return replace(found, duration=found.duration / stretch, asked_sigma=asked)

    def states(
        self,
        controls: PointControls,
        times: Annotated[Floats, "points 1"],
        labels: Annotated[Floats, "points labels"],
        level: int = 0,
    ) -> tuple[Annotated[Floats, "points modes"], Frames, Annotated[Floats, "points 3"]]:
        """Return coefficients (B, r3), canonical frames (B,) and travel (B, 3) of many questions.

        controls (B, d), times (B, 1), s, and labels (B, p). Bounded as the answers of `run` are.
        """
        limited: Floats | Singles = controls
        if not self.bounds.is_inside(controls):
            rows, raw, bounded = self._outside_durations(controls, labels, level)
            times = times * _stretch(len(controls), rows, raw / bounded)
            limited = self.bounds.limit(controls)
        names = [name for name in ("coefficients", "frame", "way") if name in self._state_values]
        found = [a.astype(float) for a in self._values(names, limited, times, labels, level)]
        ways = found[2] if self.card.cyclic else np.zeros((len(controls), 3))
        return found[0], found[1][:, 0], ways

    @cached_property
    def bounds(self) -> AnswerBounds:
        """Bounds of the answers outside the sampled ranges."""
        return answer_bounds.of_card(self.card)

    def _run(
        self,
        controls: Floats | Singles,
        time: Floats | Singles,
        outputs: tuple[str, ...],
        labels: Floats | Singles | None,
        level: int,
    ) -> list[Any]:
        """Return the graph's outputs at any controls, without bounds."""
        values = [ROW_VALUES.get(name, name) for name in outputs]
        found = self._values(values, controls, time, labels, level)
        joints = len(self.card.skeleton)
        return [
            shape_rows(name, rows, len(controls), joints) if name in ROW_VALUES else rows
            for name, rows in zip(outputs, found, strict=True)
        ]

    def _values(
        self,
        values: Sequence[str],
        controls: Floats | Singles,
        time: Floats | Singles | None,
        labels: Floats | Singles | None,
        level: int,
    ) -> list[Any]:
        """Return values of the graph at any controls, without bounds.

        time: None for values that do not depend on it.
        """
        feed = {"controls": controls.astype(np.float32, copy=False)}
        if time is not None:
            feed["time"] = time.astype(np.float32, copy=False)
        if labels is not None and self.card.labels:
            feed[LABELS] = labels.astype(np.float32, copy=False)
        return self.graph.run(values, feed, level)

    def _durations(
        self, controls: Floats | Singles, labels: Floats | Singles | None, level: int
    ) -> Singles:
        (found,) = self._values([ROW_VALUES["duration"]], controls, None, labels, level)
        return np.asarray(found[:, 0])

    def _outside_durations(
        self,
        controls: Floats | Singles,
        labels: Floats | Singles | None,
        level: int,
        raw: Singles | None = None,
    ) -> tuple[Indices, Singles, Singles]:
        """Return the rows (K,) outside the sampled ranges, their raw and their bounded durations.

        raw: durations (B,) of the graph at limited controls, if they are known.
        """
        rows = np.flatnonzero(self.bounds.outside(controls))
        # A matrix product with one row sums in another order, so no batch of several has one row.
        if len(rows) == 1 < len(controls):
            rows = np.repeat(rows, 2)
        some = controls[rows]
        own = labels if labels is None or len(labels) == 1 else labels[rows]
        if raw is None:
            found = self._durations(self.bounds.limit(some), own, level)
        else:
            found = raw[rows]
        nearest = self._durations(self.bounds.nearest_sampled(some), own, level)
        return rows, found, self.bounds.limit_durations(found, nearest)

    def _state(
        self, controls: Floats | Singles, time: Floats, labels: Floats | None, level: int
    ) -> PredictionState:
        found = self._values(self._state_values, controls, time[None], labels, level)
        coefficients, frames, bones, durations, sigmas, *ways = (a.astype(float) for a in found)
        way = ways[0][0] if ways else np.zeros(3)
        sigma = float(sigmas[0, 0])
        numbers = float(durations[0, 0]), sigma, sigma
        return PredictionState(coefficients[0], frames[0], way, bones[0].reshape(-1, 3), *numbers)

    @property
    def _state_values(self) -> tuple[str, ...]:
        """Return the names of the graph's values that a state is made of."""
        rows = (ROW_VALUES[name] for name in ("bone_offsets", "duration", "sigma"))
        own = ("coefficients", "frame", *rows)
        return (*own, "way") if self.card.cyclic else own

    def sigmas(
        self,
        controls: PointControls | Annotated[Singles, "points controls"],
        labels: Annotated[Floats, "_ labels"] | Annotated[Singles, "_ labels"] | None = None,
    ) -> Annotated[Singles, "points"]:
        """Return the sigmas (B,), m, of `run` at level 0, in half of its time."""
        (found,) = self._values([ROW_VALUES["sigma"]], controls, None, labels, 0)
        return np.asarray(found[:, 0])

    @cached_property
    def kriging_weights(self) -> KrigingWeights:
        """Kriging weights of the captured clips."""
        own = self.card
        points = kriging_model.half_ranges(np.array(own.examples), *own.sampled_ranges)
        return KrigingWeights(own.kriging, np.hstack([points, own.clip_labels]))

    @property
    def memory(self) -> int:
        """Estimated memory in bytes with all levels and all sets of values in use."""
        return BASE_MEMORY + COPIES_PER_LEVEL * len(self.card.levels) * self.size

    def run_trial(self) -> bytes:
        """Return the answer at the default controls; equals `golden` for a sound model."""
        names, controls = onnx_runtime.outputs(self.card), onnx_runtime.default_controls(self.card)
        answers = self.run(controls, np.zeros((1, 1)), *names)
        answers.append(self.durations(controls))
        return b"".join(answer.tobytes() for answer in answers)


def _stretch(count: int, rows: Indices, ratios: Singles) -> Annotated[Singles, "points 1"]:
    """Return factors (B, 1) of times: ratios (K,) in these rows (K,), one in all others."""
    found = np.ones((count, 1), ratios.dtype)
    found[rows, 0] = ratios
    return found


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
