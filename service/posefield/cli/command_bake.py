"""The `posefield bake` command: a blend space of looping clips for game engines."""

import hashlib
from dataclasses import replace
from typing import Annotated

import orjson
import typer
from msgspec import structs

from posefield.batch import blend_space, layouts, process_pool, run
from posefield.batch.job import ExportJob, WorkerInput
from posefield.batch.rows import Row, RowFault, open_source
from posefield.cli import command_export
from posefield.cli.command_export import ExportMonitor
from posefield.common.errors import InvalidField
from posefield.console.options import Json, ModelPath, with_question_options
from posefield.model_file import checked_file
from posefield.question.motion_question import ClipQuestion, FileQuestion
from posefield.registry import model_registry

WITHOUT = {"controls", "targets", "joint_sigma", "character", "loop", "start", "end", "floor"}


@with_question_options(FileQuestion, without=WITHOUT)
def bake(
    model: ModelPath,
    output: Annotated[
        str, typer.Option("--output", "-o", help="output folder or URL of an object store")
    ],
    question: FileQuestion,
    grid: Annotated[
        list[str],
        typer.Option(
            help="values of a control; one or two controls with several are the axes",
            metavar="NAME=VALUES",
        ),
    ],
    form: Annotated[str, typer.Option("--format", help="file format of the clips")] = "glb",
    workers: Annotated[
        int | None, typer.Option(help="number of processes; default: one per core")
    ] = None,
    json: Json = False,
) -> None:
    """Write looping clips on a grid of controls, and blendspace.json for a game engine.

    The file has the axes, and of each clip its place, duration, speed, root motion and the times
    at which feet come down. Its errors compare blended poses with the model's between the grid's
    points. The root is a bone unless --root tells another. The same command resumes.
    """
    content = checked_file.read(model)
    opened = model_registry.open_model(model.stem, model, content)
    question = structs.replace(question, loop=True, root=question.root or "bone")
    source = open_source(opened, form, question, grid=grid)
    space, source = blend_space.open_grid(opened, source, grid)
    rows: list[Row[ClipQuestion]] = []
    for row in source.rows():
        if isinstance(row, RowFault):
            raise InvalidField("grid", f"{row.place}: {row.message}")
        rows.append(row)
    space = replace(space, samples=blend_space.synthesize(opened, rows))
    facts = blend_space.document(opened, space, rows, blend_space.measure(opened, space, rows[0]))
    text = orjson.dumps(facts, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE)
    job = ExportJob(
        opened.identity,
        hashlib.sha256(content).hexdigest(),
        source.digest,
        "folder",
        layouts.find_layout("folder").chunk,
        question.unit,
        question.up,
        question.names,
        question.root_bone,
        question.body,
    )
    work = WorkerInput(job, content, output, about=((blend_space.FILE, text),))
    runner = process_pool.open_runner(workers)
    with runner as processes, ExportMonitor() as monitor:
        outcome = run.run(work, source, monitor, processes)
    for line in blend_space.sentences(facts):
        typer.echo(line, err=json)
    command_export.finish(output, outcome, monitor, False, json)
