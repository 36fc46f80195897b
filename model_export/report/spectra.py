"""What each direction of the three modes carries, and how many are kept."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from model_export import hosvd
from model_export.report import picture, plain
from model_export.report.page import Section
from model_export.train import Trained
from service.motion.conventions import Floats

MODES = ("degrees of freedom", "frames", "samples")
# A micrometre is nothing that anyone sees, and a logarithmic axis should end somewhere, m.
SMALLEST = 1e-6


@dataclass(frozen=True)
class Spectra:
    """carried: of each mode, the root mean square joint distance of each direction, m."""

    carried: tuple[Floats, ...]
    ranks: tuple[int, ...]

    def facts(self) -> dict[str, Any]:
        """By mode: what each direction carries, m, and how many are kept."""
        return {
            mode: {"kept": rank, "carried_m": plain.numbers(carried)}
            for mode, rank, carried in zip(MODES, self.ranks, self.carried, strict=True)
        }

    def section(self) -> Section:
        """The three spectra side by side."""
        sizes = ", ".join(
            f"{rank} of {len(carried)} {mode}"
            for mode, rank, carried in zip(MODES, self.ranks, self.carried, strict=True)
        )
        return Section(
            "spectra",
            "Spectra of the motion tensor",
            (f"The model keeps {sizes}. A spectrum that falls steeply compresses well.",),
            pictures=(
                picture.draw(
                    "spectra",
                    3.2,
                    self._paint,
                    f"Singular values of the three modes on a logarithmic scale; kept: {sizes}.",
                    "What each direction of a mode carries, as root mean square joint distance. "
                    "Blue directions are kept, grey ones are cut off.",
                ),
            ),
        )

    def _paint(self, figure: Figure) -> None:
        axes = figure.subplots(1, 3, sharey=True)
        for ax, mode, rank, carried in zip(axes, MODES, self.ranks, self.carried, strict=True):
            at = np.arange(1, len(carried) + 1)
            seen = carried > SMALLEST
            kept = seen & (at <= rank)
            ax.semilogy(at[seen & ~kept], 100 * carried[seen & ~kept], ".", color=picture.FAINT)
            ax.semilogy(at[kept], 100 * carried[kept], ".", color=picture.BLUE)
            ax.axvline(rank + 0.5, color=picture.ORANGE, linewidth=1.0)
            ax.set(title=f"{mode}: {rank} of {len(carried)}", xlabel="direction")
        axes[0].set_ylabel("carried (cm)")


def of(trained: Trained) -> Spectra:
    """Spectra of a trained model's tensor."""
    core = trained.full.core
    energies = [np.sum(np.square(hosvd.unfold(core, mode)), axis=1) for mode in range(3)]
    return Spectra(
        tuple(trained.tensor.rms(energy) for energy in energies),
        trained.model.decoder.reduced.core.shape,
    )
