"""Report of a trained model as two files: an HTML page, and JSON with the same figures."""

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report import clip_errors, controls, significant_digits, tensor
from posefield_train.report.levels_of_detail import LevelCosts
from posefield_train.report.page import Page, Section, Table, product

REPORT_VERSION = 2
"""Version of the JSON: increased when a name or a unit changes."""

TERMS = Path(__file__).with_name("templates") / "terms.csv"
"""Terms of the page and their meanings."""


TrainingStep = tuple[str, float]
"""Name of a step of the training and its duration, s."""


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
    card = exported.card
    sections = (
        controls.quantity_section(trained, card.controls),
        clip_errors.error_section(trained, card.controls),
        clip_errors.drawn_section(trained),
        controls.calibration_section(trained),
        controls.coverage_section(trained, card.controls),
        controls.trust_section(exported),
        tensor.truncation_section(trained),
        levels.section(),
        tensor.warp_section(trained),
        provenance_section(exported, steps),
    )
    key_values = key_figures(exported, sum(seconds for _, seconds in steps))
    with TERMS.open(encoding="utf-8", newline="") as file:
        rows = tuple(tuple(row) for row in csv.reader(file))
    terms = Section("terms", "Terms", (), (Table("Terms on this page", ("term", "meaning"), rows),))
    page = Page("training report", card.name, card.description, key_values, [*sections, terms])
    facts = {section.name: significant_digits.round_all(section.facts) for section in sections}
    text = json.dumps(
        {"report": REPORT_VERSION, **facts},
        indent=1,
        sort_keys=True,
        allow_nan=False,
        ensure_ascii=False,
    )
    return RenderedReport(page.html(), f"{text}\n".encode())


def provenance_section(exported: ExportedModel, steps: Sequence[TrainingStep]) -> Section:
    """Return the card's main entries, the size of the file, its notes, and the steps."""
    card = exported.card
    source = card.provenance
    facts = {
        "name": card.name,
        "description": card.description,
        "bytes": len(exported.content),
        "clips": source["clips"],
        "joints": len(card.skeleton),
        "cyclic": card.cyclic,
        "root": card.root,
        "rate": card.rate,
        "frames": card.frames,
        "durations_s": card.durations,
        "provenance": dict(source),
        "diagnostics": dict(card.diagnostics),
        "steps": [{"step": name, "seconds": seconds} for name, seconds in steps],
    }
    versions = ", ".join(f"{name} {version}" for name, version in source["versions"].items())
    sources = (
        ("licence", source["licence"]),
        ("clips", str(source["clips"])),
        ("recipe (SHA-256)", source["recipe_sha256"]),
        ("data (SHA-256)", source["data_sha256"]),
        ("versions", versions),
    )
    notes = tuple((note,) for note in card.diagnostics["notes"] or ["none"])
    total = ("total", f"{sum(seconds for _, seconds in steps):.2f}")
    times = (*((name, f"{seconds:.2f}") for name, seconds in steps), total)
    tables = (
        Table("Sources", ("entry", "value"), sources),
        Table("Notes on the data", ("note",), notes),
        Table("Training time", ("step", "seconds"), times),
    )
    return Section("about", "Provenance and notes", (), tables, (), facts)


def key_figures(exported: ExportedModel, seconds: float) -> list[tuple[str, str]]:
    """Return name and value of the key figures at the top of the page."""
    card = exported.card
    measured, acceleration = card.diagnostics, card.captured_acceleration
    figures = [
        (f"clips, {len(card.skeleton)} joints each", str(card.provenance["clips"])),
        ("size of the model file", f"{len(exported.content) / 1000:.1f} kB"),
        (f"ranks kept of {product(measured['tensor'])}", product(card.levels[0].ranks)),
        ("error by truncation (RMS)", f"{100 * measured['truncation_rms_m']:.2f} cm"),
        ("error of a left-out clip (RMS)", f"{100 * measured['leave_one_out_rms_m']:.2f} cm"),
        ("of the motion explained by controls", f"{100 * measured['explained']['pose']:.0f} %"),
    ]
    if contacts := measured.get("contacts"):
        scores = f"{contacts['brier']:.3f} ({contacts['climatology']:.3f})"
        agreement = f"{100 * contacts['agreement']:.1f} %"
        figures.append(("contacts of left-out clips that agree", agreement))
        figures.append(("their Brier score (of the mean clip)", scores))
    if acceleration:
        median = f"{acceleration.median:.1f} m/s²"
        figures.append(("acceleration of captured joints, median", median))
        figures.append(("the same, 99th percentile", f"{acceleration.p99:.1f} m/s²"))
    parity = f"{100 * measured['parity_m']:.5f} cm"
    figures.append(("largest difference from the reference", parity))
    return [*figures, ("training time", f"{seconds:.1f} s")]
