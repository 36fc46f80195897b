"""A model file opened in onnxruntime, checked once so that it can be trusted afterwards."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as field_of
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime

from service.motion import card as cards
from service.motion import field
from service.motion.card import ModelCard
from service.motion.conventions import Floats, Singles
from service.motion.errors import ModelError
from service.motion.field import Weigher
from service.synthesis import freeze, ports
from service.synthesis.ports import OUTPUTS, PERFORMER

# A model of 114 kB with four levels, all asked, takes 3.1 MB: twelve sessions, each with weights.
OWN_MEMORY, COPIES = 2 << 20, 12


@dataclass(frozen=True)
class State:
    """What poses are made of, of one question: sample coefficients (r3,), canonical frames (S,) of
    its times, the travel (3,) of a cycle, bone offsets (J, 3), m, duration, s, and sigma, m."""

    coefficients: Floats
    frames: Floats
    way: Floats
    bones: Floats
    duration: float
    sigma: float


class Runtimes(Sequence[Any]):
    """onnxruntime's sessions, one for each level of detail, each opened when it is first wanted.

    Two threads that want one at once open two, of which one stays.
    """

    def __init__(self, opened: Callable[[int], Any], count: int) -> None:
        self._opened = opened
        self._held: list[Any] = [None] * count

    def __len__(self) -> int:
        return len(self._held)

    # Of one level at a time: nobody slices them.
    def __getitem__(self, level: Any) -> Any:
        held = self._held[level]
        if held is None:
            held = self._held[level] = self._opened(level)
        return held


@dataclass(frozen=True)
class Session:
    """An open model: `run` asks the graph, `card` tells what it is, `digest` names its bytes.

    runtimes: onnxruntime's sessions, one for each level of detail; clocks: the same of the graphs
    that tell the duration alone, gauges of the one that tells the finest level's sigma, and states
    of those that tell what poses are made of. size: of the file, bytes. content: the file. golden:
    what it answers in the middle.
    """

    card: ModelCard
    digest: str
    runtimes: Sequence[Any]
    clocks: Sequence[Any]
    gauges: Sequence[Any]
    size: int
    states: Sequence[Any] = ()
    content: bytes = field_of(default=b"", repr=False)
    golden: bytes = b""

    def run(
        self,
        controls: Floats | Singles,
        time: Floats | Singles,
        *outputs: str,
        labels: Floats | Singles | None = None,
        level: int = 0,
    ) -> list[Any]:
        """Outputs of the graph for controls (B, d) and times (B, S), in the order asked for.

        labels (B or 1, p): who moves, of the card's performers; nobody that was seen, if not said.
        level: of the card's levels of detail.
        """
        feed = self._feed(controls, labels)
        feed["time"] = time.astype(np.float32, copy=False)
        answers: list[Any] = self.runtimes[level].run(list(outputs), feed)
        return answers

    def durations(
        self, controls: Floats | Singles, labels: Floats | Singles | None = None, level: int = 0
    ) -> Singles:
        """Durations (B,), s, as `run` gives them, in a quarter of its time."""
        answers: list[Singles] = self.clocks[level].run(["duration"], self._feed(controls, labels))
        return answers[0]

    def state(
        self, controls: Floats, time: Floats, labels: Floats | None = None, level: int = 0
    ) -> State:
        """What the poses of one question, controls (1, d) and times (S,), are made of."""
        feed = self._feed(controls, labels)
        feed["time"] = time[None].astype(np.float32, copy=False)
        found = self.states[level].run(list(self._parts), feed)
        coefficients, frames, bones, durations, sigmas, *ways = (a.astype(float) for a in found)
        way = ways[0][0] if ways else np.zeros(3)
        numbers = float(durations[0]), float(sigmas[0])
        return State(coefficients[0], frames[0, :, 0], way, bones[0], *numbers)

    @property
    def correctable(self) -> bool:
        """Whether the file tells what poses are made of, and what the captured clips count for; in
        files older than this it does not."""
        card = self.card
        told = card.kriging is not None and len(card.left_out) == len(card.examples)
        beside = bool(card.beside) or not card.cyclic
        return told and beside and freeze.makes(self.content, "coefficients")

    @property
    def _parts(self) -> tuple[str, ...]:
        return parts(self.card)

    def sigmas(self, controls: Floats | Singles, labels: Floats | Singles | None = None) -> Singles:
        """Sigmas (B,), m, as `run` gives them at level 0, in half of its time."""
        answers: list[Singles] = self.gauges[0].run(["sigma"], self._feed(controls, labels))
        return answers[0]

    @cached_property
    def weigher(self) -> Weigher:
        """What the captured clips count for; only of a card that says what that hangs on."""
        own = self.card
        assert own.kriging is not None
        low, high = np.transpose([(c.minimum, c.maximum) for c in own.controls])
        points = field.half_ranges(np.array(own.examples), low, high)
        return Weigher(own.kriging, np.hstack([points, own.labels]))

    @property
    def memory(self) -> int:
        """Bytes that this takes about, with all levels open."""
        return OWN_MEMORY + COPIES * self.size

    def trial(self) -> bytes:
        """Answer in the middle of the controls, asked anew: always `golden` of a sound model."""
        answers = self.run(ports.middle(self.card), np.zeros((1, 1)), *OUTPUTS)
        return b"".join(
            answer.tobytes() for answer in (*answers, self.durations(ports.middle(self.card)))
        )

    def _feed(
        self, controls: Floats | Singles, labels: Floats | Singles | None
    ) -> dict[str, Singles]:
        feed = {"controls": controls.astype(np.float32, copy=False)}
        if labels is not None and self.card.performers:
            feed[PERFORMER] = labels.astype(np.float32, copy=False)
        return feed


def parts(card: ModelCard) -> tuple[str, ...]:
    """Values of the graph that a State holds."""
    own = ("coefficients", "frame", "bone_offsets", "duration", "sigma")
    return (*own, "way") if card.cyclic else own


def load(path: Path) -> Session:
    """Session on one thread; ModelError says why a file cannot be served."""
    return open_bytes(read(path), str(path))


def read(path: Path) -> bytes:
    """Content of a model file; ModelError where it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as fault:
        raise ModelError(path, f"cannot be read: {fault.strerror}") from fault


def sha256(content: bytes) -> str:
    """SHA-256 of a model file, in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def digest(content: bytes) -> str:
    """What a model file is told by."""
    return sha256(content)[:16]


def open_bytes(content: bytes, source: str) -> Session:
    """Session on the bytes of a model; `source` names them in errors."""
    runtime = _start(content, source)
    try:
        card = cards.load(runtime.get_modelmeta().custom_metadata_map)
    except ValueError as fault:
        raise ModelError(source, str(fault)) from fault
    ports.check(runtime, card, source)
    return _levelled(card, content, source)


def _levelled(card: ModelCard, content: bytes, source: str) -> Session:
    """Session of a file that has been checked, with what most questions need already open."""

    def level(number: int) -> bytes:
        try:
            return freeze.at_level(content, number)
        except (ValueError, LookupError) as fault:
            raise ModelError(source, f"no protocol buffer: {fault}") from fault

    def telling(*outputs: str) -> Callable[[int], Any]:
        return lambda number: _start(freeze.for_outputs(level(number), *outputs), source)

    count = len(card.levels)
    runtimes = Runtimes(lambda number: _start(level(number), source), count)
    clocks, gauges = Runtimes(telling("duration"), count), Runtimes(telling("sigma"), 1)
    states = Runtimes(telling(*parts(card)), count)
    own = (runtimes, clocks, gauges, len(content), states, content)
    session = Session(card, digest(content), *own)
    # Asks the finest level and its clock, and so opens them.
    return replace(session, golden=session.trial())


def _start(content: bytes, source: str) -> Any:
    options = onnxruntime.SessionOptions()
    # A pose takes microseconds: threads would cost more than they bring.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    # An arena keeps what the longest clip took, for each session, and gains no time on one thread.
    options.enable_cpu_mem_arena = False
    try:
        return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except Exception as fault:  # onnxruntime's exceptions share no base of their own
        first_line = str(fault).strip().splitlines()[0]
        raise ModelError(source, f"onnxruntime cannot load it: {first_line}") from fault
