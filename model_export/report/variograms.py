"""How motions part with their controls: pairs, their means by distance, and the fields' curves."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from model_export import variogram
from model_export.covariance import COVARIANCES
from model_export.report import left_out, picture, plain
from model_export.report.page import Section
from model_export.train import Trained
from model_export.variogram import Experimental, Fit
from service.motion.card import Control
from service.motion.conventions import Floats

# A pair goes along a control that has at least this share of its way: within 45 degrees.
ALONG = np.sqrt(0.5)
# A curve through fewer lags than this would be drawn at will.
FEWEST_LAGS = 3


@dataclass(frozen=True)
class Direction:
    """Pairs (P,) of clips along one control, or in the field's own distance.

    distances in unit, semivariances in m². mean: by lag. fit: to the mean, where there are lags
    enough. scale: what a unit is worth to the field as distance.
    """

    name: str
    unit: str
    distances: Floats
    semivariances: Floats
    mean: Experimental
    fit: Fit | None
    scale: float

    def facts(self) -> dict[str, Any]:
        """Means by lag and the fit; the pairs themselves are only drawn."""
        return {
            "name": self.name,
            "distance_unit": self.unit,
            "pairs": len(self.distances),
            "lag_distances": plain.numbers(self.mean.distances),
            "lag_semivariances_m2": plain.numbers(self.mean.values),
            "lag_pairs": [int(count) for count in self.mean.pairs],
            "fit": self.fit and {name: plain.number(x) for name, x in vars(self.fit).items()},
            "field_scale": plain.number(self.scale),
        }


@dataclass(frozen=True)
class Variograms:
    """Directions, the field's own distance last; covariance, nugget (of the sill) and sill, m²."""

    directions: tuple[Direction, ...]
    covariance: str
    nugget: float
    sill: float

    @property
    def _grid(self) -> tuple[int, int]:
        """Rows and columns of panels."""
        columns = 2 if len(self.directions) in (2, 4) else 3
        return -(-len(self.directions) // columns), columns

    def facts(self) -> dict[str, Any]:
        """The pose field's parameters and every direction."""
        return {
            "covariance": self.covariance,
            "nugget": plain.number(self.nugget),
            "sill_m2": plain.number(self.sill),
            "directions": [direction.facts() for direction in self.directions],
        }

    def section(self) -> Section:
        """One panel a control and one for all."""
        rows, _ = self._grid
        names = ", ".join(direction.name for direction in self.directions[:-1])
        words = (
            "Half the mean squared distance between two motions, after the drift is taken off, "
            "against how far apart their controls lie. A cloud that does not rise says that a "
            "control does not explain the motions; one that starts high, that equal controls are "
            "met by unequal motions.",
            f"The field in use was tuned by leave-one-out: {self.covariance}, nugget "
            f"{self.nugget:.3g} of the sill. Its curve has the height that leave-one-out found, "
            "which counts in how far prediction has to reach.",
        )
        caption = (
            "Pairs of clips (grey), their means by distance (blue, larger for more pairs) with a "
            "fit (line), and the curve of the field in use (orange). Along a control count pairs "
            "whose way is mostly along it."
        )
        alt = f"Variogram clouds along {names}, and in the pose field's own scaled distance."
        drawn = picture.draw("variograms", 2.9 * rows, self._paint, alt, caption)
        return Section("variograms", "Variograms", words, pictures=(drawn,))

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

    def _panel(self, ax: Axes, direction: Direction) -> None:
        # Thousands of points are one picture within the picture.
        (cloud,) = ax.plot(direction.distances, 1e4 * direction.semivariances, ".", markersize=4)
        cloud.set(color=picture.GREY, alpha=0.45, rasterized=True, markeredgewidth=0)
        mean, far = direction.mean, direction.distances.max(initial=0.1)
        at = np.linspace(0.0, far, 100)
        field = self.sill * (self.nugget + self._rise(at * direction.scale))
        ax.plot(at, 1e4 * field, color=picture.ORANGE)
        if direction.fit:
            fitted = direction.fit.nugget + direction.fit.sill * self._rise(
                at / direction.fit.range
            )
            ax.plot(at, 1e4 * fitted, color=picture.BLUE, linewidth=1.0)
        size = 10.0 + 50.0 * mean.pairs / mean.pairs.max(initial=1.0)
        ax.scatter(mean.distances, 1e4 * mean.values, s=size, color=picture.BLUE, zorder=3)
        title = f"{direction.name}: {len(direction.distances)} pairs"
        ax.set(title=title, xlabel=direction.unit, xlim=(0.0, 1.03 * far))

    def _rise(self, distances: Floats) -> Floats:
        return 1.0 - COVARIANCES[self.covariance].numpy(np.square(distances))


def of(trained: Trained, controls: tuple[Control, ...]) -> Variograms:
    """Variograms of a trained model's pose field over its controls."""
    hyper, points = trained.pose.hyper, trained.laid.half_ranges
    left = variogram.residuals(points, trained.values["pose"], max(hyper.drifts))
    first, second = np.triu_indices(len(points), k=1)
    # The tensor sums over joints and frames; a mean is what can be read.
    shared = trained.tensor.weight * trained.tensor.values.shape[1]
    halves = 0.5 * np.sum(np.square(left[first] - left[second]), axis=1) / shared
    gaps = np.abs(points[first] - points[second])
    ways = np.linalg.norm(gaps, axis=1)
    directions = []
    for control, gap, scale in zip(controls, gaps.T, hyper.scales, strict=True):
        along = (gap >= ALONG * ways) & (ways > 0.0)
        of_unit = control.name, "half-ranges"
        mean = by_lag(gap[along], halves[along])
        fit = _fit(mean, hyper.covariance)
        directions.append(Direction(*of_unit, gap[along], halves[along], mean, fit, float(scale)))
    others = left_out.performers(trained)[first] != left_out.performers(trained)[second]
    scaled = np.sqrt(np.sum(np.square(gaps * hyper.scales), axis=1) + hyper.label**2 * others)
    mean = by_lag(scaled, halves)
    fit = _fit(mean, hyper.covariance)
    every = Direction("all controls", "scaled distance", scaled, halves, mean, fit, 1.0)
    return Variograms(
        (*directions, every), hyper.covariance, hyper.nugget, trained.pose.sill / shared
    )


def by_lag(distances: Floats, semivariances: Floats) -> Experimental:
    """Means (L,) over the lags with enough pairs of (P,) pairs, by the variogram's own lags."""
    far = variogram.FAR * distances.max(initial=0.0)
    edges = np.linspace(0.0, far, variogram.LAGS + 1)
    lag = np.searchsorted(edges, distances, side="left") - 1
    near = (lag >= 0) & (lag < variogram.LAGS)
    pairs = np.bincount(lag[near], minlength=variogram.LAGS)
    enough = pairs >= variogram.FEWEST_PAIRS
    sums = (
        np.bincount(lag[near], x[near], variogram.LAGS)[enough] for x in (distances, semivariances)
    )
    mean_distances, means = (total / pairs[enough] for total in sums)
    return Experimental(mean_distances, means, pairs[enough].astype(np.float64))


def _fit(mean: Experimental, covariance: str) -> Fit | None:
    return variogram.fit(mean, covariance) if len(mean.pairs) >= FEWEST_LAGS else None
