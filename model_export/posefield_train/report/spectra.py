"""Singular values of the three modes of the motion tensor (Mukai & Kuriyama 2006, section 2)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from posefield.common.units import Floats
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report.drawing import significant_digits, svg_chart
from posefield_train.report.drawing.html_page import Section
from posefield_train.tensor import hosvd

MODES = ("degrees of freedom", "frames", "samples")
# Lower end of the logarithmic axis, m: invisible in an animation.
SMALLEST_DISTANCE = 1e-6


@dataclass(frozen=True)
class Spectra:
    """Spectra of the modes.

    carried: RMS joint distance, m, of each direction, by mode. ranks: kept of each mode.
    """

    carried: tuple[Floats, ...]
    ranks: tuple[int, ...]

    def facts(self) -> dict[str, Any]:
        """Return the distance of each direction, m, and the rank, by mode."""
        return {
            mode: {"kept": rank, "carried_m": significant_digits.round_numbers(carried)}
            for mode, rank, carried in zip(MODES, self.ranks, self.carried, strict=True)
        }

    def section(self) -> Section:
        """Return a chart of the three spectra."""
        sizes = ", ".join(
            f"{rank} of {len(carried)} {mode}"
            for mode, rank, carried in zip(MODES, self.ranks, self.carried, strict=True)
        )
        paragraphs = (
            "The motion tensor holds all clips as one array of degrees of freedom × frames × "
            f"samples. The model keeps {sizes}, as basis directions. The steeper a curve falls, "
            "the better the motions compress.",
        )
        drawn = svg_chart.draw(
            3.2,
            self._paint,
            f"Singular values of the three modes on a logarithmic scale; kept: {sizes}.",
            "Contribution of each basis direction to the motions, as RMS joint distance. Blue "
            "directions are kept, grey ones are dropped.",
        )
        return Section("spectra", "Spectra of the motion tensor", paragraphs, charts=(drawn,))

    def _paint(self, figure: Figure) -> None:
        axes = figure.subplots(1, 3, sharey=True)
        for ax, mode, rank, carried in zip(axes, MODES, self.ranks, self.carried, strict=True):
            at = np.arange(1, len(carried) + 1)
            seen = carried > SMALLEST_DISTANCE
            kept = seen & (at <= rank)
            ax.semilogy(at[seen & ~kept], 100 * carried[seen & ~kept], ".", color=svg_chart.FAINT)
            ax.semilogy(at[kept], 100 * carried[kept], ".", color=svg_chart.BLUE)
            ax.axvline(rank + 0.5, color=svg_chart.ORANGE, linewidth=1.0)
            ax.set(title=f"{mode}: {rank} of {len(carried)}", xlabel="direction")
        axes[0].set_ylabel("RMS joint distance (cm)")
        svg_chart.plain_logarithm(axes[0].yaxis)


def measure_spectra(trained: TrainedModel) -> Spectra:
    """Return the spectra of a trained model's tensor."""
    core = trained.full.core
    energies = [np.sum(np.square(hosvd.unfold(core, mode)), axis=1) for mode in range(3)]
    return Spectra(
        tuple(trained.tensor.rms(energy) for energy in energies),
        trained.model.decoder.reduced.core.shape,
    )
