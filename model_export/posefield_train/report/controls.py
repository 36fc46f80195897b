"""Coverage of the controls and their explained share, limits of answers, and accuracy of sigma."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import spearmanr

from posefield.common.units import Floats
from posefield.inference import session
from posefield.kriging import support
from posefield.kriging.kriging_model import Hyper
from posefield.model_file.model_card import Control, ModelCard
from posefield.motion import measures
from posefield.question.model_question import SuggestQuestion
from posefield.question.results import Suggestion
from posefield.synthesis import trust
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging.kriging_bank import POSE
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.report import page
from posefield_train.report.page import Section, Table, draw_chart, percent, short_label

BINS = 16
# Joints named, and captures suggested.
LISTED_JOINTS, POINTS = 8, 8


def coverage_section(trained: TrainedModel, controls: tuple[Control, ...]) -> Section:
    """Return a table of the controls, warnings, and a scatter plot of each pair."""
    values = np.stack([example.controls for example in trained.examples])
    performers = [example.row.performer for example in trained.examples]
    labels = label_controls(controls, values, performers)
    correlation = np.atleast_2d(np.corrcoef(values.T))
    ranges: list[dict[str, Any]] = [
        {
            "name": control.name,
            "unit": control.unit,
            "minimum": control.minimum,
            "maximum": control.maximum,
            "distinct": len(np.unique(column)),
            "values": list(control.values),
            "widest_gap": _widest_gap(column),
        }
        for control, column in zip(controls, values.T, strict=True)
    ]
    few = [
        f"{control.name} has only {len(control.values)} distinct values "
        f"({', '.join(f'{value:g}' for value in control.values)}): nothing was captured "
        "between them."
        for control in controls
        if control.values
    ]
    paragraphs = (
        "Where no clip was captured the model extrapolates. The charts show such regions; they "
        "may lie within the range of every single control.",
        *few,
        *(
            f"{name} has one value for each performer and so identifies the performer. The "
            "leave-one-out error is then too small for new performers."
            for name in labels
        ),
    )
    described = zip(ranges, controls, strict=True)
    table = Table.of(
        "Captured range of each control",
        [{**row, "description": control.description} for row, control in described],
        ("control", "name", str),
        ("unit", "unit", str),
        ("minimum", "minimum", "{:.4g}".format),
        ("maximum", "maximum", "{:.4g}".format),
        ("distinct values", "distinct", str),
        ("widest gap", "widest_gap", lambda gap: "{:.4g} to {:.4g}".format(*gap)),
        ("description", "description", str),
    )
    names = ", ".join(control.name for control in controls)
    errors = np.sqrt(trained.left_out_errors)
    chart = draw_chart(
        max(3.0, min(9.0, 2.1 * len(controls))),
        partial(_paint_pairs, controls, values, errors, correlation),
        f"Scatter plots of each pair of the controls {names}, over {len(values)} clips.",
        "Below the diagonal: the clips, coloured by their leave-one-out error. On the "
        "diagonal: number of clips by value. Above the diagonal: correlation.",
    )
    facts = {
        "controls": ranges,
        "one_value_a_performer": list(labels),
        "correlation": correlation,
    }
    return Section("coverage", "Coverage of the controls", paragraphs, (table,), (chart,), facts)


def label_controls(
    controls: Sequence[Control], values: Floats, performers: Sequence[str]
) -> tuple[str, ...]:
    """Return the controls that have one value for each performer, and so identify them.

    values: (N, d). performers: names (N,), empty if the recipe has none.
    """
    indices = np.unique(performers, return_inverse=True)[1]
    several = 1 < len(set(performers)) < len(performers)
    return tuple(
        control.name
        for control, column in zip(controls, values.T, strict=True)
        if several and all(np.ptp(column[indices == index]) == 0.0 for index in set(indices))
    )


def _widest_gap(values: Floats) -> tuple[float, float]:
    distinct = np.unique(values)
    at = int(np.argmax(np.diff(distinct)))
    return float(distinct[at]), float(distinct[at + 1])


def _paint_pairs(
    controls: Sequence[Control], values: Floats, errors: Floats, correlation: Floats, figure: Figure
) -> None:
    count = len(controls)
    axes = figure.subplots(count, count, squeeze=False)
    for (row, column), ax in np.ndenumerate(axes):
        if row < column:
            text = f"correlation\n{correlation[row, column]:+.2f}"
            ax.text(0.5, 0.5, text, ha="center", va="center", color=page.GREY)
            ax.set_axis_off()
        elif row > column:
            x, y = values[:, [column, row]].T
            points = ax.scatter(x, y, c=100 * errors, s=16, cmap="viridis_r")
        else:
            ax.hist(values[:, row], bins=BINS, color=page.BLUE)
            ax.grid(visible=False, axis="x")
            ax.yaxis.get_major_locator().set_params(integer=True)
    titles = [f"{short_label(c.name)} ({short_label(c.unit)})" for c in controls]
    for at, title in enumerate(titles):
        axes[-1, at].set_xlabel(title)
        axes[at, 0].set_ylabel(title if at else "clips")
    if count > 1:
        figure.colorbar(points, ax=axes, label="leave-one-out error (cm)", shrink=0.6, aspect=30)


def trust_section(exported: ExportedModel) -> Section:
    """Return the limits of an exported model: measured controls, support, joints, captures."""
    card = exported.card
    opened = session.open_bytes(exported.content, card.name)
    question = SuggestQuestion(count=POINTS)
    suggested = trust.suggest(Synthesizer(card.name, opened), question)
    limit = support.fit_support(np.array(card.examples)).limit
    return limits_section(card, limit, suggested.suggestions)


def limits_section(card: ModelCard, limit: float, points: Sequence[Suggestion]) -> Section:
    """Return the limits of a model's predictions.

    limit: largest variance of supported controls. points: suggested captures, the one that reduces
    the variance most first.
    """
    names = card.skeleton.names
    measured = {
        control.name: measures.describe(control.measure, names)
        for control in card.controls
        if control.measure
    }
    sigmas = zip(names, card.joint_sigma, strict=True)
    joints = dict(sorted(sigmas, key=lambda pair: -pair[1]))
    listed = ", ".join(f"{name} ({how})" for name, how in measured.items())
    paragraphs = (
        f"Answers match these measured controls exactly: {listed}."
        if listed
        else "No control is measured on the motion: answers match exactly only the targets of "
        "a request.",
        f"Controls count as supported up to {100 * support.RANGE_MARGIN:g} % "
        "of a range beyond the "
        f"captured clips, where the variance of the support model is at most {limit:.2f}. "
        "Of the captured clips, each left out in turn, "
        f"{100 * support.SUPPORT_QUANTILE:g} % are "
        "within that limit.",
        "Each suggested capture assumes that those above it were captured.",
    )
    suggestions: list[dict[str, Any]] = [
        {"controls": dict(point.controls), "gain": point.gain, "lacking": point.lacking}
        for point in points
    ]
    shares = tuple((name, f"{share:.2f}") for name, share in list(joints.items())[:LISTED_JOINTS])
    tables = (
        Table.of(
            "Suggested captures",
            [{"order": order, **row} for order, row in enumerate(suggestions, start=1)],
            ("order", "order", str),
            *((c.name, f"controls/{c.name}", "{:.4g}".format) for c in card.controls),
            ("mean variance falls by", "gain", lambda gain: f"{100 * gain:.1f} %"),
        ),
        Table("Joints with the largest error", ("joint", "sigma relative to pose"), shares),
    )
    facts = {
        "measured": measured,
        "support_limit": limit,
        "joint_sigma": joints,
        "suggestions": suggestions,
    }
    return Section("trust", "Limits of the answers", paragraphs, tables, (), facts)


def calibration_section(trained: TrainedModel) -> Section:
    """Return statistics and charts of sigma against the error of left-out clips."""
    predicted = np.sqrt(trained.model.bank.sill * trained.pose.variances)
    actual = np.sqrt(trained.warped_errors)
    statistics = calibration_statistics(predicted, actual)
    paragraphs = (
        "Sigma is the standard deviation that the model predicts for its own error. It is "
        "scaled so that the mean of error² / sigma² over all left-out clips is 1, with motions "
        "compared after time warping. The rank "
        "correlation shows whether sigma also tells difficult motions from easy ones: near 0, "
        "sigma is right only on average.",
    )
    rows = (
        ("mean of error² / sigma²", f"{statistics['mean_squared_ratio']:.3f}"),
        ("median of error / sigma", f"{statistics['median_ratio']:.2f}"),
        ("clips with an error up to sigma", percent(statistics["within_one_sigma"])),
        ("clips with an error up to 2 sigma", percent(statistics["within_two_sigma"])),
        ("rank correlation of error and sigma", f"{statistics['rank_correlation']:+.2f}"),
    )
    chart = draw_chart(
        3.3,
        partial(_paint_calibration, predicted, actual),
        f"Scatter plot of error against sigma of {len(actual)} left-out clips, and a "
        "histogram of their ratio.",
        "Left: one point per left-out clip. Right: distribution of error / sigma.",
    )
    table = Table("Errors of left-out clips", ("measure", "value"), rows)
    facts = {**statistics, "predicted_m": predicted, "actual_m": actual}
    return Section("calibration", "Accuracy of sigma", paragraphs, (table,), (chart,), facts)


def calibration_statistics(predicted: Floats, actual: Floats) -> dict[str, float]:
    """Return statistics of predicted standard deviations (N,) and errors (N,), m.

    The rank correlation is Spearman's; 0 if one of both is constant.
    """
    ratios = actual / predicted
    is_constant = np.ptp(predicted) == 0.0 or np.ptp(actual) == 0.0
    return {
        "mean_squared_ratio": float(np.mean(np.square(ratios))),
        "median_ratio": float(np.median(ratios)),
        "within_one_sigma": float(np.mean(ratios <= 1.0)),
        "within_two_sigma": float(np.mean(ratios <= 2.0)),
        "rank_correlation": 0.0 if is_constant else float(spearmanr(predicted, actual).statistic),
    }


def _paint_calibration(predicted: Floats, actual: Floats, figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    top = 108 * max(float(predicted.max()), float(actual.max()))
    for times, style, label in ((1.0, "-", "error = sigma"), (2.0, ":", "error = 2 sigma")):
        sigmas = [0.0, top / times]
        left.plot(sigmas, [0.0, top], style, color=page.INK, linewidth=0.9, label=label)
    left.plot(100 * predicted, 100 * actual, ".", color=page.BLUE, markersize=7)
    left.set(xlabel="sigma (cm)", ylabel="error (cm)", xlim=(0, top), ylim=(0, top))
    left.set_title("left-out clips")
    left.legend(loc="upper left")
    right.hist(actual / predicted, bins=20, color=page.BLUE)
    right.axvline(1.0, color=page.INK, linewidth=0.9)
    right.set(xlabel="error / sigma", ylabel="clips", title="error / sigma")
    right.grid(visible=False, axis="x")
    right.yaxis.get_major_locator().set_params(integer=True)


_MEANING = {
    "pose": "joint rotations and root path",
    "offsets": "bone lengths",
    "duration": "length of the clip",
    "warp": "timing within the clip",
    "travel": "distance and turn of a cycle",
}


def quantity_section(trained: TrainedModel, controls: tuple[Control, ...]) -> Section:
    """Return the explained share and the parameters of each kriged quantity, the pose first."""
    names, label_sets = [control.name for control in controls], tuple(trained.model.bank.labels)
    bank = {POSE: trained.model.bank.pose, **trained.model.bank.other_models}
    facts: dict[str, Any] = {}
    rows = []
    for name, share in trained.explained.items():
        model = bank[name]
        meaning, explained = _MEANING.get(name, ""), percent(share)
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
    return Section("fields", "What the controls explain", paragraphs, (table,), (), facts)


def _parameters(hyper: Hyper, label_sets: tuple[str, ...]) -> dict[str, float]:
    """Return the parameters of a quantity beside its scales and nugget, by name."""
    parameters = {"trend": hyper.trend}
    for name, label in zip(label_sets, hyper.labels, strict=True):
        parameters[f"correlation of {name}s"] = label.correlation
        parameters[f"offset of {name}s"] = label.offset
    return parameters
