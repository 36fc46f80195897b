"""The `posefield models`, `inspect`, `why` and `suggest` commands: facts of models."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from posefield.batch import rows
from posefield.common.errors import ModelError
from posefield.console.options import Json, ModelPath, open_model, with_question_options
from posefield.console.output import LateProgress, as_json, print_warnings
from posefield.encode import model_tables
from posefield.inference import level_selection, session
from posefield.model_file import checked_file
from posefield.model_file import model_card as cards
from posefield.model_file.model_card import ModelCard
from posefield.motion import measures
from posefield.question.model_question import SuggestQuestion, WhyQuestion
from posefield.registry import model_registry
from posefield.registry.model_sources import ModelFile
from posefield.synthesis.trust import explain_result as find_reasons
from posefield.synthesis.trust import suggest as find_suggestions

HEADING = ("name", "controls", "clips", "performers", "size", "file", "licence")


@dataclass(frozen=True)
class LocalModel:
    """A model file with its card. size: of the file, bytes. digest: of its content."""

    file: ModelFile
    card: ModelCard
    size: int
    digest: str

    @property
    def licence(self) -> str:
        """Return the licence that the card names; empty for a card without one."""
        return str(self.card.provenance.get("licence", ""))

    def facts(self) -> dict[str, Any]:
        """Return the model as JSON values."""
        return {
            "name": self.file.name,
            "identity": f"{self.file.name}@{self.digest}",
            "description": self.card.description,
            "controls": [
                {"name": c.name, "minimum": c.minimum, "maximum": c.maximum, "unit": c.unit}
                for c in self.card.controls
            ],
            "clips": self.card.samples,
            "performers": list(self.card.performers),
            "labels": {label_set.name: list(label_set.names) for label_set in self.card.labels},
            "bytes": self.size,
            "licence": self.licence,
            "file": self.file.location,
        }

    def cells(self) -> tuple[str, ...]:
        """Return the model's cells of the table, in the order of HEADING."""
        return (
            self.file.name,
            ", ".join(control.name for control in self.card.controls),
            str(self.card.samples),
            str(len(self.card.performers)),
            f"{self.size / 1000:.0f} kB",
            self.file.location,
            self.licence,
        )


def models(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            help="model files, folders with model files, or URLs of object stores, which are "
            "listed after the shipped models",
            metavar="PLACES",
            show_default=False,
        ),
    ] = None,
    json: Json = False,
) -> None:
    """List the models that ship with posefield, and those of PLACES.

    A file that is no model is named on standard error, and the exit code is then 3.
    """
    listed = list(_listed([str(model_registry.SHIPPED_FOLDER), *(sources or ())]))
    local_models = [one for one in listed if isinstance(one, LocalModel)]
    faults = [one for one in listed if isinstance(one, ModelError)]
    if json:
        typer.echo(as_json([model.facts() for model in local_models]))
    else:
        typer.echo(_table([HEADING, *(model.cells() for model in local_models)]))
        typer.echo(f"origin and licences of the shipped models: {model_registry.NOTICE}")
    for fault in faults:
        typer.echo(f"posefield: {fault}", err=True)
    if faults:
        raise typer.Exit(3)


def _listed(sources: list[str]) -> Iterator[LocalModel | ModelError]:
    """Yield the models of places in order, or the error of a place or file."""
    for source in sources:
        try:
            files = model_registry.open_source(source)()
        except ModelError as fault:
            yield fault
            continue
        for file in files:
            try:
                content = file.read()
                card = checked_file.load_card(content, file.location)
            except ModelError as fault:
                yield fault
            else:
                yield LocalModel(file, card, len(content), checked_file.digest(content))


def _table(rows: list[tuple[str, ...]]) -> str:
    """Return rows as text with aligned columns, two blanks apart."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ("  ".join(map(str.ljust, row, widths)) for row in rows)
    return "\n".join(line.rstrip() for line in lines)


def inspect(model: ModelPath, json: Json = False) -> None:
    """Print a model's controls, levels of detail, errors and licence.

    The time per pose is measured on this machine.
    """
    opened = session.load(model)
    with LateProgress("rounds of timing") as bar:
        seconds = level_selection.seconds_per_pose(opened, bar.update)
    plain = {
        "identity": f"{model.stem}@{opened.digest}",
        **cards.plain_values(opened.card),
        "seconds_per_pose": seconds,
    }
    typer.echo(as_json(plain) if json else _summary(plain))


def _summary(plain: dict[str, Any]) -> str:
    """Return a summary of a model card, within one screen."""
    diagnostics = plain["diagnostics"]
    levels = zip(plain["levels"], plain["seconds_per_pose"], strict=True)
    lines = [
        f"{plain['identity']}: {plain['description']}",
        f"{plain['samples']} clips of {len(plain['skeleton']['names'])} joints, "
        f"{plain['durations'][0]:.2f} to {plain['durations'][1]:.2f} s, {plain['root']}"
        f"{', cyclic' if plain['cyclic'] else ''}",
        f"ranks {plain['levels'][0]['ranks']} of {diagnostics['tensor']}: truncation costs "
        f"{100 * diagnostics['truncation_rms_m']:.2f} cm, a clip left out lies "
        f"{100 * diagnostics['leave_one_out_rms_m']:.2f} cm away (root mean square over joints)",
        f"levels of detail, times in batches of {level_selection.ROWS_PER_CALL}:",
        *(_level(number, *level) for number, level in enumerate(levels)),
        "controls:",
        *(_control(control, plain["skeleton"]["names"]) for control in plain["controls"]),
        *map(_curve, plain.get("curves", [])),
        *_contacts(plain),
        *_accelerations(plain),
        *(
            f"{label_set['name']}s: {', '.join(label_set['names'])}"
            for label_set in plain["labels"]
        ),
        f"licence: {plain['provenance']['licence']}",
        *(f"note: {note}" for note in diagnostics["notes"]),
    ]
    return "\n".join(lines)


def _level(number: int, level: dict[str, Any], seconds: float) -> str:
    return (
        f"  {number}: ranks {level['ranks']} of {level['samples']} clips, {level['numbers']} "
        f"numbers, {level['operations']} multiply-adds a pose, off by {100 * level['rms']:.2f} cm, "
        f"the worst pose by {100 * level['pose']:.1f} cm, here {1e6 * seconds:.2f} µs a pose"
    )


def _curve(plain: dict[str, Any]) -> str:
    """Return one line on a curve: its limits, and the distance that one unit counts as."""
    span = f"{plain['minimum']:g} to {plain['maximum']:g}"
    return f"curve {plain['name']}: {span}, a unit counts as {100 * plain['distance']:g} cm"


def _contacts(plain: dict[str, Any]) -> list[str]:
    """Return a line on each joint with contacts, and one on the accuracy of the contacts."""
    names, accuracy = plain["skeleton"]["names"], plain["diagnostics"].get("contacts")
    texts = [
        f"contacts of {names[contact['joint']]}: {100 * contact['height']:.1f} cm high, swings of "
        f"{contact['swing']:.2f} s, at most {contact['longest_swing']:.2f} s in nine of ten, "
        f"lifted by {100 * contact['clearance']:.1f} cm"
        for contact in plain.get("contacts", [])
    ]
    if accuracy:
        texts.append(
            f"contacts of clips left out: {accuracy['agreement']:.0%} of frames agree, Brier score "
            f"{accuracy['brier']:.3f}, {accuracy['climatology']:.3f} by the mean of the others"
        )
    return texts


def _accelerations(plain: dict[str, Any]) -> list[str]:
    """Return a line on the accelerations of the captured clips, if the card has them."""
    facts = plain.get("captured_acceleration")
    if facts is None:
        return []
    return [
        "accelerations of the joints relative to the root in the captured clips: median "
        f"{facts['median']:.1f} m/s², 99th percentile {facts['p99']:.1f} m/s²"
    ]


def _control(plain: dict[str, Any], joints: list[str]) -> str:
    """Return one line on a control: its sampled range, its description and its measure."""
    span = f"{plain['minimum']:g} to {plain['maximum']:g} {plain['unit']}"
    measure = plain.get("measure")
    how = (
        f" (measured: {measures.describe(measures.from_dict(measure), joints)})" if measure else ""
    )
    return f"  {plain['name']}: {span}, {plain['description']}{how}"


@with_question_options(WhyQuestion)
def why(model: ModelPath, question: WhyQuestion, json: Json = False) -> None:
    """Print the captured clips nearest to the controls.

    Each clip has its distance, and its weight in the answer.
    """
    answer = find_reasons(open_model(model), question)
    print_warnings(answer)
    as_text = model_tables.explanation_text
    typer.echo(as_json(model_tables.explanation(answer)) if json else as_text(answer))


@with_question_options(SuggestQuestion)
def suggest(
    model: ModelPath,
    question: SuggestQuestion,
    candidates: Annotated[
        Path | None,
        typer.Option(
            help="CSV, Parquet or JSON Lines file with the candidate points; default: points "
            "across the sampled ranges",
            metavar="FILE",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """List the clips to capture next, the most useful first."""
    synthesizer = open_model(model)
    points = rows.points(candidates, synthesizer) if candidates else None
    with LateProgress("points", question.count) as bar:
        answer = find_suggestions(synthesizer, question, points, bar.update)
    as_text = model_tables.suggestions_text
    typer.echo(as_json(model_tables.suggestions(answer)) if json else as_text(answer))
