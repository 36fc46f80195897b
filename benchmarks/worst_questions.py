"""Candidates for the worst legal request of each operation, as far as its limits let it grow."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from posefield.common.errors import InvalidField
from posefield.constraints.targets import MAX_TARGETS
from posefield.encode.formats import CLIP_ENCODERS, CROWD_ENCODERS, GRID_ENCODERS, POSE_ENCODERS
from posefield.http import crowd_operations
from posefield.http.api.settings import Settings
from posefield.question import text_decoding
from posefield.question.walk_question import WalkQuestion
from posefield.registry import model_registry
from posefield.synthesis.poses import MAX_POSES
from posefield.synthesis.synthesizer import Synthesizer

SETTINGS = Settings()
GRID = 256
JOINT = "RightHand"


@dataclass(frozen=True)
class Question:
    """A request of a model's file: GET, or POST where there is a body."""

    operation: str
    note: str
    model: Path
    path: str
    body: bytes = b""


def of(reaching: Path, walk: Path) -> Iterator[Question]:
    """Yield the candidates of all operations that make something."""
    ((name, model),) = model_registry.load([reaching]).models.items()
    one = _Asked(reaching, f"/v1/models/{name}", model)
    yield from _poses(one)
    yield from _clips(one)
    yield from _archives(one)
    yield from _crowds(one)
    yield from _grids(one)
    yield Question("why", "all clips", reaching, f"{one.path}/why?nearest=10000")
    yield Question("suggestions", "count=200", reaching, f"{one.path}/suggestions?count=200")
    for path in ("/v1/models", one.path, "/", "/docs", "/problems", "/openapi.json", "/metrics"):
        yield Question(f"GET {path}", "", reaching, path)
    ((name, model),) = model_registry.load([walk]).models.items()
    yield from _walks(_Asked(walk, f"/v1/models/{name}", model))


@dataclass(frozen=True)
class _Asked:
    """The model that is asked, and the path of its operations."""

    file: Path
    path: str
    model: Synthesizer

    @property
    def controls(self) -> dict[str, float]:
        return {control.name: control.default for control in self.model.session.card.controls}

    def targets(self, count: int) -> list[dict[str, Any]]:
        """Targets that contradict each other."""
        end = self.model.session.card.durations[0]
        return [
            {"joint": JOINT, "time": end * i / count, "position": [(-1) ** i, 1.0, 1.0]}
            for i in range(count)
        ]

    def post(self, operation: str, note: str, rest: str, body: Mapping[str, Any]) -> Question:
        content = json.dumps(body, separators=(",", ":")).encode()
        return Question(operation, note, self.file, f"{self.path}/{rest}", content)

    def get(self, operation: str, note: str, rest: str) -> Question:
        return Question(operation, note, self.file, f"{self.path}/{rest}")


def _poses(one: _Asked) -> Iterator[Question]:
    end = one.model.session.card.durations[0]
    # Of few digits: the body is bounded, too.
    times = [round(end * i / MAX_POSES, 3) for i in range(MAX_POSES)]
    for ending in POSE_ENCODERS:
        query = {"controls": one.controls, "times": times}
        yield one.post("pose", f"{MAX_POSES} times, {ending}", f"pose.{ending}", query)
    constrained = {"controls": {}, "targets": one.targets(MAX_TARGETS), "times": times}
    yield one.post(
        "pose", f"{MAX_TARGETS} targets, open controls, all times, json", "pose", constrained
    )


def _clips(one: _Asked) -> Iterator[Question]:
    for ending in CLIP_ENCODERS:
        query = {"controls": one.controls, "fps": 1000}
        yield one.post("clip", f"fps=1000, {ending}", f"clip.{ending}", query)
    targets = {"controls": {}, "targets": one.targets(MAX_TARGETS), "fps": 1000}
    note = f"{MAX_TARGETS} targets, fps=1000, json"
    yield one.post("clip", note, "clip.json", targets | {"controls": one.controls})
    yield one.post("clip", f"{note}, open controls", "clip.json", targets)


def _archives(one: _Asked) -> Iterator[Question]:
    count = SETTINGS.clips_limit
    # As many frames as all may have, in clips of the mean length.
    rate = int(SETTINGS.clips_poses / count / one.model.session.card.durations[1]) - 1
    for ending in CLIP_ENCODERS:
        clips = [{"controls": one.controls, "fps": rate}] * count
        note = f"{count} clips of {rate} frames a second, {ending}"
        yield one.post("clips", note, "clips.zip", {"format": ending, "clips": clips})
    cost = SETTINGS.clips_targets
    body = {"controls": one.controls, "targets": one.targets(MAX_TARGETS)}
    clips = [body] * (cost // MAX_TARGETS)
    note = f"{len(clips)} clips of {MAX_TARGETS} targets, json"
    yield one.post("clips", note, "clips.tar", {"format": "json", "clips": clips})
    clips = [{"controls": {}, "targets": one.targets(1)}] * (cost // 4)
    note = f"{len(clips)} clips of a target, open controls, json"
    yield one.post("clips", note, "clips.tar", {"format": "json", "clips": clips})


def _crowds(one: _Asked) -> Iterator[Question]:
    for ending, encoder in CROWD_ENCODERS.items():
        count = int(min(SETTINGS.crowd_limit, encoder.max_characters))
        query = {"controls": one.controls, "time": [0.1] * count}
        yield one.post("crowd of poses", f"{count} characters, {ending}", f"crowd.{ending}", query)
        note = f"{count} characters, all columns, blended, {ending}"
        yield one.post("crowd of poses", note, f"crowd.{ending}", _columns(one, count))
    # As many numbers as are decoded, to be refused then.
    count = crowd_operations.VALUES * SETTINGS.crowd_limit - 1000
    query = {"controls": one.controls, "time": [0] * count}
    yield one.post("crowd of poses", f"{count} numbers", "crowd.arrow", query)


def _columns(one: _Asked, count: int) -> dict[str, Any]:
    """Question for a crowd in which each character has a number of its own for everything."""
    column = [1.0 + i / 7 / count for i in range(count)]
    controls = {name: [value * share for share in column] for name, value in one.controls.items()}
    return {
        "controls": controls,
        "time": [share / 9 for share in column],
        "position": [[share * 7, 0.0, share * 3] for share in column],
        "heading": column,
        "level": [0] * count,
        "from_level": [1] * count,
        "blend": [share / 2 for share in column],
    }


def _grids(one: _Asked) -> Iterator[Question]:
    across, along = list(one.controls)[:2]
    for ending in GRID_ENCODERS:
        rest = f"sigma.{ending}?across={across}&along={along}&columns={GRID}&rows={GRID}"
        yield one.get("sigma", f"{GRID} x {GRID}, {ending}", rest)


def _walks(one: _Asked) -> Iterator[Question]:
    """One motion as long as may be, and most characters, motions and frames, in all forms."""
    longest = (SETTINGS.crowd_frames - 1) / 30
    shapes: dict[str, Callable[[int], str]] = {
        "one character": lambda n: f"count=1&seconds={min(n / 30, longest):.3f}",
        "characters of one motion": lambda n: f"count={n}&motions=1&seconds=0.1",
        "characters of 100 motions of 10 s": lambda n: f"count={n}&motions=100&seconds=10",
        "motions of 0.1 s": lambda n: f"count={n}&seconds=0.1",
        "motions of 10 s": lambda n: f"count={n}&seconds=10",
        "motions of 1000 s": lambda n: f"count={n}&seconds=1000",
        "motions of 10 s, seen by a camera": lambda n: f"count={n}&seconds=10&camera=0,2,0",
    }
    for ending in ("usdz", "usdc", "usda"):
        for note, shape in shapes.items():
            yield _largest(one, ending, "references", note, shape)
        for note in ("characters of one motion", "motions of 10 s"):
            yield _largest(one, ending, "flatten", note, shapes[note])


def _largest(
    one: _Asked, ending: str, instancing: str, note: str, shape: Callable[[int], str]
) -> Question:
    def query(number: int) -> str:
        return f"{shape(number)}&instancing={instancing}"

    number = most(lambda n: _legal(one, ending, query(n)))
    rest = f"crowd.{ending}?{query(number)}"
    return one.get("walking crowd", f"{number} {note}: {rest}", rest)


def _legal(one: _Asked, ending: str, query: str) -> bool:
    pairs = [tuple(pair.split("=")) for pair in query.split("&")]
    try:
        question = text_decoding.decode_question(WalkQuestion, pairs)
        joints = len(one.model.session.card.skeleton)
        crowd_operations.checked_order(question, ending, joints, SETTINGS)
    except InvalidField:
        return False
    return True


def most(legal: Callable[[int], bool]) -> int:
    """Return the largest number up to 100,000 that is legal, as all smaller ones are."""
    low, high = 0, 100_001
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if legal(middle) else (low, middle)
    return low
