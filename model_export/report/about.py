"""Where a model comes from, what was noticed, and how long each step took."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from model_export.export import Exported
from model_export.report import plain
from model_export.report.page import Section, Table


@dataclass(frozen=True)
class Step:
    """A step of the training and how long it took, s."""

    name: str
    seconds: float


@dataclass(frozen=True)
class About:
    """An exported model and the steps that led there."""

    exported: Exported
    steps: tuple[Step, ...]

    @property
    def seconds(self) -> float:
        """All steps together, s."""
        return sum(step.seconds for step in self.steps)

    def facts(self) -> dict[str, Any]:
        """What the card says, the size of the file, and the steps."""
        card = self.exported.card
        return {
            "name": card.name,
            "description": card.description,
            "bytes": len(self.exported.content),
            "clips": card.samples,
            "joints": len(card.skeleton),
            "cyclic": card.cyclic,
            "root": card.root,
            "rate": card.rate,
            "frames": card.frames,
            "durations_s": plain.numbers(card.durations),
            "provenance": dict(card.provenance),
            "diagnostics": dict(card.diagnostics),
            "steps": [
                {"step": step.name, "seconds": plain.number(step.seconds)} for step in self.steps
            ],
        }

    def section(self) -> Section:
        """Provenance, notes and times."""
        steps = [(step.name, f"{step.seconds:.2f}") for step in self.steps]
        times = Table(("step", "seconds"), (*steps, ("together", f"{self.seconds:.2f}")))
        tables = (self._provenance(), self._notes(), times)
        return Section("about", "Where it comes from", (), tables)

    def _notes(self) -> Table:
        notes = self.exported.card.diagnostics["notes"] or ["nothing that had to be assumed"]
        return Table(("noticed on the way",), tuple((note,) for note in notes))

    def _provenance(self) -> Table:
        told = self.exported.card.provenance
        versions = ", ".join(f"{name} {found}" for name, found in told["versions"].items())
        return Table(
            ("provenance", ""),
            (
                ("licence", told["licence"]),
                ("clips", str(told["clips"])),
                ("recipe (SHA-256)", told["recipe_sha256"]),
                ("data (SHA-256)", told["data_sha256"]),
                ("versions", versions),
            ),
        )

    def figures(self) -> list[tuple[str, str]]:
        """The few numbers that stand at the top of the page, with what they are."""
        card = self.exported.card
        told = card.diagnostics
        return [
            (f"clips of {len(card.skeleton)} joints", str(card.samples)),
            ("model file", f"{len(self.exported.content) / 1000:.1f} kB"),
            (f"ranks of {_times(told['tensor'])}", _times(card.levels[0].ranks)),
            ("truncation costs", f"{100 * told['truncation_rms_m']:.2f} cm"),
            ("a clip left out lies away", f"{100 * told['leave_one_out_rms_m']:.2f} cm"),
            ("of the motion explained", f"{100 * told['explained']['pose']:.0f} %"),
            ("file against reference", f"{100 * told['parity_m']:.5f} cm"),
            ("to train", f"{self.seconds:.1f} s"),
        ]


def _times(sizes: Sequence[int]) -> str:
    return " × ".join(map(str, sizes))
