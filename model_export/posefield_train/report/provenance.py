"""Provenance of a model: card, file size, notes and the time of each training step."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from posefield.model_file.captured_acceleration import CapturedAcceleration
from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.report.drawing import significant_digits
from posefield_train.report.drawing.html_page import Section, Table


@dataclass(frozen=True)
class TrainingStep:
    """A step of the training and its duration, s."""

    name: str
    seconds: float


@dataclass(frozen=True)
class Provenance:
    """An exported model and the steps that made it."""

    exported: ExportedModel
    steps: tuple[TrainingStep, ...]

    @property
    def seconds(self) -> float:
        """Return the duration of all steps, s."""
        return sum(step.seconds for step in self.steps)

    def facts(self) -> dict[str, Any]:
        """Return the card's main entries, the size of the file, and the steps."""
        card = self.exported.card
        return {
            "name": card.name,
            "description": card.description,
            "bytes": len(self.exported.content),
            "clips": card.provenance["clips"],
            "joints": len(card.skeleton),
            "cyclic": card.cyclic,
            "root": card.root,
            "rate": card.rate,
            "frames": card.frames,
            "durations_s": significant_digits.round_numbers(card.durations),
            "provenance": dict(card.provenance),
            "diagnostics": dict(card.diagnostics),
            "steps": [
                {"step": step.name, "seconds": significant_digits.round_number(step.seconds)}
                for step in self.steps
            ],
        }

    def section(self) -> Section:
        """Return tables of the sources, the notes and the times."""
        steps = [(step.name, f"{step.seconds:.2f}") for step in self.steps]
        rows = (*steps, ("total", f"{self.seconds:.2f}"))
        times = Table("Training time", ("step", "seconds"), rows)
        tables = (self._sources(), self._notes(), times)
        return Section("about", "Provenance and notes", (), tables)

    def _notes(self) -> Table:
        notes = self.exported.card.diagnostics["notes"] or ["none"]
        rows = tuple((note,) for note in notes)
        return Table("Notes on the data", ("note",), rows)

    def _sources(self) -> Table:
        found = self.exported.card.provenance
        versions = ", ".join(f"{name} {version}" for name, version in found["versions"].items())
        rows = (
            ("licence", found["licence"]),
            ("clips", str(found["clips"])),
            ("recipe (SHA-256)", found["recipe_sha256"]),
            ("data (SHA-256)", found["data_sha256"]),
            ("versions", versions),
        )
        return Table("Sources", ("entry", "value"), rows)

    def figures(self) -> list[tuple[str, str]]:
        """Return name and value of the key figures at the top of the page."""
        card = self.exported.card
        found = card.diagnostics
        return [
            (f"clips, {len(card.skeleton)} joints each", str(card.provenance["clips"])),
            ("size of the model file", f"{len(self.exported.content) / 1000:.1f} kB"),
            (f"ranks kept of {_times(found['tensor'])}", _times(card.levels[0].ranks)),
            ("error by truncation (RMS)", f"{100 * found['truncation_rms_m']:.2f} cm"),
            ("error of a left-out clip (RMS)", f"{100 * found['leave_one_out_rms_m']:.2f} cm"),
            ("of the motion explained by controls", f"{100 * found['explained']['pose']:.0f} %"),
            *_contact_figures(found),
            *_acceleration_figures(card.captured_acceleration),
            ("largest difference from the reference", f"{100 * found['parity_m']:.5f} cm"),
            ("training time", f"{self.seconds:.1f} s"),
        ]


def _contact_figures(found: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the accuracy of contacts, if the model has them."""
    own = found.get("contacts")
    if own is None:
        return []
    scores = f"{own['brier']:.3f} ({own['climatology']:.3f})"
    return [
        ("contacts of left-out clips that agree", f"{100 * own['agreement']:.1f} %"),
        ("their Brier score (of the mean clip)", scores),
    ]


def _acceleration_figures(own: CapturedAcceleration | None) -> list[tuple[str, str]]:
    """Return the accelerations of the captured clips, if the card has them."""
    if own is None:
        return []
    return [
        ("acceleration of captured joints, median", f"{own.median:.1f} m/s²"),
        ("the same, 99th percentile", f"{own.p99:.1f} m/s²"),
    ]


def _times(sizes: Sequence[int]) -> str:
    return " × ".join(map(str, sizes))
