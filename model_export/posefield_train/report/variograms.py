"""Variograms of the poses: differences between clips over distances between their controls."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from posefield.common.units import Floats
from posefield.model_file.model_card import Control
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import variogram
from posefield_train.kriging.covariance_graph import COVARIANCES
from posefield_train.kriging.variogram import ExperimentalVariogram, VariogramModel
from posefield_train.report.drawing import significant_digits, svg_chart
from posefield_train.report.drawing.html_page import Section

# A pair counts for a control that contributes this share of its distance: within 45 degrees.
MIN_DIRECTION_SHARE = np.sqrt(0.5)
# Fewer lags do not determine a curve.
FEWEST_LAGS = 3


@dataclass(frozen=True)
class DirectionalVariogram:
    """Pairs (P,) of clips along one control, or by the scaled distance of all controls.

    distances: in `unit`. semivariances: m². mean: by lag. fit: None with fewer than FEWEST_LAGS
    lags. scale: factor from the unit to the scaled distance.
    """

    name: str
    unit: str
    distances: Floats
    semivariances: Floats
    mean: ExperimentalVariogram
    fit: VariogramModel | None
    scale: float

    def facts(self) -> dict[str, Any]:
        """Return the means by lag and the fit, without the pairs."""
        return {
            "name": self.name,
            "distance_unit": self.unit,
            "pairs": len(self.distances),
            "lag_distances": significant_digits.round_numbers(self.mean.distances),
            "lag_semivariances_m2": significant_digits.round_numbers(self.mean.values),
            "lag_pairs": [int(count) for count in self.mean.pairs],
            "fit": self.fit
            and {name: significant_digits.round_number(x) for name, x in vars(self.fit).items()},
            "field_scale": significant_digits.round_number(self.scale),
        }


@dataclass(frozen=True)
class Variograms:
    """Directions, the scaled distance last, and the kriging model of the poses.

    nugget: share of the sill. sill: m².
    """

    directions: tuple[DirectionalVariogram, ...]
    covariance: str
    nugget: float
    sill: float

    @property
    def _grid(self) -> tuple[int, int]:
        """Return the rows and columns of panels."""
        columns = 2 if len(self.directions) in (2, 4) else 3
        return -(-len(self.directions) // columns), columns

    def facts(self) -> dict[str, Any]:
        """Return the parameters of the kriging model, and every direction."""
        return {
            "covariance": self.covariance,
            "nugget": significant_digits.round_number(self.nugget),
            "sill_m2": significant_digits.round_number(self.sill),
            "directions": [direction.facts() for direction in self.directions],
        }

    def section(self) -> Section:
        """Return a chart with a panel for each control and one for all controls."""
        rows, _ = self._grid
        names = ", ".join(direction.name for direction in self.directions[:-1])
        paragraphs = (
            "A variogram shows how much two clips differ (half the mean squared distance between "
            "their motions, without the trend) against the distance between their controls. If "
            "the dots do not rise, the control does not explain the motions. If they start high, "
            "clips with equal controls differ.",
            f"The kriging model in use was tuned by leave-one-out: covariance {self.covariance}, "
            f"nugget {self.nugget:.3g} of the sill. The height of its curve is fitted to the "
            "leave-one-out errors and so may differ from the dots.",
        )
        caption = (
            "Pairs of clips (grey), their means by distance (blue dots, larger for more pairs) "
            "with a fitted curve (blue), and the kriging model in use (orange). The panel of a "
            "control shows the pairs that differ mostly in that control."
        )
        alt = f"Variograms along {names}, and over the scaled distance of all controls."
        drawn = svg_chart.draw(2.9 * rows, self._paint, alt, caption)
        return Section("variograms", "Variograms", paragraphs, charts=(drawn,))

    def _paint(self, figure: Figure) -> None:
        axes = figure.subplots(*self._grid, sharey=True, squeeze=False)
        for ax in axes.ravel()[len(self.directions) :]:
            ax.remove()
        for ax, direction in zip(axes.ravel(), self.directions, strict=False):
            self._panel(ax, direction)
        for ax in axes[:, 0]:
            ax.set_ylabel("semivariance (cm²)")
        tops = [np.quantile(d.semivariances, 0.99) for d in self.directions if len(d.distances)]
        axes[0, 0].set_ylim(0.0, 1.15e4 * max(tops))

    def _panel(self, ax: Axes, direction: DirectionalVariogram) -> None:
        # Thousands of points take less space as a bitmap.
        (cloud,) = ax.plot(direction.distances, 1e4 * direction.semivariances, ".", markersize=4)
        cloud.set(color=svg_chart.GREY, alpha=0.45, rasterized=True, markeredgewidth=0)
        mean, far = direction.mean, direction.distances.max(initial=0.1)
        at = np.linspace(0.0, far, 100)
        field = self.sill * (self.nugget + self._rise(at * direction.scale))
        ax.plot(at, 1e4 * field, color=svg_chart.ORANGE)
        if direction.fit:
            fitted = direction.fit.nugget + direction.fit.sill * self._rise(
                at / direction.fit.range
            )
            ax.plot(at, 1e4 * fitted, color=svg_chart.BLUE, linewidth=1.0)
        size = 10.0 + 50.0 * mean.pairs / mean.pairs.max(initial=1.0)
        ax.scatter(mean.distances, 1e4 * mean.values, s=size, color=svg_chart.BLUE, zorder=3)
        title = f"{svg_chart.label(direction.name)}: {len(direction.distances)} pairs"
        ax.set(title=title, xlabel=direction.unit, xlim=(0.0, 1.03 * far))

    def _rise(self, distances: Floats) -> Floats:
        return 1.0 - COVARIANCES[self.covariance].numpy(np.square(distances))


def measure_variograms(trained: TrainedModel, controls: tuple[Control, ...]) -> Variograms:
    """Return the variograms of a trained model's poses over its controls."""
    hyper, points = trained.pose.hyper, trained.samples.half_ranges
    left = variogram.residuals(points, trained.values["pose"], max(hyper.drifts))
    first, second = np.triu_indices(len(points), k=1)
    # The tensor sums over joints and frames; the chart shows a mean.
    shared = trained.tensor.weight * trained.tensor.values.shape[1]
    halves = 0.5 * np.sum(np.square(left[first] - left[second]), axis=1) / shared
    gaps = np.abs(points[first] - points[second])
    ways = np.linalg.norm(gaps, axis=1)
    directions = []
    for control, gap, scale in zip(controls, gaps.T, hyper.scales, strict=True):
        along = (gap >= MIN_DIRECTION_SHARE * ways) & (ways > 0.0)
        pairs = gap[along], halves[along]
        mean = by_lag(*pairs)
        fit = _fit(mean, hyper.covariance)
        own = DirectionalVariogram(control.name, "half-ranges", *pairs, mean, fit, float(scale))
        directions.append(own)
    scaled = np.sqrt(np.sum(np.square(gaps * hyper.scales), axis=1))
    mean = by_lag(scaled, halves)
    fit = _fit(mean, hyper.covariance)
    every = DirectionalVariogram("all controls", "scaled distance", scaled, halves, mean, fit, 1.0)
    return Variograms(
        (*directions, every), hyper.covariance, hyper.nugget, trained.pose.sill / shared
    )


def by_lag(distances: Floats, semivariances: Floats) -> ExperimentalVariogram:
    """Return the means (L,) of pairs (P,) over the variogram's lags that have enough pairs."""
    far = variogram.LARGEST_LAG * distances.max(initial=0.0)
    edges = np.linspace(0.0, far, variogram.LAGS + 1)
    lag = np.searchsorted(edges, distances, side="left") - 1
    near = (lag >= 0) & (lag < variogram.LAGS)
    pairs = np.bincount(lag[near], minlength=variogram.LAGS)
    enough = pairs >= variogram.FEWEST_PAIRS
    sums = (
        np.bincount(lag[near], x[near], variogram.LAGS)[enough] for x in (distances, semivariances)
    )
    mean_distances, means = (total / pairs[enough] for total in sums)
    return ExperimentalVariogram(mean_distances, means, pairs[enough].astype(np.float64))


def _fit(mean: ExperimentalVariogram, covariance: str) -> VariogramModel | None:
    return variogram.fit_by_grid(mean, covariance) if len(mean.pairs) >= FEWEST_LAGS else None
