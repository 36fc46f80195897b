"""The `posefield export` command: many clips at once, to a folder or an object store."""

import hashlib
import signal
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Self

import typer

from posefield.batch import layouts, process_pool, run, target
from posefield.batch.checkpoint import ChunkResult
from posefield.batch.clip_files import MAX_KEPT_FAULTS
from posefield.batch.job import ExportJob, WorkerInput
from posefield.batch.layouts import LAYOUTS
from posefield.batch.rows import open_source
from posefield.batch.run import RunOutcome, Shard
from posefield.console.options import (
    CharacterOptions,
    Json,
    ModelPath,
    with_option_groups,
    with_question_options,
)
from posefield.console.output import as_json
from posefield.model_file import checked_file
from posefield.question.motion_question import FileQuestion
from posefield.registry import model_registry

if TYPE_CHECKING:
    from posefield.characters.user_character import UserCharacter


@dataclass(frozen=True)
class RowArguments:
    """Rows of an export, and the format of their clips."""

    table: Annotated[
        Path | None,
        typer.Argument(help="CSV, Parquet or JSON Lines file, one row per clip", metavar="QUERIES"),
    ] = None
    grid: Annotated[
        list[str] | None,
        typer.Option(
            help="instead of a table: values of a control; exports every combination",
            metavar="NAME=VALUES",
        ),
    ] = None
    sample: Annotated[
        int | None, typer.Option(help="instead of a table: number of random control points")
    ] = None
    method: Annotated[
        str | None, typer.Option(help="sampling method of --sample: latin or hull")
    ] = None
    seed: Annotated[int | None, typer.Option(help="random seed of --sample")] = None
    form: Annotated[str, typer.Option("--format", help="file format of the clips")] = "usdc"


@dataclass(frozen=True)
class RunArguments(CharacterOptions):
    """Execution of an export, the layout of its files, and whom they move."""

    layout: Annotated[str, typer.Option(help=f"layout of the output: {', '.join(LAYOUTS)}")] = (
        "folder"
    )
    chunk: Annotated[
        int | None, typer.Option(help="rows per chunk; also the clips per archive")
    ] = None
    workers: Annotated[
        int | None, typer.Option(help="number of processes; default: one per core")
    ] = None
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="run on the workers of this Dask scheduler; posefield must be installed on them",
            metavar="tcp://HOST:PORT",
        ),
    ] = None
    shard: Annotated[
        str, typer.Option(help="export only part I of N; I is 0 to N-1", metavar="I/N")
    ] = "0/1"
    skip_errors: Annotated[
        bool, typer.Option("--skip-errors", help="skip invalid rows and list them")
    ] = False
    verify: Annotated[
        bool,
        typer.Option(
            "--verify",
            help="verify the SHA-256 of files from earlier runs; default: verify only sizes",
        ),
    ] = False


@with_question_options(FileQuestion, without={"controls", "targets", "joint_sigma", "character"})
@with_option_groups
def export(
    model: ModelPath,
    output: Annotated[
        str, typer.Option("--output", "-o", help="output folder or URL of an object store")
    ],
    question: FileQuestion,
    rows: RowArguments,
    execution: RunArguments,
    json: Json = False,
) -> None:
    """Write many clips: one for each row of a table, or point of a grid.

    A column of the table takes precedence over the option of the same name. The same command
    resumes an interrupted export and gives the same files. It rewrites missing or damaged files.
    With --character, the character of another file moves, as in `posefield clip`.
    """
    content = checked_file.read(model)
    opened = model_registry.open_model(model.stem, model, content)
    source = open_source(
        opened,
        rows.form,
        question,
        path=rows.table,
        grid=rows.grid or (),
        sample=rows.sample,
        method=rows.method,
        seed=rows.seed,
    )
    layout = layouts.find_layout(execution.layout)
    character = _character(output, execution)
    if character is not None:
        card = opened.session.card
        # Modules that only exports for a character need.
        from posefield.retarget import role_map

        role_map.body_of_motion(card.skeleton, card.skeleton.offsets, card.roles)
    job = ExportJob(
        opened.identity,
        hashlib.sha256(content).hexdigest(),
        source.digest,
        execution.layout,
        layout.chunk if execution.chunk is None else execution.chunk,
        question.unit,
        question.up,
        question.names,
        question.root_bone,
        question.body,
        () if character is None else character.facts,
    )
    shard = Shard.parse(execution.shard)
    # Workers of a cluster have other working folders.
    local = execution.scheduler and not target.URL.match(output)
    location = str(Path(output).absolute()) if local else output
    opened_runner = process_pool.open_runner(execution.workers, execution.scheduler)
    with opened_runner as runner, ExportMonitor() as monitor:
        work = WorkerInput(job, content, location, execution.skip_errors, character)
        outcome = run.run(work, source, monitor, runner, shard, execution.verify)
    finish(output, outcome, monitor, execution.verify, json)


def _character(output: str, execution: RunArguments) -> "UserCharacter | None":
    """Return the character to which the clips in a folder refer; None without one."""
    if target.URL.match(output):
        execution.refuse("with a URL as output, expected a folder: files refer to its file")
    if execution.scheduler is not None:
        execution.refuse("with --scheduler, expected --workers: the file is read on this machine")
    character = execution.open(Path(output) / layouts.CHARACTER_FOLDER)
    if character is not None:
        run.check_character_layout(execution.layout)
    return character


class ExportMonitor:
    """Progress display of a run, which also records SIGINT or SIGTERM after the run has begun.

    signal: the number of the first such signal, else None. A second signal raises KeyboardInterrupt
    at once.
    """

    def __init__(self) -> None:
        self.signal: int | None = None
        self._done = self._skipped = 0
        self._began = time.monotonic()
        self._print: Callable[[str], None] = lambda line: typer.echo(line, err=True)
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def begin(self, total: int, done: int) -> None:
        """Start the progress display and the signal handlers."""
        # Importing rich takes 0.1 s, which other commands must not spend.
        from posefield.console.progress import ProgressBar

        self._began = time.monotonic()
        self._bar = self._stack.enter_context(ProgressBar("clips", total, done))
        self._print = self._bar.print
        if done:
            self.note(f"resumed: {done} of {total} clips were finished")
        for number in (signal.SIGINT, signal.SIGTERM):
            self._stack.callback(signal.signal, number, signal.signal(number, self._receive))

    def advance(self, chunk: ChunkResult) -> None:
        """Show that a chunk is finished, and the first of the rows that were skipped."""
        for fault in chunk.skipped[: max(MAX_KEPT_FAULTS - self._skipped, 0)]:
            self.note(f"skipped: {fault.place}: {fault.message}")
        self._skipped += len(chunk.skipped)
        self._done += chunk.clips + len(chunk.skipped)
        self._bar.advance(chunk.clips + len(chunk.skipped))

    def note(self, message: str) -> None:
        """Print a line on standard error."""
        self._print(message)

    def stopped(self) -> bool:
        """Return whether a signal was received."""
        return self.signal is not None

    @property
    def seconds(self) -> float:
        """Seconds since the run began."""
        return time.monotonic() - self._began

    @property
    def rate(self) -> float:
        """Rows a second in this run."""
        return self._done / max(self.seconds, 1e-9)

    def _receive(self, number: int, frame: FrameType | None) -> None:
        if self.stopped():
            raise KeyboardInterrupt
        self.signal = number


def finish(
    location: str, outcome: RunOutcome, monitor: ExportMonitor, verify: bool, json: bool
) -> None:
    """Print the outcome; exit with the code that shells expect after a signal."""
    if json:
        facts = {
            "target": location,
            "rows": outcome.rows,
            "done": outcome.done,
            "seconds": monitor.seconds,
            "export": outcome.facts,
        }
        typer.echo(as_json(facts))
    typer.echo(_summary(location, outcome, monitor, verify), err=json)
    if monitor.signal and outcome.done < outcome.rows:
        raise typer.Exit(128 + monitor.signal)


def _summary(location: str, outcome: RunOutcome, monitor: ExportMonitor, verify: bool) -> str:
    if outcome.done < outcome.rows:
        return (
            f"{location}: stopped when {outcome.done} of {outcome.rows} clips were finished; the "
            "same command resumes the export"
        )
    if outcome.facts is None:
        return f"{location}: clips of this part: {outcome.rows}, all finished; other parts are not"
    facts = outcome.facts
    text = f"{location}: {facts['clips']} clips, {facts['bytes'] / 1e6:.1f} MB"
    if facts["warned"]:
        text += f", with a warning in the manifest: {facts['warned']}"
    if facts["skipped"]:
        text += f", rows skipped and listed in skipped.jsonl: {facts['skipped']}"
    if outcome.already_complete:
        checked = ", and all checksums agree" if verify else ""
        return f"{text}; it was complete before{checked}"
    return f"{text}, in {monitor.seconds:.1f} s, {monitor.rate:,.0f} a second"
