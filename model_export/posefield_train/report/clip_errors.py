"""Leave-one-out error of each clip and each performer, and possible outliers."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from posefield.common.units import Floats
from posefield.model_file.model_card import Control
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report.drawing import left_out_clips, significant_digits, svg_chart
from posefield_train.report.drawing.html_page import Section, Table

# Clips named in the table, and clips drawn as stick figures.
NAMED_CLIPS, DRAWN = 10, 3
# The names of more performers than this do not fit below the bars.
MAX_LABELLED_CLIPS = 110


@dataclass(frozen=True)
class ClipErrors:
    """Clips in order of their leave-one-out error, the largest first.

    left_out_errors: error (N,), m. indices: into the trained examples (N,). files, performers:
    names. controls: (N, d). names: of the controls. against: evidence (N,) that the clip is an
    outlier, mostly empty.
    """

    left_out_errors: Floats
    indices: tuple[int, ...]
    files: tuple[str, ...]
    performers: tuple[str, ...]
    controls: Floats
    names: tuple[str, ...]
    outlier_evidence: tuple[str, ...]

    @property
    def worst(self) -> tuple[int, ...]:
        """Return the indices of the clips to draw, the largest error first."""
        return self.indices[:DRAWN]

    @property
    def mean(self) -> float:
        """Return the RMS over all clips, m."""
        return float(np.sqrt(np.mean(np.square(self.left_out_errors))))

    @property
    def by_performer(self) -> dict[str, tuple[int, float]]:
        """Return number of clips and RMS error, m, by performer, the largest error first."""
        own = {
            name: np.array(
                [m for m, p in zip(self.left_out_errors, self.performers, strict=True) if p == name]
            )
            for name in sorted(set(self.performers) - {""})
        }
        means = {name: (len(m), float(np.sqrt(np.mean(m**2)))) for name, m in own.items()}
        return dict(sorted(means.items(), key=lambda item: -item[1][1]))

    def facts(self) -> dict[str, Any]:
        """Return every clip, the largest error first."""
        clips = zip(
            self.files,
            self.performers,
            self.left_out_errors,
            self.controls,
            self.outlier_evidence,
            strict=True,
        )
        return {
            "rms_m": significant_digits.round_number(self.mean),
            "performers": [
                {"performer": name, "clips": count, "rms_m": significant_digits.round_number(mean)}
                for name, (count, mean) in self.by_performer.items()
            ],
            "clips": [
                {
                    "clip": file,
                    "performer": performer,
                    "missed_m": significant_digits.round_number(missed),
                    "controls": dict(
                        zip(self.names, significant_digits.round_numbers(given), strict=True)
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
            f"largest error is {100 * self.left_out_errors[0]:.2f} cm, of {self.files[0]}.",
        )
        alt = (
            f"Bar chart of the error of {len(self.left_out_errors)} clips, from "
            f"{100 * self.left_out_errors[0]:.1f} "
            f"to {100 * self.left_out_errors[-1]:.1f} cm; largest: {', '.join(self.files[:DRAWN])}."
        )
        caption = (
            "Error of each left-out clip, the largest first, with its performer. The clips of the "
            "orange bars are drawn below. The dashed line is the RMS over all clips."
        )
        if any(self.outlier_evidence):
            caption += " Outlined bars are possible outliers."
        drawn = svg_chart.draw(3.0, self._paint, alt, caption)
        return Section("clips", "Error of each left-out clip", paragraphs, self._tables(), (drawn,))

    def _tables(self) -> tuple[Table, ...]:
        outliers = tuple(
            (f, s) for f, s in zip(self.files, self.outlier_evidence, strict=True) if s
        )
        performers = tuple(
            (name, str(count), f"{100 * mean:.2f}")
            for name, (count, mean) in self.by_performer.items()
        )
        tables = (
            Table("Possible outliers", ("clip", "evidence"), outliers),
            self._largest_errors_table(),
            Table("Error by performer", ("performer", "clips", "error (cm)"), performers),
        )
        return tuple(table for table in tables if table.rows)

    def _largest_errors_table(self) -> Table:
        rows = [
            (file, performer, f"{100 * missed:.2f}", *(f"{value:.4g}" for value in given))
            for file, performer, missed, given in zip(
                self.files[:NAMED_CLIPS],
                self.performers,
                self.left_out_errors,
                self.controls,
                strict=False,
            )
        ]
        heading = ("clip", "performer", "error (cm)", *self.names)
        return Table("Clips with the largest error", heading, tuple(rows))

    def _paint(self, figure: Figure) -> None:
        ax = figure.subplots()
        at = np.arange(len(self.left_out_errors))
        colours = [svg_chart.ORANGE if i < DRAWN else svg_chart.BLUE for i in at]
        edges = [svg_chart.INK if against else "none" for against in self.outlier_evidence]
        ax.bar(
            at,
            100 * self.left_out_errors,
            width=0.72,
            color=colours,
            edgecolor=edges,
            linewidth=1.6,
        )
        ax.axhline(100 * self.mean, color=svg_chart.INK, linestyle="--", linewidth=0.9)
        ax.grid(visible=False, axis="x")
        ax.set(ylabel="error (cm)", xlim=(-0.7, len(at) - 0.3))
        if len(at) <= MAX_LABELLED_CLIPS:
            names = list(map(svg_chart.label, self.performers))
            ax.set_xticks(at, names, rotation=90, fontsize=min(8.5, 640 / len(at)))
        else:
            ax.set_xticks([])


def collect_clip_errors(trained: TrainedModel, controls: tuple[Control, ...]) -> ClipErrors:
    """Return the clips of a trained model, the largest error first."""
    order = [int(i) for i in np.argsort(-trained.left_out_errors, kind="stable")]
    examples = [trained.examples[i] for i in order]
    return ClipErrors(
        np.sqrt(trained.left_out_errors[order]),
        tuple(order),
        tuple(left_out_clips.clip_label(example) for example in examples),
        tuple(example.row.performer for example in examples),
        np.stack([example.controls for example in examples]),
        tuple(control.name for control in controls),
        tuple("; ".join(x.evidence for x in trained.outliers if x.clip == clip) for clip in order),
    )
