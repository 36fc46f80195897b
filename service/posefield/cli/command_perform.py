"""The `posefield perform` command: one long motion from a script."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from posefield.common import atomic_files
from posefield.common.errors import FileError, InvalidField
from posefield.console.options import (
    CharacterOptions,
    Json,
    with_option_groups,
    with_question_options,
)
from posefield.console.output import as_json
from posefield.encode import formats
from posefield.encode.formats import encoder_for
from posefield.question import json_decoding
from posefield.question.performance_question import (
    CrowdStageQuestion,
    PerformanceLayout,
    PerformanceQuestion,
)
from posefield.question.performance_report import PerformanceAnswer, PerformanceReport
from posefield.registry import model_registry
from posefield.synthesis.poses import MAX_POSES

if TYPE_CHECKING:
    from posefield.characters.user_character import UserCharacter
    from posefield.synthesis.synthesizer import Synthesizer

MAX_FRAMES = 10 * MAX_POSES


@dataclass(frozen=True)
class ManyArguments:
    """Options for many scripts."""

    crowd: Annotated[
        bool,
        typer.Option(
            "--crowd",
            help="write many scripts as one stage with a character for each: usd, usda, usdc or "
            "usdz",
        ),
    ] = False
    format: Annotated[
        str | None, typer.Option(help="format of the files of many scripts; default: usdc")
    ] = None
    workers: Annotated[
        int | None,
        typer.Option(help="number of processes for many scripts; default: one per core"),
    ] = None


@dataclass(frozen=True)
class OneArguments(CharacterOptions):
    """Options for what is written of each script, and for whom."""

    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            help="output file, whose extension selects the format; for many scripts a folder or "
            "the URL of an object store",
            metavar="PATH",
        ),
    ] = None
    layout: Annotated[
        PerformanceLayout,
        typer.Option(
            help="animations in USD files: one of the whole, or besides it one of each segment"
        ),
    ] = "whole"
    plan: Annotated[
        bool, typer.Option("--plan", help="print the timeline and the warnings, and no poses")
    ] = False


@with_question_options(CrowdStageQuestion)
@with_option_groups
def perform(
    script: Annotated[
        Path,
        typer.Argument(
            help="JSON file with the script; for many scripts a folder of them, or JSON Lines",
            metavar="SCRIPT",
        ),
    ],
    one: OneArguments,
    many: ManyArguments,
    question: CrowdStageQuestion,
    model: Annotated[
        list[Path] | None,
        typer.Option(
            help="model file or folder of them, besides the shipped ones; may be repeated",
            metavar="MODEL",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Write the motion of a script: walks, acts and holds as one.

    The file's extension is usda, usdc, usdz, glb, bvh, json, vrma, npz, arrow or msgpack. Of many
    scripts, each has a file in the folder performances and a line in manifest.jsonl; the same
    command resumes, and makes again what changed. With --crowd they are one stage.
    """
    from posefield.batch.scripts import are_many
    from posefield.performance import composition
    from posefield.performance.script import resolve_script

    _check_stage(question, many)
    if are_many(script):
        models = tuple(model or ())
        if many.crowd:
            facts, text = _perform_crowd(script, one, many, models, question)
        else:
            facts, text = _perform_many(script, one, many, models)
        typer.echo(as_json(facts) if json else text)
        return
    for option in ("crowd", "format", "workers"):
        if getattr(many, option) not in (None, False):
            raise InvalidField(option, "given for one script, expected a folder or a .jsonl file")
    if one.plan == (one.output is not None):
        options = "neither --output nor --plan" if one.output is None else "--output and --plan"
        raise InvalidField("output", f"{options}, expected one of them")
    if one.plan and one.layout != "whole":
        raise InvalidField("layout", f"{one.layout!r} with --plan, expected with an output file")
    script_question = json_decoding.decode_question(PerformanceQuestion, _read(script))
    find = model_registry.with_shipped(model or []).find
    if one.output is None:
        one.refuse("with --plan, expected with an output file")
        report = composition.plan(resolve_script(script_question, find), MAX_FRAMES)
        typer.echo(as_json(report.document()) if json else report_text(report))
        return
    path = Path(one.output)
    answer, content = _performed(script_question, find, path, one)
    atomic_files.write(content, path)
    facts = {"file": str(path), **answer.trust.document()}
    typer.echo(as_json(facts) if json else f"{path}\n{report_text(answer.trust)}")


def _performed(
    script_question: PerformanceQuestion,
    find: "Callable[[str], Synthesizer]",
    path: Path,
    one: OneArguments,
) -> tuple[PerformanceAnswer, bytes]:
    """Return the performance of a script, and its file, whose format is known before models are."""
    from posefield.performance import composition
    from posefield.performance.script import resolve_script

    form = encoder_for(path)
    encode = formats.performance_encoder(form, one.layout)
    script = resolve_script(script_question, find)
    question = script.question
    order = one.delivery(form, question, path)
    if order is None:
        convention = form.convention(question.unit, question.up, question.body)
        answer = composition.perform(script, MAX_FRAMES)
        return answer, encode(answer, convention)
    order.check_layout(one.layout)
    order.check(question, script.character.skeleton, script.character.roles)
    performance = order.performance(composition.perform(script, MAX_FRAMES), script.character.roles)
    return performance, order.encode(performance)


def _check_stage(question: CrowdStageQuestion, many: ManyArguments) -> None:
    """Raise InvalidField for options of a crowd without one, and of files with one."""
    defaults = CrowdStageQuestion()
    for name in question.__struct_fields__:
        if not many.crowd and getattr(question, name) != getattr(defaults, name):
            raise InvalidField(name, "given without --crowd, expected only with it")
    if many.crowd and many.format is not None:
        raise InvalidField("format", "given with --crowd, expected the output's extension")


def _output(one: OneArguments, expected: str) -> str:
    """Return the output of many scripts; InvalidField without one, or for a plan."""
    if one.plan:
        raise InvalidField("plan", "given for many scripts, expected one script in JSON")
    if one.output is None:
        raise InvalidField("output", f"none, expected {expected}")
    return one.output


def _workers(many: ManyArguments) -> int:
    from posefield.batch import process_pool

    workers = process_pool.usable_cores() if many.workers is None else many.workers
    if workers < 1:
        raise InvalidField("workers", f"{workers}, expected 1 or more")
    return workers


def _perform_many(
    scripts: Path, one: OneArguments, many: ManyArguments, models: tuple[Path, ...]
) -> tuple[dict[str, Any], str]:
    """Write a file for each script; return the outcome as plain values and as text."""
    from posefield.batch.scripts import PerformanceBatch, read_scripts, run
    from posefield.console.progress import ProgressBar

    output = _output(one, "a folder for the files of many scripts")
    form = encoder_for(Path(f"performance.{many.format or 'usdc'}")).extension
    workers, rows = _workers(many), read_scripts(scripts)
    character = _batch_character(output, one)
    batch = PerformanceBatch(models, output, form, one.layout, character)
    with ProgressBar("performances", len(rows), 0) as bar:
        outcome = run(batch, rows, workers, bar.advance)
    return outcome.facts(output), f"{output}: {outcome.sentence}"


def _batch_character(output: str, options: CharacterOptions) -> "UserCharacter | None":
    """Return the character of many scripts, to which files in the folder of performances refer."""
    from posefield.batch import target
    from posefield.batch.scripts import FOLDER

    if target.URL.match(output):
        options.refuse(
            "with the URL of an object store, expected a folder: files refer to its file"
        )
    return options.open(Path(output) / FOLDER)


def _perform_crowd(
    scripts: Path,
    one: OneArguments,
    many: ManyArguments,
    models: tuple[Path, ...],
    question: CrowdStageQuestion,
) -> tuple[dict[str, Any], str]:
    """Write one stage with a character for each script; return its report in both forms."""
    from posefield.batch import performance_crowd
    from posefield.batch.scripts import read_scripts
    from posefield.console.progress import ProgressBar

    output = Path(_output(one, "a file for the crowd"))
    one.refuse("with --crowd, expected without: a crowd has the characters of its models")
    if one.layout != "whole":
        raise InvalidField("layout", f"{one.layout!r} with --crowd, expected 'whole'")
    crowd = performance_crowd.from_question(models, output, question)
    workers, rows = _workers(many), read_scripts(scripts)
    with ProgressBar("performances", len(rows), 0) as bar:
        facts = performance_crowd.write(crowd, rows, workers, bar.advance)
    return facts, performance_crowd.report_text(facts)


def _read(script: Path) -> bytes:
    """Return the content of a script; FileError if there is none to read."""
    try:
        return script.read_bytes()
    except OSError as fault:
        raise FileError(script, f"{fault.strerror}, expected a script in JSON") from fault


def report_text(report: PerformanceReport) -> str:
    """Return a report as lines: segments, joins, feet and warnings."""
    lines = [f"{report.duration:.2f} s, {report.frames} frames, character of {report.character}"]
    for index, segment in enumerate(report.segments):
        name = segment.model.partition("@")[0]
        lines.append(
            f"{index}  {segment.begins:6.2f} to {segment.ends:6.2f} s  {segment.kind} {name}, "
            f"give or take {100.0 * segment.sigma:.1f} cm"
        )
    for join in report.joins:
        lines.append(
            f"join at {join.time:.2f} s: {100.0 * join.distance:.1f} cm apart, {join.blend} over "
            f"{join.seconds:g} s, peak {join.peak:.1f} m/s² (usual {join.usual:.1f})"
        )
    if report.feet is not None:
        lines.append(
            f"feet skate {100.0 * report.feet.skate:.1f} cm/s, before "
            f"{100.0 * report.feet.skate_before:.1f} cm/s"
        )
    return "\n".join([*lines, *(f"warning: {sentence}" for sentence in report.warnings)])
