"""Leave-one-out error of each clip and each performer, and possible outliers."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from posefield.common.units import Floats
from posefield.model_file.model_card import Control
from posefield_train.graph.trained_model import Trained
from posefield_train.report.drawing import left_out_clips, significant_digits, svg_chart
from posefield_train.report.drawing.html_page import Section, Table

# Clips named in the table, and clips drawn as stick figures.
NAMED, DRAWN = 10, 3
# The names of more performers than this do not fit below the bars.
WRITTEN = 110


@dataclass(frozen=True)
class ClipErrors:
    """Clips in order of their leave-one-out error, the largest first.

    missed: error (N,), m. indices: into the trained examples (N,). files, performers: names.
    controls: (N, d). names: of the controls. against: evidence (N,) that the clip is an outlier,
    mostly empty.
    """

    missed: Floats
    indices: tuple[int, ...]
    files: tuple[str, ...]
    performers: tuple[str, ...]
    controls: Floats
    names: tuple[str, ...]
    against: tuple[str, ...]

    @property
    def worst(self) -> tuple[int, ...]:
        """Return the indices of the clips to draw, the largest error first."""
        return self.indices[:DRAWN]

    @property
    def mean(self) -> float:
        """Return the RMS over all clips, m."""
        return float(np.sqrt(np.mean(np.square(self.missed))))

    @property
    def by_performer(self) -> dict[str, tuple[int, float]]:
        """Return number of clips and RMS error, m, by performer, the largest error first."""
        own = {
            name: np.array(
                [m for m, p in zip(self.missed, self.performers, strict=True) if p == name]
            )
            for name in sorted(set(self.performers) - {""})
        }
        means = {name: (len(m), float(np.sqrt(np.mean(m**2)))) for name, m in own.items()}
        return dict(sorted(means.items(), key=lambda item: -item[1][1]))

    def facts(self) -> dict[str, Any]:
        """Return every clip, the largest error first."""
        clips = zip(
            self.files, self.performers, self.missed, self.controls, self.against, strict=True
        )
        return {
            "rms_m": significant_digits.number(self.mean),
            "performers": [
                {"performer": name, "clips": count, "rms_m": significant_digits.number(mean)}
                for name, (count, mean) in self.by_performer.items()
            ],
            "clips": [
                {
                    "clip": file,
                    "performer": performer,
                    "missed_m": significant_digits.number(missed),
                    "controls": dict(
                        zip(self.names, significant_digits.numbers(given), strict=True)
                    ),
                    "against": against,
                }
                for file, performer, missed, given, against in clips
            ],
        }

    def section(self) -> Section:
        """Return a bar chart of all clips, and tables of the largest errors and of outliers."""
        paragraphs = (
            "Each clip is predicted from all other clips and compared with its capture on aligned "
            f"time. The error is {100 * self.mean:.2f} cm (RMS over joints and frames). The "
            f"largest error is {100 * self.missed[0]:.2f} cm, of {self.files[0]}.",
        )
        alt = (
            f"Bar chart of the error of {len(self.missed)} clips, from {100 * self.missed[0]:.1f} "
            f"to {100 * self.missed[-1]:.1f} cm; largest: {', '.join(self.files[:DRAWN])}."
        )
        caption = (
            "Error of each left-out clip, the largest first, with its performer. The clips of the "
            "orange bars are drawn below. The dashed line is the RMS over all clips."
        )
        if any(self.against):
            caption += " Outlined bars are possible outliers."
        drawn = svg_chart.draw(3.0, self._paint, alt, caption)
        return Section("clips", "Error of each left-out clip", paragraphs, self._tables(), (drawn,))

    def _tables(self) -> tuple[Table, ...]:
        outliers = tuple((f, s) for f, s in zip(self.files, self.against, strict=True) if s)
        performers = tuple(
            (name, str(count), f"{100 * mean:.2f}")
            for name, (count, mean) in self.by_performer.items()
        )
        tables = (
            Table("Possible outliers", ("clip", "evidence"), outliers),
            self._named(),
            Table("Error by performer", ("performer", "clips", "error (cm)"), performers),
        )
        return tuple(table for table in tables if table.rows)

    def _named(self) -> Table:
        rows = [
            (file, performer, f"{100 * missed:.2f}", *(f"{value:.4g}" for value in given))
            for file, performer, missed, given in zip(
                self.files[:NAMED], self.performers, self.missed, self.controls, strict=False
            )
        ]
        heading = ("clip", "performer", "error (cm)", *self.names)
        return Table("Clips with the largest error", heading, tuple(rows))

    def _paint(self, figure: Figure) -> None:
        ax = figure.subplots()
        at = np.arange(len(self.missed))
        colours = [svg_chart.ORANGE if i < DRAWN else svg_chart.BLUE for i in at]
        edges = [svg_chart.INK if against else "none" for against in self.against]
        ax.bar(at, 100 * self.missed, width=0.72, color=colours, edgecolor=edges, linewidth=1.6)
        ax.axhline(100 * self.mean, color=svg_chart.INK, linestyle="--", linewidth=0.9)
        ax.grid(visible=False, axis="x")
        ax.set(ylabel="error (cm)", xlim=(-0.7, len(at) - 0.3))
        if len(at) <= WRITTEN:
            names = list(map(svg_chart.label, self.performers))
            ax.set_xticks(at, names, rotation=90, fontsize=min(8.5, 640 / len(at)))
        else:
            ax.set_xticks([])


def of(trained: Trained, controls: tuple[Control, ...]) -> ClipErrors:
    """Return the clips of a trained model, the largest error first."""
    order = [int(i) for i in np.argsort(-trained.missed, kind="stable")]
    examples = [trained.examples[i] for i in order]
    return ClipErrors(
        np.sqrt(trained.missed[order]),
        tuple(order),
        tuple(left_out_clips.label(example) for example in examples),
        tuple(example.row.performer for example in examples),
        np.stack([example.controls for example in examples]),
        tuple(control.name for control in controls),
        tuple("; ".join(x.said for x in trained.outliers if x.clip == clip) for clip in order),
    )
