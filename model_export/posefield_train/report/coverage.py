"""Coverage of the control space by the captured clips."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from posefield.common.units import Floats
from posefield.model_file.model_card import Control
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report.drawing import significant_digits, svg_chart
from posefield_train.report.drawing.html_page import Section, Table

BINS = 16


@dataclass(frozen=True)
class Coverage:
    """Controls of the clips and their errors.

    values: (N, d). missed: leave-one-out error (N,) of each clip, m. performers: names (N,), empty
    if the recipe has none.
    """

    controls: tuple[Control, ...]
    values: Floats
    left_out_errors: Floats
    performers: tuple[str, ...]

    def labels(self) -> tuple[str, ...]:
        """Return the controls that have one value for each performer, and so identify them."""
        whose = np.unique(self.performers, return_inverse=True)[1]
        several = 1 < len(set(self.performers)) < len(self.performers)
        return tuple(
            control.name
            for control, own in zip(self.controls, self.values.T, strict=True)
            if several and all(np.ptp(own[whose == one]) == 0.0 for one in set(whose))
        )

    def facts(self) -> dict[str, Any]:
        """Return range, values and widest gap of each control, and their correlation."""
        return {
            "controls": [
                {
                    "name": control.name,
                    "unit": control.unit,
                    "minimum": significant_digits.round_number(control.minimum),
                    "maximum": significant_digits.round_number(control.maximum),
                    "distinct": len(np.unique(own)),
                    "values": significant_digits.round_numbers(control.values),
                    "widest_gap": significant_digits.round_numbers(_gap(own)),
                }
                for control, own in zip(self.controls, self.values.T, strict=True)
            ],
            "one_value_a_performer": list(self.labels()),
            "correlation": significant_digits.round_numbers(self._correlation()),
        }

    def _correlation(self) -> Floats:
        return np.atleast_2d(np.corrcoef(self.values.T))

    def section(self) -> Section:
        """Return a table of the controls, warnings, and a scatter plot of each pair."""
        paragraphs = (
            "Where no clip was captured the model extrapolates. The charts show such regions; they "
            "may lie within the range of every single control.",
            *self._warnings(),
        )
        rows = tuple(
            self._row(control, own)
            for control, own in zip(self.controls, self.values.T, strict=True)
        )
        titles = ("minimum", "maximum", "distinct values", "widest gap", "description")
        table = Table("Captured range of each control", ("control", "unit", *titles), rows)
        names = ", ".join(control.name for control in self.controls)
        drawn = svg_chart.draw(
            max(3.0, min(9.0, 2.1 * len(self.controls))),
            self._paint,
            f"Scatter plots of each pair of the controls {names}, over {len(self.values)} clips.",
            "Below the diagonal: the clips, coloured by their leave-one-out error. On the "
            "diagonal: number of clips by value. Above the diagonal: correlation.",
        )
        return Section("coverage", "Coverage of the controls", paragraphs, (table,), (drawn,))

    def _warnings(self) -> list[str]:
        few = [
            f"{control.name} has only {len(control.values)} distinct values "
            f"({', '.join(f'{value:g}' for value in control.values)}): nothing was captured "
            "between them."
            for control in self.controls
            if control.values
        ]
        return few + [
            f"{name} has one value for each performer and so identifies the performer. The "
            "leave-one-out error is then too small for new performers."
            for name in self.labels()
        ]

    @staticmethod
    def _row(control: Control, own: Floats) -> tuple[str, ...]:
        low, high = _gap(own)
        ends = f"{control.minimum:.4g}", f"{control.maximum:.4g}"
        gap = f"{low:.4g} to {high:.4g}"
        distinct = str(len(np.unique(own)))
        return (control.name, control.unit, *ends, distinct, gap, control.description)

    def _paint(self, figure: Figure) -> None:
        count = len(self.controls)
        axes = figure.subplots(count, count, squeeze=False)
        strength = self._correlation()
        for (row, column), ax in np.ndenumerate(axes):
            if row < column:
                text = f"correlation\n{strength[row, column]:+.2f}"
                ax.text(0.5, 0.5, text, ha="center", va="center", color=svg_chart.GREY)
                ax.set_axis_off()
            elif row > column:
                x, y = self.values[:, [column, row]].T
                seen = ax.scatter(x, y, c=100 * self.left_out_errors, s=16, cmap="viridis_r")
            else:
                ax.hist(self.values[:, row], bins=BINS, color=svg_chart.BLUE)
                ax.grid(visible=False, axis="x")
                ax.yaxis.get_major_locator().set_params(integer=True)
        titles = [f"{svg_chart.label(c.name)} ({svg_chart.label(c.unit)})" for c in self.controls]
        for at, title in enumerate(titles):
            axes[-1, at].set_xlabel(title)
            axes[at, 0].set_ylabel(title if at else "clips")
        if count > 1:
            figure.colorbar(seen, ax=axes, label="leave-one-out error (cm)", shrink=0.6, aspect=30)


def _gap(values: Floats) -> tuple[float, float]:
    """Return the ends of the widest range without a value."""
    distinct = np.unique(values)
    at = int(np.argmax(np.diff(distinct)))
    return float(distinct[at]), float(distinct[at + 1])


def measure_coverage(trained: TrainedModel, controls: tuple[Control, ...]) -> Coverage:
    """Return the coverage of a trained model's controls."""
    values = np.stack([example.controls for example in trained.examples])
    performers = tuple(example.row.performer for example in trained.examples)
    return Coverage(controls, values, np.sqrt(trained.left_out_errors), performers)
