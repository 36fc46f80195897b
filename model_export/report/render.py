"""The report of a trained model as two files: HTML to look at, JSON with the same numbers."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

from model_export.export import Exported
from model_export.report import (
    calibration,
    clips,
    coverage,
    fields,
    figures,
    page,
    sizes,
    spectra,
    trust,
    variograms,
    warps,
)
from model_export.report.about import About, Step
from model_export.report.detail import Ladder
from model_export.report.page import Chapter
from model_export.train import Trained

# Of the JSON: raised when a name or a unit changes.
FORMAT = 1


@dataclass(frozen=True)
class Rendered:
    """Content of the page and of its numbers."""

    html: bytes
    json: bytes


def render(trained: Trained, exported: Exported, ladder: Ladder, steps: Sequence[Step]) -> Rendered:
    """Report of a model; the same model, measured ladder and steps give the same bytes."""
    own = About(exported, tuple(steps))
    chapters = _chapters(trained, ladder, own)
    facts = {"report": FORMAT, **{name: part.facts() for name, part in chapters.items()}}
    sections = [part.section() for part in chapters.values()]
    card = exported.card
    html = page.html("training report", card.name, card.description, own.figures(), sections)
    text = json.dumps(facts, indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False)
    return Rendered(html.encode(), f"{text}\n".encode())


def _chapters(trained: Trained, ladder: Ladder, own: About) -> dict[str, Chapter]:
    """Parts of the report by name, in the order of the page."""
    controls = own.exported.card.controls
    missed = clips.of(trained, controls)
    return {
        "fields": fields.of(trained, controls),
        "clips": missed,
        "figures": figures.of(trained, missed.worst),
        "calibration": calibration.of(trained),
        "coverage": coverage.of(trained, controls),
        "trust": trust.of(own.exported),
        "variograms": variograms.of(trained, controls),
        "spectra": spectra.of(trained),
        "sizes": sizes.of(trained),
        "levels": ladder,
        "warps": warps.of(trained),
        "about": own,
    }
