"""Whether sigma keeps its word: predicted against actual distances of clips left out."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from model_export.report import picture, plain
from model_export.report.page import Section, Table
from model_export.train import Trained
from service.motion.conventions import Floats


@dataclass(frozen=True)
class Calibration:
    """Of each clip left out: predicted (N,) standard deviation and actual (N,) distance, m."""

    predicted: Floats
    actual: Floats

    @property
    def ratios(self) -> Floats:
        """Actual over predicted (N,)."""
        return self.actual / self.predicted

    @property
    def measures(self) -> dict[str, float]:
        """By name what sums the ratios up."""
        return {
            "mean_squared_ratio": float(np.mean(np.square(self.ratios))),
            "median_ratio": float(np.median(self.ratios)),
            "within_one_sigma": float(np.mean(self.ratios <= 1.0)),
            "within_two_sigma": float(np.mean(self.ratios <= 2.0)),
            "rank_correlation": _rank_correlation(self.predicted, self.actual),
        }

    def facts(self) -> dict[str, Any]:
        """The sums, and every clip in the order of training."""
        return {
            **{name: plain.number(value) for name, value in self.measures.items()},
            "predicted_m": plain.numbers(self.predicted),
            "actual_m": plain.numbers(self.actual),
        }

    def section(self) -> Section:
        """Actual over predicted, as points and as a histogram."""
        found = self.measures
        words = (
            "Sigma's scale is set so that the mean of actual² / predicted² over clips left out is "
            "one; whether single answers can be told apart by it is another matter. A rank "
            "correlation near zero says that sigma is right on average and does not tell an easy "
            "question from a hard one within the samples.",
        )
        rows = (
            ("mean of actual² / predicted²", f"{found['mean_squared_ratio']:.3f}"),
            ("median of actual / predicted", f"{found['median_ratio']:.2f}"),
            ("clips within one sigma", f"{100 * found['within_one_sigma']:.0f} %"),
            ("clips within two sigma", f"{100 * found['within_two_sigma']:.0f} %"),
            ("rank correlation", f"{found['rank_correlation']:+.2f}"),
        )
        drawn = picture.draw(
            "calibration",
            3.3,
            self._paint,
            f"Predicted standard deviation against actual distance of {len(self.actual)} clips.",
            "Left: one point a clip left out; on the line sigma was exact. Right: the ratio.",
        )
        table = Table(("measure", "found"), rows)
        return Section("calibration", "Is sigma right?", words, (table,), (drawn,))

    def _paint(self, figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        top = 108 * max(float(self.predicted.max()), float(self.actual.max()))
        for times, style in ((1.0, "-"), (2.0, ":")):
            ends = [0.0, top / times]
            label = "exact" if times == 1.0 else f"{times:g} sigma"
            left.plot(ends, [0.0, top], style, color=picture.INK, linewidth=0.9, label=label)
        left.plot(100 * self.predicted, 100 * self.actual, ".", color=picture.BLUE, markersize=7)
        left.set(xlabel="predicted (cm)", ylabel="actual (cm)", xlim=(0, top), ylim=(0, top))
        left.set_title("clips left out")
        left.legend(loc="upper left")
        right.hist(self.ratios, bins=20, color=picture.BLUE)
        right.axvline(1.0, color=picture.INK, linewidth=0.9)
        right.set(xlabel="actual / predicted", ylabel="clips", title="ratio")
        right.grid(visible=False, axis="x")
        right.yaxis.get_major_locator().set_params(integer=True)


def _rank_correlation(a: Floats, b: Floats) -> float:
    """Spearman's, with equal values in the order they come in; 0 where one does not vary."""
    if np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return 0.0
    first, second = (np.argsort(np.argsort(x, kind="stable"), kind="stable") for x in (a, b))
    return float(np.corrcoef(first, second)[0, 1])


def of(trained: Trained) -> Calibration:
    """Calibration of a trained model's sigma."""
    predicted = np.sqrt(trained.model.bank.sill * trained.pose.variances)
    return Calibration(predicted, np.sqrt(trained.missed))
