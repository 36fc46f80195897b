"""Error and size of every truncation of the motion tensor (Mukai & Kuriyama 2006, table 1)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from posefield.common.units import Floats
from posefield_train.graph import truncation_cost
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report.drawing import significant_digits, svg_chart
from posefield_train.report.drawing.html_page import Section, Table
from posefield_train.tensor import hosvd

# Error limits, m, for which the smallest size is listed.
BUDGETS = (0.0025, 0.005, 0.01, 0.02, 0.03, 0.05)
STEPS = 240


@dataclass(frozen=True)
class Truncation:
    """Error and size of every truncation.

    errors: (D', T, N), m. stored: numbers stored (D', T, N). chosen: ranks of the model. missed:
    RMS leave-one-out error, m.
    """

    errors: Floats
    stored: Floats
    chosen: tuple[int, int, int]
    left_out_errors: float

    def smallest(self, allowed: float) -> tuple[int, ...]:
        """Return the ranks of fewest numbers stored within an error, m."""
        fits = self.errors <= max(allowed, float(self.errors.min()))
        best = int(np.argmin(np.where(fits, self.stored, np.inf)))
        return tuple(int(i) + 1 for i in np.unravel_index(best, self.errors.shape))

    def front(self) -> tuple[Floats, Floats]:
        """Return the Pareto front: errors, m, and the fewest numbers stored that reach them."""
        order = np.lexsort((self.errors.ravel(), self.stored.ravel()))
        sizes, best = self.stored.ravel()[order], self.errors.ravel()[order]
        best = np.minimum.accumulate(best)
        top = np.searchsorted(-best, -best[0] / 1000.0)
        marks = np.geomspace(sizes[0], sizes[min(top, len(sizes) - 1)], STEPS)
        at = np.searchsorted(sizes, marks, side="right") - 1
        return best[at], marks

    def error(self, ranks: tuple[int, ...]) -> float:
        """Return the error of a truncation, m."""
        return float(self.errors[tuple(rank - 1 for rank in ranks)])

    def numbers(self, ranks: tuple[int, ...]) -> int:
        """Return how many numbers a truncation stores."""
        return int(self.stored[tuple(rank - 1 for rank in ranks)])

    def ratios(self, ranks: tuple[int, ...]) -> tuple[float, float]:
        """Return the compression with all numbers stored, and that of the core alone."""
        return self.errors.size / self.numbers(ranks), self.errors.size / float(np.prod(ranks))

    def facts(self) -> dict[str, Any]:
        """Return the chosen size, and the smallest size for each error limit."""
        return {
            "tensor_numbers": self.errors.size,
            "chosen": self._facts(self.chosen),
            "smallest": [
                {"budget_m": budget, **self._facts(self.smallest(budget))} for budget in BUDGETS
            ],
        }

    def _facts(self, ranks: tuple[int, ...]) -> dict[str, Any]:
        all_stored, core_only = self.ratios(ranks)
        return {
            "ranks": list(ranks),
            "rms_m": significant_digits.round_number(self.error(ranks)),
            "numbers_stored": self.numbers(ranks),
            "core_numbers": int(np.prod(ranks)),
            "compression_all_in": significant_digits.round_number(all_stored),
            "compression_core_only": significant_digits.round_number(core_only),
        }

    def section(self) -> Section:
        """Return the Pareto front, and the errors around the chosen size."""
        error, numbers = 100 * self.error(self.chosen), self.numbers(self.chosen)
        all_stored, core_only = self.ratios(self.chosen)
        paragraphs = (
            f"The chosen ranks {_times(self.chosen)} cause an error of {error:.2f} cm (RMS over "
            f"joints, frames and clips in the training metric). The model stores {numbers:,} "
            f"numbers in place of {self.errors.size:,}: a compression of {all_stored:.1f} with "
            f"bases and kriging weights, and of {core_only:.1f} for the core alone.",
        )
        drawn = svg_chart.draw(
            3.7,
            self._paint,
            f"Truncation error against numbers stored, and against ranks; chosen: {error:.2f} cm "
            f"at {numbers} numbers.",
            "Left: the smallest error for each size, over all combinations of ranks. Right: error "
            "against two of the ranks, the third as chosen. The orange dot is the chosen size.",
        )
        return Section("sizes", "Error against size", paragraphs, (self._table(),), (drawn,))

    def _table(self) -> Table:
        rows = [("chosen", *self._cells(self.chosen))]
        rows += [(f"{100 * b:g} cm", *self._cells(self.smallest(b))) for b in BUDGETS]
        titles = ("ranks", "error (cm)", "numbers stored", "compression", "of the core alone")
        return Table("Smallest size for an error limit", ("error limit", *titles), tuple(rows))

    def _cells(self, ranks: tuple[int, ...]) -> tuple[str, ...]:
        all_stored, core_only = self.ratios(ranks)
        return (
            _times(ranks),
            f"{100 * self.error(ranks):.2f}",
            f"{self.numbers(ranks):,}",
            _ratio(all_stored),
            _ratio(core_only),
        )

    def _paint(self, figure: Figure) -> None:
        left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
        errors, marks = self.front()
        left.loglog(marks, 100 * errors, color=svg_chart.BLUE, label="smallest error at this size")
        at = self.numbers(self.chosen), 100 * self.error(self.chosen)
        left.plot(*at, "o", color=svg_chart.ORANGE, label="chosen", zorder=3)
        missed = f"error of a left-out clip: {100 * self.left_out_errors:.1f} cm"
        left.axhline(
            100 * self.left_out_errors, color=svg_chart.FAINT, linestyle="--", label=missed
        )
        left.set(xlabel="numbers stored", ylabel="error (cm)", title="size")
        svg_chart.plain_logarithm(left.xaxis)
        svg_chart.plain_logarithm(left.yaxis)
        left.legend(loc="lower left")
        self._map(figure, right)

    def _map(self, figure: Figure, ax: Any) -> None:
        r1, r2, r3 = self.chosen
        shown = 100 * self.errors[:, r2 - 1, :].T
        extent = (0.5, shown.shape[1] + 0.5, 0.5, shown.shape[0] + 0.5)
        image = ax.imshow(shown, origin="lower", aspect="auto", extent=extent, cmap="Blues")
        at = np.arange(1, shown.shape[1] + 1), np.arange(1, shown.shape[0] + 1)
        levels = [level for level in (0.5, 1, 2, 5, 10) if shown.min() < level < shown.max()]
        if levels:
            lines = ax.contour(*at, shown, levels, colors=svg_chart.INK, linewidths=0.7)
            ax.clabel(lines, fmt="%g cm", fontsize=8)
        ax.plot(r1, r3, "o", color=svg_chart.ORANGE, clip_on=False)
        ax.grid(visible=False)
        title = f"ranks, with {r2} of frames"
        ax.set(xlabel="rank of degrees of freedom", ylabel="rank of samples", title=title)
        figure.colorbar(image, ax=ax, label="error (cm)")


def _times(ranks: tuple[int, ...]) -> str:
    return " × ".join(map(str, ranks))


def _ratio(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}"


def measure_truncation(trained: TrainedModel) -> Truncation:
    """Return every truncation of a trained model's tensor."""
    core, reduced = trained.full.core, trained.model.decoder.reduced.core
    price = truncation_cost.storage_cost(trained.tensor, len(trained.model.bank.low))
    stored = price.evaluate(*np.ix_(*(np.arange(1, size + 1) for size in core.shape)))
    errors = trained.tensor.rms(hosvd.squared_errors(core))
    r1, r2, r3 = reduced.shape
    return Truncation(errors, stored, (r1, r2, r3), float(np.sqrt(trained.left_out_errors.mean())))
