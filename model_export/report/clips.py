"""Which clips the others predict, and which they do not."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from model_export.report import left_out, picture, plain
from model_export.report.page import Section, Table
from model_export.train import Trained
from service.motion.card import Control
from service.motion.conventions import Floats

# How many clips are named in the table, and how many of them are drawn.
NAMED, DRAWN = 10, 3
# With more clips than this their performers no longer fit under the bars.
WRITTEN = 110


@dataclass(frozen=True)
class Clips:
    """Clips by how far they lie from what all others predict: missed (N,), m, largest first.

    indices (N,): into the trained examples. files and performers: of each clip. controls (N, d).
    strangers (N,): what speaks against each clip, nothing against most; none at all where empty.
    """

    missed: Floats
    indices: tuple[int, ...]
    files: tuple[str, ...]
    performers: tuple[str, ...]
    controls: Floats
    names: tuple[str, ...]
    strangers: tuple[str, ...] = ()

    @property
    def worst(self) -> tuple[int, ...]:
        """Indices of the clips that are drawn, the worst first."""
        return self.indices[:DRAWN]

    @property
    def mean(self) -> float:
        """Root mean square over all clips, m."""
        return float(np.sqrt(np.mean(np.square(self.missed))))

    @property
    def by_performer(self) -> dict[str, tuple[int, float]]:
        """How many clips each performer has, and their root mean square, m; worst first."""
        own = {
            name: np.array(
                [m for m, p in zip(self.missed, self.performers, strict=True) if p == name]
            )
            for name in sorted(set(self.performers) - {""})
        }
        means = {name: (len(m), float(np.sqrt(np.mean(m**2)))) for name, m in own.items()}
        return dict(sorted(means.items(), key=lambda item: -item[1][1]))

    @property
    def _against(self) -> tuple[str, ...]:
        return self.strangers or ("",) * len(self.files)

    def facts(self) -> dict[str, Any]:
        """Every clip, the worst first."""
        named = zip(
            self.files, self.performers, self.missed, self.controls, self._against, strict=True
        )
        return {
            "rms_m": plain.number(self.mean),
            "performers": [
                {"performer": name, "clips": count, "rms_m": plain.number(mean)}
                for name, (count, mean) in self.by_performer.items()
            ],
            "clips": [
                {
                    "clip": file,
                    "performer": performer,
                    "missed_m": plain.number(missed),
                    "controls": dict(zip(self.names, plain.numbers(given), strict=True)),
                    "against": against,
                }
                for file, performer, missed, given, against in named
            ],
        }

    def section(self) -> Section:
        """Bars of all clips, and a table of the worst."""
        said = (
            f"Each clip is predicted from all others and compared with what was captured, on "
            f"aligned time: {100 * self.mean:.2f} cm root mean square over joints and frames. "
            f"The worst is {self.files[0]}, {100 * self.missed[0]:.2f} cm away."
        )
        alt = (
            f"Bars of {len(self.missed)} clips from {100 * self.missed[0]:.1f} cm down to "
            f"{100 * self.missed[-1]:.1f} cm; worst: {', '.join(self.files[:DRAWN])}."
        )
        caption = (
            "Distance of each clip from its prediction, the worst first, with its performer. "
            "Orange clips are drawn below; the dashed line is the root mean square. Outlined clips "
            "do not seem to belong."
        )
        drawn = picture.draw("clips", 3.0, self._paint, alt, caption)
        return Section("clips", "Every clip left out", (said,), self._tables(), (drawn,))

    def _tables(self) -> tuple[Table, ...]:
        rows = tuple(
            (name, str(count), f"{100 * mean:.2f}")
            for name, (count, mean) in self.by_performer.items()
        )
        own = Table(("performer", "clips", "cm"), rows)
        strange = tuple((f, s) for f, s in zip(self.files, self._against, strict=True) if s)
        told = Table(("does not seem to belong", "what speaks against it"), strange)
        tables = ((told, strange), (self._named(), self.files), (own, rows))
        return tuple(table for table, content in tables if content)

    def _named(self) -> Table:
        rows = [
            (file, performer, f"{100 * missed:.2f}", *(f"{value:.4g}" for value in given))
            for file, performer, missed, given in zip(
                self.files[:NAMED], self.performers, self.missed, self.controls, strict=False
            )
        ]
        return Table(("worst clips", "performer", "cm", *self.names), tuple(rows))

    def _paint(self, figure: Figure) -> None:
        ax = figure.subplots()
        at = np.arange(len(self.missed))
        colours = [picture.ORANGE if i < DRAWN else picture.BLUE for i in at]
        # A stranger stands out by its outline, in any colour.
        edges = [picture.INK if against else "none" for against in self._against]
        ax.bar(at, 100 * self.missed, width=0.72, color=colours, edgecolor=edges, linewidth=1.6)
        ax.axhline(100 * self.mean, color=picture.INK, linestyle="--", linewidth=0.9)
        ax.grid(visible=False, axis="x")
        ax.set(ylabel="missed by (cm)", xlim=(-0.7, len(at) - 0.3))
        if len(at) <= WRITTEN:
            ax.set_xticks(at, self.performers, rotation=90, fontsize=min(8.5, 640 / len(at)))
        else:
            ax.set_xticks([])


def of(trained: Trained, controls: tuple[Control, ...]) -> Clips:
    """Clips of a trained model, the worst first."""
    order = [int(i) for i in np.argsort(-trained.missed, kind="stable")]
    examples = [trained.examples[i] for i in order]
    return Clips(
        np.sqrt(trained.missed[order]),
        tuple(order),
        tuple(left_out.label(example) for example in examples),
        tuple(example.row.performer for example in examples),
        np.stack([example.controls for example in examples]),
        tuple(control.name for control in controls),
        _against(trained, order),
    )


def _against(trained: Trained, order: list[int]) -> tuple[str, ...]:
    return tuple(
        "; ".join(one.said for one in trained.strangers if one.clip == clip) for clip in order
    )
