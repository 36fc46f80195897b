"""Calibration of sigma: predicted standard deviation against the error of left-out clips."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import spearmanr

from posefield.common.units import Floats
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report.drawing import significant_digits, svg_chart
from posefield_train.report.drawing.html_page import Section, Table


@dataclass(frozen=True)
class Calibration:
    """Predicted standard deviation (N,) and actual error (N,) of each left-out clip, m."""

    predicted: Floats
    actual: Floats

    @property
    def ratios(self) -> Floats:
        """Return actual over predicted (N,)."""
        return self.actual / self.predicted

    @property
    def measures(self) -> dict[str, float]:
        """Return summary statistics by name."""
        return {
            "mean_squared_ratio": float(np.mean(np.square(self.ratios))),
            "median_ratio": float(np.median(self.ratios)),
            "within_one_sigma": float(np.mean(self.ratios <= 1.0)),
            "within_two_sigma": float(np.mean(self.ratios <= 2.0)),
            "rank_correlation": _rank_correlation(self.predicted, self.actual),
        }

    def facts(self) -> dict[str, Any]:
        """Return the statistics, and every clip in the order of training."""
        return {
            **{
                name: significant_digits.round_number(value)
                for name, value in self.measures.items()
            },
            "predicted_m": significant_digits.round_numbers(self.predicted),
            "actual_m": significant_digits.round_numbers(self.actual),
        }

    def section(self) -> Section:
        """Return the statistics, and charts of error against sigma."""
        found = self.measures
        paragraphs = (
            "Sigma is the standard deviation that the model predicts for its own error. It is "
            "scaled so that the mean of error² / sigma² over all left-out clips is 1, with motions "
            "compared after time warping. The rank "
            "correlation shows whether sigma also tells difficult motions from easy ones: near 0, "
            "sigma is right only on average.",
        )
        rows = (
            ("mean of error² / sigma²", f"{found['mean_squared_ratio']:.3f}"),
            ("median of error / sigma", f"{found['median_ratio']:.2f}"),
            ("clips with an error up to sigma", f"{100 * found['within_one_sigma']:.0f} %"),
            ("clips with an error up to 2 sigma", f"{100 * found['within_two_sigma']:.0f} %"),
            ("rank correlation of error and sigma", f"{found['rank_correlation']:+.2f}"),
        )
        drawn = svg_chart.draw(
            3.3,
            self._paint,
            f"Scatter plot of error against sigma of {len(self.actual)} left-out clips, and a "
            "histogram of their ratio.",
            "Left: one point per left-out clip. Right: distribution of error / sigma.",
        )
        table = Table("Errors of left-out clips", ("measure", "value"), rows)
        return Section("calibration", "Accuracy of sigma", paragraphs, (table,), (drawn,))

    def _paint(self, figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        top = 108 * max(float(self.predicted.max()), float(self.actual.max()))
        for times, style, label in ((1.0, "-", "error = sigma"), (2.0, ":", "error = 2 sigma")):
            ends = [0.0, top / times]
            left.plot(ends, [0.0, top], style, color=svg_chart.INK, linewidth=0.9, label=label)
        left.plot(100 * self.predicted, 100 * self.actual, ".", color=svg_chart.BLUE, markersize=7)
        left.set(xlabel="sigma (cm)", ylabel="error (cm)", xlim=(0, top), ylim=(0, top))
        left.set_title("left-out clips")
        left.legend(loc="upper left")
        right.hist(self.ratios, bins=20, color=svg_chart.BLUE)
        right.axvline(1.0, color=svg_chart.INK, linewidth=0.9)
        right.set(xlabel="error / sigma", ylabel="clips", title="error / sigma")
        right.grid(visible=False, axis="x")
        right.yaxis.get_major_locator().set_params(integer=True)


def _rank_correlation(a: Floats, b: Floats) -> float:
    """Return Spearman's rank correlation; 0 if one of both is constant."""
    if np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return 0.0
    return float(spearmanr(a, b).statistic)


def measure_calibration(trained: TrainedModel) -> Calibration:
    """Return the calibration of a trained model's sigma."""
    predicted = np.sqrt(trained.model.bank.sill * trained.pose.variances)
    return Calibration(predicted, np.sqrt(trained.warped_errors))
