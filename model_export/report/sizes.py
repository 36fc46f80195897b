"""What compression costs at every size: the choice of ranks among all that there were."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from model_export import cost, hosvd
from model_export.report import picture, plain
from model_export.report.page import Section, Table
from model_export.train import Trained
from service.motion.conventions import Floats

# Errors at which the smallest size is written down, m.
BUDGETS = (0.0025, 0.005, 0.01, 0.02, 0.03, 0.05)
STEPS = 240


@dataclass(frozen=True)
class Sizes:
    """errors (D', T, N), m, and numbers stored (D', T, N), of every truncation.

    chosen: the model's ranks. missed: how far a clip left out lies from its prediction, m.
    """

    errors: Floats
    stored: Floats
    chosen: tuple[int, int, int]
    missed: float

    @property
    def _at(self) -> tuple[int, ...]:
        return tuple(rank - 1 for rank in self.chosen)

    def smallest(self, allowed: float) -> tuple[int, ...]:
        """Ranks of fewest numbers stored whose error, m, is allowed."""
        fits = self.errors <= max(allowed, float(self.errors.min()))
        best = int(np.argmin(np.where(fits, self.stored, np.inf)))
        return tuple(int(i) + 1 for i in np.unravel_index(best, self.errors.shape))

    def front(self) -> tuple[Floats, Floats]:
        """Errors, m, and the fewest numbers that reach them, over the sizes worth seeing."""
        order = np.lexsort((self.errors.ravel(), self.stored.ravel()))
        sizes, best = self.stored.ravel()[order], self.errors.ravel()[order]
        best = np.minimum.accumulate(best)
        top = np.searchsorted(-best, -best[0] / 1000.0)
        marks = np.geomspace(sizes[0], sizes[min(top, len(sizes) - 1)], STEPS)
        at = np.searchsorted(sizes, marks, side="right") - 1
        return best[at], marks

    def ratios(self, kept: tuple[int, ...]) -> tuple[float, float]:
        """How many numbers of the tensor stand against one stored: all in, and of the core."""
        at = tuple(rank - 1 for rank in kept)
        return self.errors.size / float(self.stored[at]), self.errors.size / float(np.prod(kept))

    def facts(self) -> dict[str, Any]:
        """The chosen size, and the smallest for a few errors."""
        return {
            "tensor_numbers": self.errors.size,
            "chosen": self._facts(self.chosen),
            "smallest": [
                {"budget_m": budget, **self._facts(self.smallest(budget))} for budget in BUDGETS
            ],
        }

    def _facts(self, kept: tuple[int, ...]) -> dict[str, Any]:
        at = tuple(rank - 1 for rank in kept)
        all_in, core_only = self.ratios(kept)
        return {
            "ranks": list(kept),
            "rms_m": plain.number(self.errors[at]),
            "numbers_stored": int(self.stored[at]),
            "core_numbers": int(np.prod(kept)),
            "compression_all_in": plain.number(all_in),
            "compression_core_only": plain.number(core_only),
        }

    def section(self) -> Section:
        """The front of sizes worth having, and the errors around the chosen one."""
        error = 100 * float(self.errors[self._at])
        all_in, core_only = self.ratios(self.chosen)
        said = (
            f"The chosen ranks {self.chosen} cost {error:.2f} cm (root mean square over joints, "
            f"frames and clips, exact in the metric of training) and store "
            f"{int(self.stored[self._at]):,} numbers in place of the tensor's "
            f"{self.errors.size:,}: {all_in:.1f} to one with bases and kriging weights, "
            f"{core_only:.1f} to one for the core alone."
        )
        return Section(
            "sizes",
            "Error against size",
            (said,),
            (self._table(),),
            (
                picture.draw(
                    "sizes",
                    3.7,
                    self._paint,
                    f"Truncation error against numbers stored, and over ranks; chosen: {error:.2f} "
                    f"cm at {int(self.stored[self._at])} numbers.",
                    "Left: the least error that each size can have; every triple of ranks was "
                    "scored. Right: error over two of the ranks, the third as chosen. "
                    "Orange marks the choice.",
                ),
            ),
        )

    def _table(self) -> Table:
        rows = [("chosen", *self._cells(self.chosen))]
        rows += [(f"at most {100 * b:g} cm", *self._cells(self.smallest(b))) for b in BUDGETS]
        return Table(("error", "ranks", "cm", "numbers", "all in", "core only"), tuple(rows))

    def _cells(self, kept: tuple[int, ...]) -> tuple[str, ...]:
        at = tuple(rank - 1 for rank in kept)
        all_in, core_only = self.ratios(kept)
        return (
            " × ".join(map(str, kept)),
            f"{100 * self.errors[at]:.2f}",
            f"{int(self.stored[at]):,}",
            _ratio(all_in),
            _ratio(core_only),
        )

    def _paint(self, figure: Figure) -> None:
        left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
        errors, marks = self.front()
        left.loglog(marks, 100 * errors, color=picture.BLUE, label="least error at this size")
        at = self.stored[self._at], 100 * self.errors[self._at]
        left.plot(*at, "o", color=picture.ORANGE, label="chosen", zorder=3)
        missed = f"a clip left out: {100 * self.missed:.1f} cm"
        left.axhline(100 * self.missed, color=picture.FAINT, linestyle="--", label=missed)
        left.set(xlabel="numbers stored", ylabel="error (cm)", title="size")
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
            lines = ax.contour(*at, shown, levels, colors=picture.INK, linewidths=0.7)
            ax.clabel(lines, fmt="%g cm", fontsize=8)
        ax.plot(r1, r3, "o", color=picture.ORANGE, clip_on=False)
        ax.grid(visible=False)
        title = f"ranks, with {r2} of frames"
        ax.set(xlabel="rank of degrees of freedom", ylabel="rank of samples", title=title)
        figure.colorbar(image, ax=ax, label="error (cm)")


def _ratio(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}"


def of(trained: Trained) -> Sizes:
    """Every truncation of a trained model's tensor."""
    core, reduced = trained.full.core, trained.model.decoder.reduced.core
    price = cost.numbers(trained.tensor, len(trained.model.bank.low))
    stored = price.of(*np.ix_(*(np.arange(1, size + 1) for size in core.shape)))
    errors = trained.tensor.rms(hosvd.squared_errors(core))
    r1, r2, r3 = reduced.shape
    return Sizes(errors, stored, (r1, r2, r3), float(np.sqrt(trained.missed.mean())))
