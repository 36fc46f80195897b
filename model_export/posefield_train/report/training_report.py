"""Report of a trained model as two files: an HTML page, and JSON with the same figures."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report import (
    calibration,
    clip_errors,
    coverage,
    drawn_clips,
    kriging_summary,
    reliability,
    spectra,
    truncation,
    variograms,
    warps,
)
from posefield_train.report.drawing.html_page import Page, ReportChapter, Section, Table
from posefield_train.report.levels_of_detail import LevelCosts
from posefield_train.report.provenance import Provenance, TrainingStep

REPORT_VERSION = 1
"""Version of the JSON: increased when a name or a unit changes."""

TERMS_SECTION = Section(
    "terms",
    "Terms",
    (),
    (
        Table(
            "Terms on this page",
            ("term", "meaning"),
            (
                ("control", "A number that selects a motion, for example a walking speed."),
                (
                    "half-range",
                    "Half the captured range of a control. Distances between controls are counted "
                    "in half-ranges, so that controls of different units can be compared.",
                ),
                (
                    "left-out clip",
                    "A clip that is predicted from all other clips and then compared with its "
                    "capture. Its error estimates the error for motions that were not captured.",
                ),
                ("RMS", "Root mean square, an average that counts large values more."),
                ("sigma", "The standard deviation that the model predicts for its own error."),
                (
                    "kriging",
                    "Interpolation between clips by their distance in the controls; also known as "
                    "Gaussian process regression.",
                ),
                (
                    "canonical time",
                    "Time after alignment: at the same canonical time all clips are in the same "
                    "phase of the motion.",
                ),
                (
                    "truncation, ranks",
                    "The model stores the motions as sums of a few basis directions of joint "
                    "rotations, of time and of clips. The ranks are their numbers; truncation "
                    "drops the others.",
                ),
                (
                    "effector at its event",
                    "The joint that matters most at the moment that matters most, for example the "
                    "hand when it touches the target. The recipe names both.",
                ),
            ),
        ),
    ),
)


@dataclass(frozen=True)
class RenderedReport:
    """Contents of the two files."""

    html: bytes
    json: bytes


def render(
    trained: TrainedModel,
    exported: ExportedModel,
    levels: LevelCosts,
    steps: Sequence[TrainingStep],
) -> RenderedReport:
    """Return the report of a model; equal arguments give equal bytes."""
    provenance = Provenance(exported, tuple(steps))
    chapters = _chapters(trained, levels, provenance)
    facts = {"report": REPORT_VERSION, **{name: part.facts() for name, part in chapters.items()}}
    card = exported.card
    sections = [*(part.section() for part in chapters.values()), TERMS_SECTION]
    page = Page("training report", card.name, card.description, provenance.figures(), sections)
    text = json.dumps(facts, indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False)
    return RenderedReport(page.html(), f"{text}\n".encode())


def _chapters(
    trained: TrainedModel, levels: LevelCosts, provenance: Provenance
) -> dict[str, ReportChapter]:
    """Return the parts of the report by their names in the JSON, in the order of the page."""
    controls = provenance.exported.card.controls
    errors = clip_errors.collect_clip_errors(trained, controls)
    return {
        "fields": kriging_summary.summarize_kriging(trained, controls),
        "clips": errors,
        "figures": drawn_clips.draw_clips(trained, errors.worst),
        "calibration": calibration.measure_calibration(trained),
        "coverage": coverage.measure_coverage(trained, controls),
        "trust": reliability.measure_reliability(provenance.exported),
        "variograms": variograms.measure_variograms(trained, controls),
        "spectra": spectra.measure_spectra(trained),
        "sizes": truncation.measure_truncation(trained),
        "levels": levels,
        "warps": warps.collect_warps(trained),
        "about": provenance,
    }
