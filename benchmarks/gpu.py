"""A million poses of the shipped walk on a GPU: answers that stay there, and answers copied back.

    .venv/bin/python benchmarks/gpu.py
    .venv/bin/python benchmarks/gpu.py --record

Prints `no GPU` and the reason where no CUDA device computes. With --record it writes
docs/results/speed/gpu.json; run docs/generate.py afterwards. Without a GPU that file gets rows
without values, unless it exists.
"""

import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import crowd_scene
import numpy as np
import onnxruntime
from rows import Row, record, table
from timing import in_turn

from posefield.common.errors import InvalidField
from posefield.common.units import Singles
from posefield.inference import graph_ports, onnx_runtime, session
from posefield.inference.providers import CPU, CUDA, TOLERANCE, Provider
from posefield.inference.session import Session
from posefield.model_file import subgraph
from posefield.model_file.model_card import ModelCard
from posefield.registry import shipped_models
from posefield.synthesis.synthesizer import Synthesizer

RESULTS = Path(__file__).parents[1] / "docs/results/speed"
COMMAND = "python benchmarks/gpu.py --record"
POSES, ROUNDS, GOAL = 1_000_000, 7, 16.7
ON_DEVICE = 262_144
"""Rows of a call whose answers stay on the GPU. Answers that come back are computed in the
provider's sizes: arrays above 32 MB get new pages of memory in every call."""
CROWDS = 10_000, 100_000
CALLS = tuple(1 << power for power in range(8, 17))
"""Rows of a call with arrays in memory, to find from which on a GPU is faster."""
SUBJECT = "a million poses of the shipped walk"
Feed = dict[str, Singles]


@dataclass(frozen=True)
class BoundCall:
    """A call of the graph whose inputs and outputs lie on a device; it reuses its outputs.

    session: of onnxruntime. binding: of its inputs and outputs. outputs: their names.
    """

    session: Any
    binding: Any
    outputs: Sequence[str]

    def run(self) -> None:
        """Compute the outputs, which stay on the device."""
        self.session.run_with_iobinding(self.binding)
        self.binding.synchronize_outputs()

    def copied(self) -> dict[str, Singles]:
        """Return the outputs as arrays in memory."""
        return dict(zip(self.outputs, self.binding.copy_outputs_to_cpu(), strict=True))


def bound_calls(
    opened: Session, level: int, provider: Provider, asked: Feed, most: int
) -> list[BoundCall]:
    """Return calls of at most `most` rows for many questions; inputs are on the device."""
    names = graph_ports.outputs(opened.card)
    content = subgraph.select_outputs(subgraph.fix_level(opened.content, level), *names)
    runtime = onnx_runtime.open_session(content, opened.card.name, provider)
    count = len(asked["time"])
    found = []
    for rows in np.array_split(np.arange(count), -(-count // most)):
        binding = runtime.io_binding()
        for name, values in asked.items():
            own = onnxruntime.OrtValue.ortvalue_from_numpy(values[rows], provider.device, 0)
            binding.bind_ortvalue_input(name, own)
        for name in names:
            binding.bind_output(name, provider.device, 0)
        found.append(BoundCall(runtime, binding, names))
    return found


def questions(card: ModelCard, count: int) -> Feed:
    """Return controls (N, d) across the ranges and times (N, 1), s, of that many poses."""
    own = np.random.default_rng(1)
    low, high = ([getattr(each, end) for each in card.controls] for end in ("minimum", "maximum"))
    controls = own.uniform(low, high, (count, len(low))).astype(np.float32)
    times = own.uniform(0.0, min(card.durations), (count, 1)).astype(np.float32)
    return {"controls": controls, "time": times}


def open_rows() -> list[Row]:
    """Return the rows without values, where there is no GPU to measure them."""
    return _rows({})


def measured_rows(
    opened: Session, provider: Provider = CUDA, poses: int = POSES, rounds: int = ROUNDS
) -> list[Row]:
    """Return the rows as a provider of this machine computes them; its times are medians."""
    levels = {"finest": 0, "coarsest": len(opened.card.levels) - 1}
    asked = questions(opened.card, poses)
    found: dict[str, float] = {}
    for name, level in levels.items():
        left = bound_calls(opened, level, provider, asked, ON_DEVICE)
        copied = bound_calls(opened, level, provider, asked, provider.calls.most)
        runs = {f"{name} left": partial(_leave, left), f"{name} copied": partial(_copy, copied)}
        found |= {key: 1e3 * taken for key, taken in in_turn(runs, rounds, 1).items()}
    few = {key: values[: CALLS[-1]] for key, values in asked.items()}
    here, there = (bound_calls(opened, 0, each, few, each.calls.most) for each in (CPU, provider))
    taken = in_turn({"cpu": partial(_leave, here)}, 3, 1)["cpu"]
    _leave(there)
    apart = [
        np.abs(one.astype(float) - other).max()
        for one, other in zip(_rotations(here), _rotations(there), strict=True)
    ]
    found |= {"cpu": 1e3 * taken * poses / len(few["time"]), "apart": float(max(apart))}
    found |= _in_memory(opened, provider, few, rounds)
    return _rows(found | _crowds(opened, provider, poses, rounds))


def _leave(calls: Sequence[BoundCall]) -> None:
    for call in calls:
        call.run()


def _copy(calls: Sequence[BoundCall]) -> None:
    for call in calls:
        call.run()
        call.copied()


def _rotations(calls: Sequence[BoundCall]) -> Singles:
    return np.concatenate([call.copied()["rotations"] for call in calls])


def _in_memory(opened: Session, provider: Provider, asked: Feed, rounds: int) -> dict[str, float]:
    """Return figures of calls with arrays in memory, one thread of the CPU beside a provider.

    break even: rows of the smallest call of `CALLS` from which on the provider is faster. large:
    time of all that is asked, ms, and large ratio: of the CPU's time to it.
    """
    names = [*graph_ports.outputs(opened.card)]
    content = subgraph.select_outputs(subgraph.fix_level(opened.content, 0), *names)
    both = [onnx_runtime.open_session(content, "", each) for each in (CPU, provider)]
    found: dict[str, float] = {}
    for rows in [each for each in CALLS if each <= len(asked["time"])]:
        own = {key: values[:rows] for key, values in asked.items()}
        cpu, gpu = in_turn(
            {str(each): partial(run.run, names, own) for each, run in enumerate(both)}, rounds, 3
        ).values()
        print(f"{rows} poses a call: CPU {1e3 * cpu:.2f} ms, {provider.name} {1e3 * gpu:.2f} ms")
        if gpu >= cpu:
            found.pop("break even", None)
        else:
            found.setdefault("break even", rows)
        found |= {"large": 1e3 * gpu, "large ratio": cpu / gpu}
    return found


def _crowds(opened: Session, provider: Provider, most: int, rounds: int) -> dict[str, float]:
    """Return times, ms, of whole calls for crowds, of at most `most`, and the CPU's time to them.

    Validation, support and placement are part of a call, and the CPU computes with all its threads.
    """
    models = [
        Synthesizer("walk", session.open_checked(opened.content, opened.card, "", each))
        for each in (CPU, provider)
    ]
    found = {}
    for crowd in CROWDS:
        count = min(crowd, most)
        finest = np.zeros(count, np.int64)
        runs = {
            str(each): crowd_scene.around(model, count).poses(finest)
            for each, model in enumerate(models)
        }
        cpu, gpu = in_turn(runs, rounds, 1).values()
        found |= {f"crowd {crowd}": 1e3 * gpu, f"crowd {crowd} ratio": cpu / gpu}
    return found


def _rows(found: dict[str, float]) -> list[Row]:
    """Return all rows; those that `found` does not name have no value."""

    def row(name: str, key: str, unit: str = "ms", goal: float | None = None) -> Row:
        return Row(name, found.get(key), unit, "", None, goal)

    def beside(name: str, key: str, threads: str) -> Row:
        ratio = found.get(f"{key} ratio")
        return Row(name, found.get(key), "ms", f"CPU, {threads}", ratio, None)

    return [
        row(f"{SUBJECT}, finest level, left on the GPU", "finest left", goal=GOAL),
        row(f"{SUBJECT}, finest level, copied to memory", "finest copied"),
        row(f"{SUBJECT}, coarsest level, left on the GPU", "coarsest left", goal=GOAL),
        row(f"{SUBJECT}, coarsest level, copied to memory", "coarsest copied"),
        row(f"{SUBJECT}, finest level, CPU, one thread", "cpu"),
        row("smallest call that the GPU computes faster", "break even", "poses", CUDA.smallest),
        beside(
            f"{CALLS[-1]:,} poses of it, questions and answers in memory", "large", "one thread"
        ),
        *(
            beside(f"a crowd of {crowd:,}, whole call", f"crowd {crowd}", "all threads")
            for crowd in CROWDS
        ),
        row("a quaternion's number, largest difference from the CPU", "apart", "", TOLERANCE),
    ]


def _device_name() -> str:
    """Return the name of the GPU as its driver tells it, or an empty text."""
    tool = shutil.which("nvidia-smi")
    if tool is None:
        return ""
    command = [tool, "--query-gpu=name", "--format=csv,noheader"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[
        0
    ]


def main() -> None:
    """Measure and print, or print `no GPU`; record where asked for."""
    asked = "--record" in sys.argv
    try:
        onnx_runtime.require_provider(CUDA)
    except InvalidField as fault:
        print("no GPU")
        print(fault)
        if asked and not (RESULTS / "gpu.json").exists():
            record({"gpu": open_rows()}, COMMAND, RESULTS, "no GPU")
        return
    found = measured_rows(session.load(shipped_models.FOLDER / "cmu_walk.onnx"))
    print(table(found))
    if asked:
        record({"gpu": found}, COMMAND, RESULTS, _device_name())


if __name__ == "__main__":
    main()
