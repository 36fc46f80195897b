"""The `posefield models` command: the models that ship, and those of files, folders and URLs."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import typer

from posefield.common.errors import ModelError
from posefield.console.arguments import Json
from posefield.console.output import as_json
from posefield.model_file import checked_file
from posefield.model_file.model_card import ModelCard
from posefield.registry import model_sources, shipped_models
from posefield.registry.listed_models import ModelFile

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
            "labels": {own.name: list(own.names) for own in self.card.labels},
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
    places: Annotated[
        list[str] | None,
        typer.Argument(
            help="model files, folders with model files, or URLs of object stores, which are "
            "listed after the shipped models",
            show_default=False,
        ),
    ] = None,
    json: Json = False,
) -> None:
    """List the models that ship with posefield, and those of PLACES.

    A file that is no model is named on standard error, and the exit code is then 3.
    """
    listed = list(_listed([str(shipped_models.FOLDER), *(places or ())]))
    found = [one for one in listed if isinstance(one, LocalModel)]
    faults = [one for one in listed if isinstance(one, ModelError)]
    if json:
        typer.echo(as_json([model.facts() for model in found]))
    else:
        typer.echo(_table([HEADING, *(model.cells() for model in found)]))
        typer.echo(f"origin and licences of the shipped models: {shipped_models.NOTICE}")
    for fault in faults:
        typer.echo(f"posefield: {fault}", err=True)
    if faults:
        raise typer.Exit(3)


def _listed(places: list[str]) -> Iterator[LocalModel | ModelError]:
    """Yield the models of places in order, or the error of a place or file."""
    for place in places:
        try:
            files = model_sources.open_source(place).scan()
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
