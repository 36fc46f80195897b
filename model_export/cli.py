"""The training job's commands: `sample`, `train`, `adapt` and `evaluate`."""

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from service.cli import Controls, Json, ModelPath, as_json, encoder, numbers, wrote
from service.motion import files
from service.motion.answer import ClipAnswer, Trust
from service.motion.errors import InvalidField, TrainingError

if TYPE_CHECKING:
    from model_export.evaluate.flags import Flags
    from model_export.evaluate.learning import Learning
    from model_export.evaluate.protocol import Result
    from model_export.export import Exported
    from model_export.ingest import Example
    from model_export.recipe import Recipe
    from model_export.train import Trained

Scheduler = Annotated[
    str | None,
    typer.Option(
        help="run on the workers of a Dask scheduler, which must have posefield installed too",
        metavar="tcp://HOST:PORT",
    ),
]

Up = Literal["y", "z"]
RootOffset = Literal["replace", "add"]


def commands(app: typer.Typer) -> None:
    """Add the training job's commands to the one command line."""
    app.command("sample")(sample)
    app.command("train")(train_command)
    app.command("adapt")(adapt)
    app.command("evaluate")(evaluate)


def sample(
    family: Annotated[str, typer.Argument(help="reaching")],
    output: Annotated[Path, typer.Option("--output", "-o", help="folder, or with --truth a file")],
    truth: Annotated[bool, typer.Option(help="write the noise-free motion of --control")] = False,
    control: Controls = None,
    fps: Annotated[float, typer.Option(help="frames a second, with --truth")] = 120.0,
    json: Json = False,
) -> None:
    """Write a procedural family of motions, or the truth behind it at any control point."""
    from model_export.sample import truth as truths
    from model_export.sample import write

    if family != "reaching":
        raise InvalidField("family", f"{family!r}, expected reaching")
    if not truth:
        path = write.family(output)
        typer.echo(
            as_json({"recipe": str(path)}) if json else f"{path}: train it with posefield train"
        )
        return
    encode = encoder(output).encode
    controls = numbers(control or [])
    clip = truths.clip(controls, fps)
    answer = ClipAnswer(clip, Trust("reaching@truth", controls, clip.duration, 0.0, ()))
    files.write(encode(answer), output)
    typer.echo(wrote(output, answer, json))


def train_command(
    recipe_files: Annotated[list[Path], typer.Argument(help="TOML files", metavar="RECIPE...")],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="the .onnx file to write; of several recipes a folder"),
    ],
    data: Annotated[
        Path | None, typer.Option(help="folder of the motion data; the recipe's own if not said")
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(help="the .html file to write on the training, with a .json beside it"),
    ] = None,
    jobs: Annotated[int | None, typer.Option(help="of several recipes: processes")] = None,
    scheduler: Scheduler = None,
    json: Json = False,
) -> None:
    """Train a recipe's model and write it as one .onnx file; several recipes at once."""
    _expect_html(report)
    if len(recipe_files) == 1 and (jobs, scheduler) == (None, None):
        _train(recipe_files[0], data, output, report, json)
    elif report:
        raise InvalidField("report", "of several recipes or on a cluster, expected none")
    else:
        _sweep(recipe_files, data, output, _Place(jobs, scheduler), json)


def _train(
    recipe_file: Path, data: Path | None, output: Path, report: Path | None, json: bool
) -> None:
    # SciPy and onnx take a second to import, which every other command would wait for.
    from model_export import export, ingest, recipe, train

    _expect_onnx(output)
    progress = _Progress()
    progress(f"reading {recipe_file}")
    own = recipe.read(recipe_file)
    examples, notes = ingest.ingest(own, data or recipe_file.parent)
    trained = train.train(own, examples, progress)
    progress("writing the graph and comparing it with the reference")
    exported = export.export(own, trained, notes)
    files.write(exported.content, output)
    if report:
        _write_report(own, trained, exported, progress, report)
    progress("done")
    typer.echo(as_json(_facts(exported, output)) if json else _summary(exported, output))


@dataclass(frozen=True)
class _Place:
    """Where several are trained: in so many processes here, or on a cluster."""

    jobs: int | None
    scheduler: str | None

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise InvalidField("jobs", f"{self.jobs}, expected 1 or more")


def _sweep(
    recipe_files: list[Path], data: Path | None, folder: Path, place: _Place, json: bool
) -> None:
    from model_export import sweep

    if folder.suffix == ".onnx":
        raise InvalidField("output", f"{folder.name!r}, expected a folder for several models")
    found, failed = [], []
    with _jobs(place.scheduler):
        for made in sweep.models(recipe_files, data, place.jobs):
            if isinstance(made.found, TrainingError):
                failed.append(made.name)
                typer.echo(f"{made.name}: {made.found}", err=True)
                continue
            path = folder / f"{made.name}.onnx"
            files.write(made.found.content, path)
            found.append(_facts(made.found, path))
            typer.echo(_summary(made.found, path), err=json)
    if json:
        typer.echo(as_json(sorted(found, key=lambda facts: str(facts["file"]))))
    if failed:
        raise TrainingError(f"{', '.join(sorted(failed))} of {len(recipe_files)} made no model")


def _expect_html(report: Path | None) -> None:
    if report and report.suffix != ".html":
        raise InvalidField("report", f"{report.name!r}, expected a name that ends in .html")


def adapt(
    model: ModelPath,
    clips: Annotated[
        list[Path] | None,
        typer.Argument(
            help="BVH files of one new performer, one to five or more", metavar="CLIP..."
        ),
    ] = None,
    *,
    output: Annotated[Path, typer.Option("--output", "-o", help="the .onnx file to write")],
    performer: Annotated[str, typer.Option(help="their name, by which they are asked for")],
    unit: Annotated[float, typer.Option(help="length of one unit of the files", metavar="METRES")],
    up: Annotated[Up, typer.Option(help="up axis of the files")],
    licence: Annotated[str, typer.Option(help="of the new clips, with what it asks to be said")],
    table: Annotated[
        Path | None,
        typer.Option(
            help="instead of clips: CSV with columns file, first_frame, last_frame and controls by "
            "name; what the model can measure may be left out"
        ),
    ] = None,
    root_offset: Annotated[
        RootOffset | None,
        typer.Option(help="whether root position channels replace the root's OFFSET or add to it"),
    ] = None,
    json: Json = False,
) -> None:
    """Add a performer to a model by a few clips, without the data that it was trained from."""
    from model_export import adapted_file, new_clips, reopen
    from model_export.adapted_file import Newcomer

    _expect_onnx(output)
    if bool(clips) == bool(table):
        raise InvalidField("clips", "expected either motion files or --table")
    if not (0.0 < unit < float("inf")):
        raise InvalidField("unit", f"{unit}, expected a length in metres")
    if not licence.strip():
        raise InvalidField("licence", "blank, expected a text")
    progress = _Progress()
    progress(f"reading {model}")
    known = reopen.load(model)
    adapted_file.refuse_name(known.card, performer)
    source = new_clips.Source(unit, up, root_offset)
    progress("reading clips")
    if table:
        examples, notes = new_clips.of_table(known, table, source, performer)
    else:
        examples, notes = new_clips.of_files(known, clips or [], source, performer)
    progress("adapting, and comparing the graph with the reference")
    made = adapted_file.make(known, Newcomer(performer, examples, licence, notes))
    files.write(made.content, output)
    progress("done")
    typer.echo(as_json(_facts(made, output)) if json else _summary(made, output))


def _expect_onnx(output: Path) -> None:
    if output.suffix != ".onnx":
        raise InvalidField("output", f"{output.name!r}, expected a name that ends in .onnx")


class Protocol(StrEnum):
    """Ways to ask how good a model is."""

    CLIP = "clip"
    PERFORMER = "performer"
    TRUTH = "truth"


def evaluate(
    recipe_file: Annotated[
        Path | None, typer.Argument(help="a TOML file", metavar="RECIPE", show_default=False)
    ] = None,
    data: Annotated[
        Path | None, typer.Option(help="folder of the motion data; the recipe's own if not said")
    ] = None,
    protocol: Annotated[
        list[Protocol] | None,
        typer.Option(help="hold out clips, or performers, or compare with the truth; all that can"),
    ] = None,
    report: Annotated[Path | None, typer.Option(help="the .html file to write")] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="the .json file to write", metavar="FILE")
    ] = None,
    joined: Annotated[
        Path | None,
        typer.Option(help="another recipe: is the gap between both flagged?", metavar="RECIPE"),
    ] = None,
    learning: Annotated[
        bool, typer.Option(help="what suggested clips are worth, on the procedural family")
    ] = False,
    table1: Annotated[bool, typer.Option(help="Table 1 of the paper, measured again")] = False,
    scheduler: Scheduler = None,
) -> None:
    """Measure how far a recipe's models lie from motions they have not seen, beside other methods.

    Everything is fitted anew without what is held out.
    """
    _expect_html(report)
    if table1 and scheduler:
        raise InvalidField("scheduler", "Table 1 is timed on one machine, expected none")
    if table1:
        _table1(json_file)
    elif recipe_file is None:
        raise InvalidField("RECIPE", "missing: expected a recipe, or --table1")
    else:
        asked = [one.value for one in protocol or []]
        wanted = _Wanted(asked, report, json_file, scheduler, joined, learning)
        _evaluate(recipe_file, data or recipe_file.parent, wanted)


def _table1(json_file: Path | None) -> None:
    from model_export.evaluate import table1

    found = table1.measure()
    if json_file:
        files.write(as_json(table1.facts(found)).encode(), json_file)
    typer.echo(table1.text(found))


@dataclass(frozen=True)
class _Wanted:
    """Protocols, all that can for none, what to write, where to work, the recipe of a family that
    is joined to this one, and whether suggested clips are tried out."""

    protocols: list[str]
    report: Path | None
    json_file: Path | None
    scheduler: str | None
    joined: Path | None
    learning: bool


@dataclass(frozen=True)
class _Family:
    """A recipe and what it was read to."""

    recipe: "Recipe"
    examples: "list[Example]"


def _evaluate(recipe_file: Path, data: Path, wanted: _Wanted) -> None:
    from model_export.evaluate import summary

    # What cannot be done is refused before minutes of work.
    own = _family(recipe_file, data, wanted)
    other = _joined(own, data, wanted)
    results = _protocols(own, wanted)
    typer.echo(f"{summary.LEGEND}\n{summary.definitions(results)}")
    curve = _learning(wanted)
    more = _beside(own, other, results, curve)
    first, *others = map(summary.facts, results)
    if wanted.json_file:
        files.write(as_json({**first, **more, "others": others}).encode(), wanted.json_file)
    if wanted.report:
        from model_export.evaluate import render

        files.write(render.html(own.recipe.description, results, curve), wanted.report)


def _family(recipe_file: Path, data: Path, wanted: _Wanted) -> _Family:
    """A recipe's family; InvalidField for what it cannot be asked."""
    from model_export import ingest, recipe
    from model_export.evaluate import protocol

    own = recipe.read(recipe_file)
    if wanted.learning and not own.truth:
        raise InvalidField("learning", f"{own.name} has no truth, expected the procedural family")
    examples, _ = ingest.ingest(own, data)
    can = protocol.protocols(own, examples)
    for name in wanted.protocols:
        if name not in can:
            raise InvalidField("protocol", f"{name!r}, but {own.name} can only: {', '.join(can)}")
    return _Family(own, examples)


@dataclass(frozen=True)
class _Joined:
    """Name of a family joined to the evaluated one, and what is flagged between both."""

    name: str
    flags: "Flags"


def _joined(own: _Family, data: Path, wanted: _Wanted) -> _Joined | None:
    """None where no other family is named."""
    from model_export import ingest, recipe
    from model_export.evaluate import flags

    if not wanted.joined:
        return None
    other = recipe.read(wanted.joined)
    examples, _ = ingest.ingest(other, data)
    return _Joined(other.name, flags.joined(own.recipe, own.examples, other, examples))


def _protocols(own: _Family, wanted: _Wanted) -> "list[Result]":
    """What the protocols found, each told as soon as it is done."""
    from model_export.evaluate import protocol, reach, summary, worth

    can = protocol.protocols(own.recipe, own.examples)
    results = []
    with _jobs(wanted.scheduler, [own.examples]):
        for name in wanted.protocols or can:
            with _bar(name) as progress:
                results.append(protocol.run(own.recipe, own.examples, name, progress))
            trust = "\n".join(summary.trust_said(results[-1]))
            typer.echo(f"{summary.table(results[-1])}\n\n{trust}\n")
            if results[-1].corrections:
                typer.echo(f"{reach.table(results[-1])}\n")
    for said in worth.said(results):
        typer.echo(said)
    return results


def _beside(
    own: _Family, other: _Joined | None, results: "list[Result]", curve: "Learning | None"
) -> dict[str, Any]:
    """What else was measured: of a joined family, of performers, and of suggested clips."""
    from model_export.evaluate import learning, summary, worth

    more: dict[str, Any] = {}
    if other:
        said = summary.flags_said(other.flags)
        typer.echo(f"\n{own.recipe.name} and {other.name} joined, {said}")
        more["joined"] = {"family": other.name, "support": summary.flags_facts(other.flags)}
    if named := worth.facts(results):
        more["performers"] = named
    if curve:
        more["learning"] = learning.facts(curve)
        typer.echo(f"\n{learning.table(curve)}")
    return more


def _learning(wanted: _Wanted) -> "Learning | None":
    """What suggested clips are worth; none where nobody asks."""
    from model_export.evaluate import learning

    if not wanted.learning:
        return None
    with _jobs(wanted.scheduler), _bar("learning") as progress:
        return learning.measure(progress)


def _jobs(scheduler: str | None, shared: Sequence[Any] = ()) -> AbstractContextManager[None]:
    """Inside, jobs run on a cluster, or here where none is named."""
    if scheduler is None:
        return nullcontext()
    from model_export import cluster

    return cluster.jobs(scheduler, shared)


@contextmanager
def _bar(name: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on standard error that is told how many parts are done, of how many."""
    with typer.progressbar(length=1, label=name, file=sys.stderr) as bar:

        def progress(done: int, parts: int) -> None:
            bar.length = parts
            bar.update(done - bar.pos)

        yield progress


class _Progress:
    """Says each step as it begins, and remembers when that was."""

    def __init__(self) -> None:
        self._begun: list[tuple[str, float]] = []

    def __call__(self, step: str) -> None:
        self._begun.append((step, time.perf_counter()))
        typer.echo(f"{self._begun[-1][1] - self._begun[0][1]:6.1f} s  {step}", err=True)

    @property
    def finished(self) -> list[tuple[str, float]]:
        """Steps that another has followed, and how long each took, s."""
        return [(step, end - start) for (step, start), (_, end) in pairwise(self._begun)]


def _write_report(
    recipe: "Recipe", trained: "Trained", exported: "Exported", progress: _Progress, path: Path
) -> None:
    # Nobody who wants no pictures waits for matplotlib, or needs it.
    from model_export.report import detail, render
    from model_export.report.about import Step

    progress("measuring levels of detail")
    ladder = detail.of(recipe, trained, exported)
    progress("drawing the report")
    steps = [Step(name, seconds) for name, seconds in progress.finished]
    rendered = render.render(trained, exported, ladder, steps)
    files.write(rendered.html, path)
    files.write(rendered.json, path.with_suffix(".json"))


def _facts(exported: "Exported", output: Path) -> dict[str, Any]:
    card = exported.card
    return {
        "file": str(output),
        "bytes": len(exported.content),
        "clips": card.samples,
        "ranks": list(card.levels[0].ranks),
        **card.diagnostics,
    }


def _summary(exported: "Exported", output: Path) -> str:
    facts = _facts(exported, output)
    notes = [f"note: {note}" for note in facts["notes"]]
    return "\n".join(
        [
            *notes,
            f"{output}: {facts['bytes'] / 1000:.1f} kB from {facts['clips']} clips, "
            f"ranks {facts['ranks']} of {facts['tensor']}",
            f"truncation costs {100 * facts['truncation_rms_m']:.2f} cm, a clip left out lies "
            f"{100 * facts['leave_one_out_rms_m']:.2f} cm away (root mean square over joints)",
            f"onnxruntime differs from the reference by at most {100 * facts['parity_m']:.5f} cm",
        ]
    )
