"""Scripts of performances that are measured, and what a performance costs."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import random_scripts
from random_scripts import Document
from rows import Row
from threadpoolctl import threadpool_limits

from posefield.encode.formats import CLIP_ENCODERS
from posefield.performance import composition
from posefield.performance.passage import RATE
from posefield.performance.script import Script, resolve_script
from posefield.performance.timeline import Timeline
from posefield.question.performance_report import PerformanceAnswer
from posefield.synthesis.synthesizer import Synthesizer

MOST_FRAMES = 1_000_000
WALK = "cmu_walk"
TARGETS = [(x, y, z) for x in (-0.6, 0.0, 1.0) for y in (1.62, 1.7) for z in (4.0, 5.0)]
MEMORY = """
import resource, sys
sys.argv = {words}
from posefield.cli import main
try:
    main()
finally:
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


@dataclass(frozen=True)
class Figure(Row):
    """A figure with the value that it must have, `goal`, and the one that is wished for."""

    wish: float | None = None


@dataclass(frozen=True)
class Made:
    """A performance and what it is made of."""

    script: Script
    timeline: Timeline
    answer: PerformanceAnswer


Find = Callable[[str], Synthesizer]


def make(document: Document, find: Find) -> Made:
    """Return the performance of a script."""
    script = resolve_script(random_scripts.read(document), find)
    return Made(script, composition.compose(script), composition.perform(script, MOST_FRAMES))


def whole(target: Sequence[float]) -> Document:
    """Return the script of a walk, a grab of a target, a hold, a return and a walk."""
    reached = {"joint": "rhand", "position": list(target), "at": "event"}
    return {
        "fps": RATE,
        "segments": [
            {"kind": "walk", "model": WALK, "speed": 1.1},
            {"kind": "act", "model": "hdm05_grab_high", "targets": [reached]},
            {"kind": "hold", "seconds": 0.5},
            {"kind": "act", "model": "hdm05_grab_return"},
            {"kind": "walk", "model": WALK, "seconds": 3.0},
        ],
    }


def time_rows(find: Find) -> list[Row]:
    """Return the processor time of ten seconds from three models, and of its plan."""
    document = {**whole(TARGETS[-1]), "fps": 30.0}
    document["segments"][-1]["seconds"] = 3.5
    content, encoder = msgspec.json.encode(document), CLIP_ENCODERS["usdc"]
    convention = encoder.convention(None, None, None)

    def usdc() -> bytes:
        script = resolve_script(random_scripts.read(msgspec.json.decode(content)), find)
        return encoder.encode(composition.perform(script, MOST_FRAMES), convention)

    def plan() -> bytes:
        script = resolve_script(random_scripts.read(msgspec.json.decode(content)), find)
        return composition.plan_document(composition.plan(script, MOST_FRAMES))

    whole_time, plan_time = _least(usdc), _least(plan)
    seconds = make(document, find).answer.trust.duration
    note = f"{seconds:.1f} s of motion, {len(usdc()) / 1000:.0f} kB; least of 15 runs"
    return [
        Figure("three models to usdc, processor time", whole_time, "ms", note, None, 60.0, 10.0),
        Figure("its plan, processor time", plan_time, "ms", "least of 15 runs", None, 10.0),
    ]


def _least(run: Callable[[], bytes]) -> float:
    """Return the least processor time of a run on one thread, ms."""
    seconds = []
    # Threads that wait for work would count as processor time.
    with threadpool_limits(1):
        for _ in range(15):
            begin = time.process_time()
            run()
            seconds.append(1000.0 * (time.process_time() - begin))
    return min(seconds)


def memory_rows() -> list[Row]:
    """Return the memory of ten minutes over that of one, and whether they are the same again."""
    one, _ = _long(5)
    ten, first = _long(50)
    _, second = _long(50)
    note = f"{ten:.0f} MiB at most, of {one:.0f} MiB for a tenth; glb, 30 frames a second"
    same = 0.0 if first == second else 1.0
    return [
        Figure("9.6 minutes: memory over 1 minute's", ten - one, "MiB", note, None, None),
        Figure("9.6 minutes: other bytes in another process", same, "of 1", "", None, 0.0),
    ]


def _long(walks: int) -> tuple[float, bytes]:
    """Return the largest memory, MiB, and the bytes of a performance of some walks of 11.5 s."""
    segments = [
        {"kind": "walk", "model": WALK, "seconds": 12.0, "turn": 0.1 * (-1) ** number}
        for number in range(walks)
    ]
    with tempfile.TemporaryDirectory() as folder:
        script, output = Path(folder, "script.json"), Path(folder, "made.glb")
        script.write_bytes(msgspec.json.encode({"segments": segments}))
        words = ["posefield", "perform", str(script), "-o", str(output)]
        command = [sys.executable, "-c", MEMORY.format(words=words)]
        note = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return float(note.split()[-1]), output.read_bytes()
