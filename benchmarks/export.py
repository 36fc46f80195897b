"""Speed of exporting many clips to files, the time of each stage, and the memory.

    python benchmarks/export.py MODEL [--clips 2000] [--format usdc] [--long 100000]

Everything runs through the engine of `posefield export`, each thing several times and in turn with
the others. Files go to the folder that TMPDIR names. --long also exports so many clips by one
process, which takes minutes and room for them, and says how its memory grows.
"""

import argparse
import hashlib
import resource
import statistics
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from rows import Row, table

from posefield.batch import clip_files, layouts, process_pool, run
from posefield.batch.checkpoint import ChunkResult
from posefield.batch.job import ExportJob, WorkerInput, exported_file, manifest_line
from posefield.batch.process_pool import Runner
from posefield.batch.rows import RowReader, open_source
from posefield.batch.target import open_target
from posefield.encode.formats import CLIP_ENCODERS
from posefield.registry import model_registry
from posefield.synthesis.clips import synthesize_clip

ROUNDS, CLIPS, FORM = 3, 2048, "usdc"
LONGER = 8
"""Times as many clips where processes are begun, which takes them a second."""
FAST, TWICE, MEMORY = 2000.0, 1.7, 600.0
"""Goals: clips a second and core, two processes against one, MB of a process."""
STAGED = clip_files.CLIPS
"""Clips that the stages are measured with: as many as are held at once."""


@dataclass(frozen=True)
class Bench:
    """Work for a target that is not said yet, and its queries."""

    work: WorkerInput
    source: RowReader

    @classmethod
    def of(cls, model: Path, clips: int, form: str) -> "Bench":
        """Clips at points sampled from a model's controls."""
        content = model.read_bytes()
        opened = model_registry.open_model(model.stem, model, content)
        source = open_source(opened, form, sample=clips)
        digest = hashlib.sha256(content).hexdigest()
        job = ExportJob(opened.identity, digest, source.digest, "folder", 1)
        return cls(WorkerInput(job, content, ""), source)

    def seconds(self, layout: str, runner: Runner) -> float:
        """Of a whole export."""
        with tempfile.TemporaryDirectory() as target:
            start = time.perf_counter()
            self.export(layout, runner, target)
            return time.perf_counter() - start

    def export(self, layout: str, runner: Runner, target: str) -> list[float]:
        """Export; the peak memory of this process after each chunk, MB."""
        job = replace(self.work.job, layout=layout, chunk=layouts.find_layout(layout).chunk)
        monitor = PeakMemory([])
        run.run(replace(self.work, job=job, target=target), self.source, monitor, runner)
        return monitor.peaks


@dataclass(frozen=True)
class PeakMemory:
    """Monitor that records the peak memory of this process after each chunk, MB."""

    peaks: list[float]

    def begin(self, total: int, done: int) -> None:
        """Show nothing."""

    def advance(self, result: ChunkResult) -> None:
        """Record the peak memory."""
        self.peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)

    def note(self, message: str) -> None:
        """Print a message."""
        print(message)

    def stopped(self) -> bool:
        """Return False: the export runs to its end."""
        return False


def rows(model: Path, clips: int = CLIPS, form: str = FORM) -> list[Row]:
    """Rates, ratios and shares, with what one process takes of memory."""
    benchmark = Bench.of(model, clips, form)
    timings = in_turn(
        {name: partial(benchmark.seconds, name, process_pool.run_here) for name in layouts.LAYOUTS}
    )
    return [
        *_rates(clips, form, timings),
        *_shares(benchmark, form, timings["folder"] / clips),
        _processes(Bench.of(model, LONGER * clips, form), LONGER * clips, form),
        _memory(model, clips, form),
    ]


def in_turn(runs: dict[str, Callable[[], float]]) -> dict[str, float]:
    """Median seconds of each."""
    timings: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(ROUNDS):
        for name, one in runs.items():
            timings[name].append(one())
    return {name: statistics.median(seconds) for name, seconds in timings.items()}


def _rates(clips: int, form: str, timings: dict[str, float]) -> list[Row]:
    loose = timings["folder"]
    what = f"export of {clips} clips as {form} by one process"
    goal = FAST * loose / clips
    first = Row(f"{what} to folders", clips / loose, "clips/s", "2,000 a second", 1 / goal, 1.0)
    rest = [
        Row(f"{what}: {name}", clips / seconds, "clips/s", "folders", loose / seconds, None)
        for name, seconds in timings.items()
        if name != "folder"
    ]
    return [first, *rest]


def _processes(benchmark: Bench, clips: int, form: str) -> Row:
    timings = in_turn(
        {
            "one": partial(benchmark.seconds, "folder", process_pool.run_here),
            "two": partial(benchmark.seconds, "folder", process_pool.runner(2)),
        }
    )
    name = f"export of {clips} clips as {form} by two processes, their beginning included"
    ratio = timings["one"] / timings["two"]
    return Row(name, clips / timings["two"], "clips/s", "one process", ratio, TWICE)


def _shares(benchmark: Bench, form: str, total: float) -> list[Row]:
    """Return the time of a clip in each stage, and the rest of the whole."""
    seconds = _stages(benchmark, form)
    seconds["all else: chunks, parts, folders"] = total - sum(seconds.values())
    return [
        Row(
            f"export of a clip as {form}: {name}",
            1e6 * timings,
            "µs",
            "the whole",
            timings / total,
            None,
        )
        for name, timings in seconds.items()
    ]


def _stages(benchmark: Bench, form: str) -> dict[str, float]:
    """Seconds a clip of each stage, each done over many clips by itself."""
    rows = benchmark.source.rows()
    queries = [next(rows) for _ in range(STAGED)]
    name = benchmark.work.job.model.partition("@")[0]
    opened = model_registry.open_model(name, name, benchmark.work.model)
    encoder = CLIP_ENCODERS[form]
    answers = [synthesize_clip(opened, query.question) for query in queries]
    files = encoder.write(answers, encoder.default_convention)
    entries = partial(_entries, queries, answers, files)
    with tempfile.TemporaryDirectory() as folder:
        target = open_target(folder)
        target.prepare()
        named_files = [(f"{index}.{form}", content) for index, content in enumerate(files)]
        stages: dict[str, Callable[[], object]] = {
            "synthesis": lambda: [synthesize_clip(opened, query.question) for query in queries],
            "encoding": lambda: encoder.write(answers, encoder.default_convention),
            "checksum and line of the manifest": entries,
            "file system": lambda: target.write(named_files),
        }
        timings = {name: _median(stage) / STAGED for name, stage in stages.items()}
    source = benchmark.source
    reading = _median(lambda: (run.check_rows(source, False), sum(1 for _ in source.rows())))
    return {"queries, looked at and read": reading / sum(1 for _ in source.rows()), **timings}


def _entries(queries: list, answers: list, files: list[bytes]) -> list[bytes]:
    return [
        manifest_line(exported_file(query.name, "clips/000/name", answer, content).entry)
        for query, content, answer in zip(queries, files, answers, strict=True)
    ]


def _median(stage: Callable[[], object]) -> float:
    timings = []
    for _ in range(9):
        start = time.perf_counter()
        stage()
        timings.append(time.perf_counter() - start)
    return statistics.median(timings)


def _memory(model: Path, clips: int, form: str) -> Row:
    """Peak of one process that has done nothing else, and how much of it came after a tenth."""
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        peaks = pool.submit(_peaks, model, clips, form).result()
    grown = peaks[-1] - peaks[len(peaks) // 10]
    name = (
        f"peak memory of one process, {clips} clips as {form}; after a tenth it grew {grown:.0f} MB"
    )
    return Row(name, peaks[-1], "MB", "", None, MEMORY)


def _peaks(model: Path, clips: int, form: str) -> list[float]:
    with tempfile.TemporaryDirectory() as target:
        return Bench.of(model, clips, form).export("folder", process_pool.run_here, target)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("--clips", type=int, default=CLIPS)
    parser.add_argument("--format", default=FORM)
    parser.add_argument("--long", type=int, default=0)
    options = parser.parse_args()
    table_rows = rows(options.model, options.clips, options.format)
    if options.long:
        table_rows.append(_memory(options.model, options.long, options.format))
    print(table(table_rows))


if __name__ == "__main__":
    main()
