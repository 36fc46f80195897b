"""`posefield export`: many clips at once, to a folder or an object store."""

import hashlib
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Annotated

import orjson
import typer

from service.encode.convention import Unit, Up
from service.export import crew, layouts, queries, run, target
from service.export.job import Job, Work
from service.export.layouts import LAYOUTS
from service.export.look import Look
from service.export.queries import Asked
from service.export.reading import Defaults
from service.export.run import Outcome, Shard
from service.motion.errors import InvalidField
from service.motion.roles import Names
from service.synthesis import intake, session, spelling
from service.synthesis.question import FPS, NAMES, POLICY, ROOT, ClipQuestion, Policy, Root


def export(
    model: Annotated[Path, typer.Argument(help="a model file", metavar="MODEL")],
    output: Annotated[str, typer.Option("--output", "-o", help="folder, or an object store's URL")],
    table: Annotated[
        Path | None,
        typer.Argument(help="CSV, Parquet or JSON Lines, a row a clip", metavar="[QUERIES]"),
    ] = None,
    grid: Annotated[
        list[str] | None,
        typer.Option(help="instead: values of a control; every combination", metavar="NAME=VALUES"),
    ] = None,
    sample: Annotated[int | None, typer.Option(help="instead: so many points")] = None,
    method: Annotated[str | None, typer.Option(help="of sampling, latin or hull")] = None,
    seed: Annotated[int | None, typer.Option(help="of sampling")] = None,
    form: Annotated[str, typer.Option("--format", help="where a row says none")] = "usdc",
    layout: Annotated[str, typer.Option(help=f"one of {', '.join(LAYOUTS)}")] = "folder",
    fps: Annotated[float, typer.Option(help="frames a second, where a row says none")] = FPS,
    level: Annotated[int, typer.Option(help="of detail, where a row says none")] = 0,
    performer: Annotated[str | None, typer.Option(help="who moves, where a row says none")] = None,
    extrapolate: Annotated[
        Policy, typer.Option(help="controls like which nothing was captured: answer, warn, refuse")
    ] = POLICY,
    names: Annotated[Names, typer.Option(help="what joints are called")] = NAMES,
    root: Annotated[Root, typer.Option(help="travelling, or in place")] = ROOT,
    loop: Annotated[
        bool, typer.Option("--loop", help="cycles that end with the frame they begin with")
    ] = False,
    exact: Annotated[
        str | None,
        typer.Option(
            help="measured controls to be met exactly, where a row says none",
            metavar="auto|none|NAME,NAME",
        ),
    ] = None,
    pin_feet: Annotated[
        bool, typer.Option("--pin-feet", help="keep feet that stand where they stand")
    ] = False,
    unit: Annotated[
        Unit | None, typer.Option(help="of length; what is usual in the format if not said")
    ] = None,
    up: Annotated[Up | None, typer.Option(help="axis; what is usual if not said")] = None,
    chunk: Annotated[
        int | None, typer.Option(help="rows done together, and clips of an archive")
    ] = None,
    workers: Annotated[int | None, typer.Option(help="processes; one a core if not said")] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="instead of processes here: workers of a Dask scheduler, posefield on each",
            metavar="tcp://HOST:PORT",
        ),
    ] = None,
    shard: Annotated[
        str, typer.Option(help="part I of N alone, from 0/N to N-1/N", metavar="I/N")
    ] = "0/1",
    skip_errors: Annotated[
        bool, typer.Option("--skip-errors", help="leave rows at fault out, and list them")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="facts as JSON on standard output")] = False,
) -> None:
    """Write a clip for each row of a table, or for each point of a grid or a sampling.

    What was broken off is gone on with by the same command, and ends with the same files.
    """
    content = session.read(model)
    usual = layouts.find(layout).chunk
    asked = Asked(table, tuple(grid or ()), sample, method, seed)
    question = ClipQuestion(
        {},
        fps,
        extrapolate,
        performer=performer,
        level=level,
        names=names,
        root=root,
        loop=loop,
        hold=spelling.hold(exact, (), pin_feet),
    )
    opened = intake.opened(model.stem, model, content)
    source = queries.source(asked, Defaults(form, question), opened)
    job = Job(
        opened.identity,
        hashlib.sha256(content).hexdigest(),
        source.digest,
        layout,
        usual if chunk is None else chunk,
        unit,
        up,
        names,
    )
    part = Shard.of(shard)
    with _crew(workers, scheduler) as by, Look() as look:
        work = Work(job, content, _wherever(output) if scheduler else output, skip_errors)
        outcome = run.run(work, source, look, by, part)
    _end(output, outcome, look, json)


def _crew(workers: int | None, scheduler: str | None) -> AbstractContextManager[crew.Crew]:
    if workers is not None and scheduler is not None:
        raise InvalidField("workers", f"{workers}, but a scheduler has its own; expected one")
    if workers is not None and workers < 1:
        raise InvalidField("workers", f"{workers}, expected 1 or more")
    if scheduler is None:
        return nullcontext(crew.of(workers or crew.usable_cores()))
    # An extra: most exports are done on one machine.
    from service.export import cluster

    return cluster.crew(scheduler)


def _wherever(output: str) -> str:
    """The target as it is called from any folder."""
    return output if target.URL.match(output) else str(Path(output).absolute())


def _end(place: str, outcome: Outcome, look: Look, json: bool) -> None:
    """Say what came of it; an export that was told to stop ends as whoever told it expects."""
    if json:
        facts = {
            "target": place,
            "rows": outcome.rows,
            "done": outcome.done,
            "seconds": look.pace.seconds,
            "export": outcome.facts,
        }
        typer.echo(orjson.dumps(facts, option=orjson.OPT_INDENT_2))
    typer.echo(_said(place, outcome, look), err=json)
    if look.told and outcome.done < outcome.rows:
        raise typer.Exit(128 + look.told)


def _said(place: str, outcome: Outcome, look: Look) -> str:
    if outcome.done < outcome.rows:
        return (
            f"{place}: stopped when {outcome.done} of {outcome.rows} clips were done; the same "
            "command goes on from there"
        )
    if outcome.facts is None:
        return f"{place}: clips of this part: {outcome.rows}, all done; other parts are not yet"
    facts = outcome.facts
    said = f"{place}: {facts['clips']} clips, {facts['bytes'] / 1e6:.1f} MB"
    if facts["warned"]:
        said += f", {facts['warned']} of them like nothing that was captured, or out of reach"
    if facts["skipped"]:
        said += f", rows skipped and listed in skipped.jsonl: {facts['skipped']}"
    if outcome.before:
        return f"{said}; it was complete before"
    return f"{said}, in {look.pace.seconds:.1f} s, {look.pace.rate:,.0f} a second"
