"""The kriging model of each quantity, and variograms of the poses."""

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
from posefield_train.kriging.kriging_bank import POSE
from posefield_train.kriging.universal_kriging import Hyper, UniversalKriging
from posefield_train.kriging.variogram import ExperimentalVariogram, VariogramModel
from posefield_train.report.drawing import svg_chart
from posefield_train.report.drawing.html_page import Chapter, Section, Table

# A pair counts for a control that contributes this share of its distance: within 45 degrees.
MIN_DIRECTION_SHARE = np.sqrt(0.5)
# Fewer lags do not determine a curve.
FEWEST_LAGS = 3
_MEANING = {
    "pose": "joint rotations and root path",
    "offsets": "bone lengths",
    "duration": "length of the clip",
    "warp": "timing within the clip",
    "travel": "distance and turn of a cycle",
}


def quantity_chapter(trained: TrainedModel, controls: tuple[Control, ...]) -> Chapter:
    """Return the explained share and the parameters of each kriged quantity, the pose first."""
    names, label_sets = [control.name for control in controls], tuple(trained.model.bank.labels)
    bank = {POSE: trained.model.bank.pose, **trained.model.bank.others}
    facts: dict[str, Any] = {}
    rows = []
    for name, share in trained.explained.items():
        model = bank[name]
        meaning, explained = _MEANING.get(name, ""), f"{100 * share:.0f} %"
        if not isinstance(model, UniversalKriging):
            facts[name] = {"explained": share, "answered_with": "mean"}
            blank = [""] * (1 + 2 * len(label_sets) + len(names))
            rows.append((name, meaning, explained, "mean", "", *blank))
            continue
        hyper, parameters = model.hyper, _parameters(model.hyper, label_sets)
        facts[name] = {
            "explained": share,
            "answered_with": "kriging",
            "nugget": hyper.nugget,
            "scales": dict(zip(names, hyper.scales.tolist(), strict=True)),
            **parameters,
            "drifts": list(hyper.drifts),
        }
        numbers = (hyper.nugget, *parameters.values(), *hyper.scales)
        rows.append((name, meaning, explained, "kriging", *(f"{value:.3g}" for value in numbers)))
    paragraphs = (
        "Explained is the share of the variation between clips that kriging predicts from the "
        "controls, with each clip left out in turn. All quantities but "
        "the pose are shrunk to the mean of the clips, as far as these predictions advise.",
        "The scale of a control is its weight in the distance between clips, per half-range. "
        "All quantities share the scales. The nugget is the share of the variance that remains "
        "between clips with equal controls, and the trend the variance of the slope along a "
        "control. In each label set, such as performers, the correlation is that of the "
        "motions of two names with equal controls, and the offset the variance of a name's "
        "own offset.",
    )
    pose = next(model.hyper for model in bank.values() if isinstance(model, UniversalKriging))
    titles = (
        *("quantity", "meaning", "explained", "predicted by", "nugget"),
        *_parameters(pose, label_sets),
        *(f"scale of {name}" for name in names),
    )
    table = Table("UniversalKriging models", titles, tuple(rows))
    return Chapter(facts, Section("fields", "What the controls explain", paragraphs, (table,)))


def _parameters(hyper: Hyper, label_sets: tuple[str, ...]) -> dict[str, float]:
    """Return the parameters of a quantity beside its scales and nugget, by name."""
    parameters = {"trend": hyper.trend}
    for name, label in zip(label_sets, hyper.labels, strict=True):
        parameters[f"correlation of {name}s"] = label.correlation
        parameters[f"offset of {name}s"] = label.offset
    return parameters


@dataclass(frozen=True)
class DirectionalVariogram:
    """Pairs (P,) of clips along one control, or by the scaled distance of all controls.

    distances: in `unit`. semivariances: m². scale: factor from the unit to the scaled distance.
    mean: by lag. fit: None with fewer than FEWEST_LAGS lags.
    """

    name: str
    unit: str
    distances: Floats
    semivariances: Floats
    scale: float
    mean: ExperimentalVariogram
    fit: VariogramModel | None


def measure_variograms(
    trained: TrainedModel, controls: tuple[Control, ...]
) -> list[DirectionalVariogram]:
    """Return the variograms of a trained model's poses over its controls, and over all of them."""
    hyper, points = trained.pose.hyper, trained.samples.half_ranges
    left = variogram.residuals(points, trained.values["pose"], max(hyper.drifts))
    first, second = np.triu_indices(len(points), k=1)
    # The tensor sums over joints and frames; the chart shows a mean.
    shared = trained.tensor.weight * trained.tensor.values.shape[1]
    halves = 0.5 * np.sum(np.square(left[first] - left[second]), axis=1) / shared
    gaps = np.abs(points[first] - points[second])
    ways = np.linalg.norm(gaps, axis=1)

    def along(name: str, unit: str, distances: Floats, values: Floats, scale: float) -> Any:
        mean = by_lag(distances, values)
        enough = len(mean.pairs) >= FEWEST_LAGS
        fit = variogram.fit_by_grid(mean, hyper.covariance) if enough else None
        return DirectionalVariogram(name, unit, distances, values, scale, mean, fit)

    directions = []
    for control, gap, scale in zip(controls, gaps.T, hyper.scales, strict=True):
        is_along = (gap >= MIN_DIRECTION_SHARE * ways) & (ways > 0.0)
        pairs = gap[is_along], halves[is_along]
        directions.append(along(control.name, "half-ranges", *pairs, float(scale)))
    scaled = np.sqrt(np.sum(np.square(gaps * hyper.scales), axis=1))
    return [*directions, along("all controls", "scaled distance", scaled, halves, 1.0)]


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


def variogram_chapter(trained: TrainedModel, controls: tuple[Control, ...]) -> Chapter:
    """Return a chart with a panel for each control and one for all controls."""
    directions, hyper = measure_variograms(trained, controls), trained.pose.hyper
    sill = trained.pose.sill / (trained.tensor.weight * trained.tensor.values.shape[1])
    facts = {
        "covariance": hyper.covariance,
        "nugget": hyper.nugget,
        "sill_m2": sill,
        "directions": [
            {
                "name": one.name,
                "distance_unit": one.unit,
                "pairs": len(one.distances),
                "lag_distances": one.mean.distances,
                "lag_semivariances_m2": one.mean.values,
                "lag_pairs": one.mean.pairs.astype(int),
                "fit": one.fit and vars(one.fit),
                "field_scale": one.scale,
            }
            for one in directions
        ],
    }
    paragraphs = (
        "A variogram shows how much two clips differ (half the mean squared distance between "
        "their motions, without the trend) against the distance between their controls. If "
        "the dots do not rise, the control does not explain the motions. If they start high, "
        "clips with equal controls differ.",
        f"The kriging model in use was tuned by leave-one-out: covariance {hyper.covariance}, "
        f"nugget {hyper.nugget:.3g} of the sill. The height of its curve is fitted to the "
        "leave-one-out errors and so may differ from the dots.",
    )
    columns = 2 if len(directions) in (2, 4) else 3
    rows = -(-len(directions) // columns)

    def rise(distances: Floats) -> Floats:
        return 1.0 - COVARIANCES[hyper.covariance].numpy(np.square(distances))

    def paint_panel(ax: Axes, one: DirectionalVariogram) -> None:
        # Thousands of points take less space as a bitmap.
        (cloud,) = ax.plot(one.distances, 1e4 * one.semivariances, ".", markersize=4)
        cloud.set(color=svg_chart.GREY, alpha=0.45, rasterized=True, markeredgewidth=0)
        mean, far = one.mean, one.distances.max(initial=0.1)
        at = np.linspace(0.0, far, 100)
        model = sill * (hyper.nugget + rise(at * one.scale))
        ax.plot(at, 1e4 * model, color=svg_chart.ORANGE)
        if one.fit:
            fitted = one.fit.nugget + one.fit.sill * rise(at / one.fit.range)
            ax.plot(at, 1e4 * fitted, color=svg_chart.BLUE, linewidth=1.0)
        size = 10.0 + 50.0 * mean.pairs / mean.pairs.max(initial=1.0)
        ax.scatter(mean.distances, 1e4 * mean.values, s=size, color=svg_chart.BLUE, zorder=3)
        title = f"{svg_chart.label(one.name)}: {len(one.distances)} pairs"
        ax.set(title=title, xlabel=one.unit, xlim=(0.0, 1.03 * far))

    def paint(figure: Figure) -> None:
        axes = figure.subplots(rows, columns, sharey=True, squeeze=False)
        for ax in axes.ravel()[len(directions) :]:
            ax.remove()
        for ax, one in zip(axes.ravel(), directions, strict=False):
            paint_panel(ax, one)
        for ax in axes[:, 0]:
            ax.set_ylabel("semivariance (cm²)")
        tops = [np.quantile(one.semivariances, 0.99) for one in directions if len(one.distances)]
        axes[0, 0].set_ylim(0.0, 1.15e4 * max(tops))

    names = ", ".join(one.name for one in directions[:-1])
    chart = svg_chart.draw(
        2.9 * rows,
        paint,
        f"Variograms along {names}, and over the scaled distance of all controls.",
        "Pairs of clips (grey), their means by distance (blue dots, larger for more pairs) "
        "with a fitted curve (blue), and the kriging model in use (orange). The panel of a "
        "control shows the pairs that differ mostly in that control.",
    )
    return Chapter(facts, Section("variograms", "Variograms", paragraphs, (), (chart,)))
