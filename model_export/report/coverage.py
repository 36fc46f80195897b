"""Where in the control space there are samples."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from model_export.report import picture, plain
from model_export.report.page import Section, Table
from model_export.train import Trained
from service.motion.card import Control
from service.motion.conventions import Floats

BINS = 16


@dataclass(frozen=True)
class Coverage:
    """values (N, d): controls of the clips. missed (N,): how well the others predict each, m.

    performers (N,): empty names where the recipe does not say who moved.
    """

    controls: tuple[Control, ...]
    values: Floats
    missed: Floats
    performers: tuple[str, ...]

    def labels(self) -> tuple[str, ...]:
        """Controls with one value for each of several performers: they say who moved."""
        whose = np.unique(self.performers, return_inverse=True)[1]
        several = 1 < len(set(self.performers)) < len(self.performers)
        return tuple(
            control.name
            for control, own in zip(self.controls, self.values.T, strict=True)
            if several and all(np.ptp(own[whose == one]) == 0.0 for one in set(whose))
        )

    def facts(self) -> dict[str, Any]:
        """Of each control what was sampled, and the widest range in which nothing was."""
        return {
            "controls": [
                {
                    "name": control.name,
                    "unit": control.unit,
                    "minimum": plain.number(control.minimum),
                    "maximum": plain.number(control.maximum),
                    "distinct": len(np.unique(own)),
                    "values": plain.numbers(control.values),
                    "widest_gap": plain.numbers(_gap(own)),
                }
                for control, own in zip(self.controls, self.values.T, strict=True)
            ],
            "one_value_a_performer": list(self.labels()),
            "correlation": plain.numbers(self._correlation()),
        }

    def _correlation(self) -> Floats:
        return np.atleast_2d(np.corrcoef(self.values.T))

    def section(self) -> Section:
        """Every pair of controls, and a word on those that only have a few values."""
        words = (
            "A field knows nothing where it has no samples: corners that are empty here are "
            "extrapolated to, whatever the ranges of the single controls say.",
            *self._warnings(),
        )
        rows = tuple(
            self._row(control, own)
            for control, own in zip(self.controls, self.values.T, strict=True)
        )
        heading = ("control", "unit", "from", "to", "distinct values", "widest gap")
        names = ", ".join(control.name for control in self.controls)
        drawn = picture.draw(
            "coverage",
            max(3.0, min(9.0, 2.1 * len(self.controls))),
            self._paint,
            f"Pair plot of {names} over {len(self.values)} clips.",
            "Below the diagonal the clips, darker where the others predict them worse; on it how "
            "often each value was sampled; above it the correlation.",
        )
        return Section(
            "coverage", "Coverage of the controls", words, (Table(heading, rows),), (drawn,)
        )

    def _warnings(self) -> list[str]:
        few = [
            f"{control.name} has only {len(control.values)} distinct values "
            f"({', '.join(f'{value:g}' for value in control.values)}): nothing was seen between "
            "them."
            for control in self.controls
            if control.values
        ]
        return few + [
            f"{name} has one value for each performer, and so tells who moved: leaving one clip "
            "out is too kind to such a model, and a new performer is predicted less well."
            for name in self.labels()
        ]

    @staticmethod
    def _row(control: Control, own: Floats) -> tuple[str, ...]:
        low, high = _gap(own)
        ends = f"{control.minimum:.4g}", f"{control.maximum:.4g}"
        gap = f"{low:.4g} to {high:.4g}"
        return (control.name, control.unit, *ends, str(len(np.unique(own))), gap)

    def _paint(self, figure: Figure) -> None:
        count = len(self.controls)
        axes = figure.subplots(count, count, squeeze=False)
        strength = self._correlation()
        for (row, column), ax in np.ndenumerate(axes):
            if row < column:
                said = f"correlation\n{strength[row, column]:+.2f}"
                ax.text(0.5, 0.5, said, ha="center", va="center", color=picture.GREY)
                ax.set_axis_off()
            elif row > column:
                x, y = self.values[:, [column, row]].T
                seen = ax.scatter(x, y, c=100 * self.missed, s=16, cmap="viridis_r")
            else:
                ax.hist(self.values[:, row], bins=BINS, color=picture.BLUE)
                ax.grid(visible=False, axis="x")
                ax.yaxis.get_major_locator().set_params(integer=True)
        titles = [f"{control.name} ({control.unit})" for control in self.controls]
        for at, title in enumerate(titles):
            axes[-1, at].set_xlabel(title)
            axes[at, 0].set_ylabel(title if at else "clips")
        if count > 1:
            figure.colorbar(seen, ax=axes, label="missed by (cm)", shrink=0.6, aspect=30)


def _gap(values: Floats) -> tuple[float, float]:
    """Ends of the widest range in which no value lies."""
    distinct = np.unique(values)
    at = int(np.argmax(np.diff(distinct)))
    return float(distinct[at]), float(distinct[at + 1])


def of(trained: Trained, controls: tuple[Control, ...]) -> Coverage:
    """Coverage of a trained model's controls."""
    values = np.stack([example.controls for example in trained.examples])
    performers = tuple(example.row.performer for example in trained.examples)
    return Coverage(controls, values, np.sqrt(trained.missed), performers)
