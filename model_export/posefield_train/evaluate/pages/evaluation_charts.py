"""Charts of an evaluation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from posefield.common.units import Floats
from posefield_train.evaluate import event_bodies
from posefield_train.evaluate.event_bodies import CAPTURED, EventBodies, EventBody
from posefield_train.evaluate.learning_curves import Learning
from posefield_train.evaluate.methods import EXACT, OURS
from posefield_train.evaluate.new_performers import ADAPTATION_COUNTS
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.evaluate.summary import evaluation_summary
from posefield_train.evaluate.summary.method_summary import MethodSummary
from posefield_train.report.drawing import stick_figures, svg_chart
from posefield_train.report.drawing.svg_chart import Chart

MAX_NAMED_CLIPS = 8
"""Clips named beside the scatter plot."""
MAX_MARKERS = 512
"""More points than this are drawn as a bitmap."""
MARGIN = 0.15
"""Space around a body, m."""
PANELS: dict[str, dict[str, str]] = {
    "leave_one_clip_out": {OURS: "predicted", EXACT: "corrected to the target"},
    "leave_one_performer_out": {
        OURS: "no clip shown",
        **{
            name: f"{count} clip{'s' * (count > 1)} shown"
            for name, count in ADAPTATION_COUNTS.items()
            if count < max(ADAPTATION_COUNTS.values())
        },
    },
}
"""Methods whose bodies are drawn, and the titles of their panels, by protocol."""


def method_bars(found: Sequence[MethodSummary]) -> Chart:
    """Return the mean distances of all methods."""
    *most, last = _bar_columns(found)
    titles = f"{', '.join(most)} and {last}" if most else last
    return svg_chart.draw(
        0.9 + 0.27 * len(found),
        partial(paint_bars, found),
        f"Bar charts of the {titles} error of {len(found)} methods.",
        "Mean error by method, posefield in orange. The axes end at two and a half times the error "
        "of posefield. Black lines are standard errors over clips.",
    )


def paint_bars(found: Sequence[MethodSummary], figure: Figure) -> None:
    """Draw a panel for each kind of distance, with a bar for each method."""
    names = [one.name.replace("_", " ") for one in found]
    colours = [svg_chart.ORANGE if one.name.startswith(OURS) else svg_chart.BLUE for one in found]
    columns = _bar_columns(found)
    axes = figure.subplots(1, len(columns), sharey=True, squeeze=False)[0]
    ranked = next(iter(columns))
    for ax, (title, values) in zip(axes, columns.items(), strict=True):
        spread = [100 * one.standard_error for one in found] if title == ranked else None
        ax.barh(names, 100 * np.nan_to_num(values), color=colours, xerr=spread)
        # A few methods have much larger errors, which would hide the differences of the others.
        ax.set(title=title, xlabel="cm", xlim=(0, 250 * float(np.nan_to_num(values[0])) or 1.0))
        ax.grid(visible=False, axis="y")
    axes[0].invert_yaxis()


def _bar_columns(found: Sequence[MethodSummary]) -> dict[str, list[float]]:
    """Return the errors of all methods, m, by title; those by which methods are ranked first."""
    curves = [one.curve_distance for one in found] if found[0].curves else []
    positions = {
        "root-relative": [one.mean.relative.mean for one in found],
        "global": [one.mean.absolute.mean for one in found],
        "effector": [one.mean.effector for one in found],
    }
    return (positions if found[0].has_positions else {}) | ({"curves": curves} if curves else {})


def clips(result: EvaluationResult, rival: str) -> Chart:
    """Return the error of each clip against that of another method."""
    return svg_chart.draw(
        3.6,
        partial(_paint_clips, result, rival),
        f"Scatter plot of posefield's error of each clip against that of {rival}, and the clips "
        "with posefield's largest errors.",
        f"Left: one point per motion; below the line the error of posefield is smaller than that "
        f"of {rival}, the best of the other methods.",
    )


def _paint_clips(result: EvaluationResult, rival: str, figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    ours, theirs = (
        100 * evaluation_summary.clip_distances(result, result.of(name, result.asked(name)))
        for name in (OURS, rival)
    )
    left.plot(theirs, ours, ".", color=svg_chart.BLUE, rasterized=len(ours) > MAX_MARKERS)
    far = 1.05 * max(ours.max(), theirs.max())
    left.plot([0, far], [0, far], color=svg_chart.GREY, linewidth=0.8)
    title = "root-relative error" if result.has_positions else "error of the curves"
    left.set(xlabel=f"{rival} (cm)", ylabel="posefield (cm)", title=title, aspect="equal")
    worst = np.argsort(-ours)[:MAX_NAMED_CLIPS]
    right.barh(
        [svg_chart.label(result.clips[i]) for i in worst], ours[worst], color=svg_chart.ORANGE
    )
    right.invert_yaxis()
    right.set(xlabel="cm", title="largest errors of posefield")
    right.grid(visible=False, axis="y")


def calibration(result: EvaluationResult) -> Chart:
    """Return the error of each motion against sigma."""
    return svg_chart.draw(
        3.2,
        partial(_paint_calibration, result),
        "Scatter plot of the actual error against sigma.",
        "RMS global error of each motion against sigma, the standard deviation that the model "
        "predicts. On the line both are equal.",
    )


def _paint_calibration(result: EvaluationResult, figure: Figure) -> None:
    ax = figure.subplots()
    actual = 100 * np.sqrt(
        [error.mean_squared_error for error in result.of(OURS, result.asked(OURS))]
    )
    sigma = 100 * result.sigma
    ax.plot(sigma, actual, ".", color=svg_chart.BLUE, rasterized=len(actual) > MAX_MARKERS)
    far = 1.1 * float(sigma.max())
    ax.plot([0, far], [0, far], color=svg_chart.GREY, linewidth=0.8)
    ax.set(xlabel="sigma (cm)", ylabel="error (cm)", title="error against sigma", xlim=(0, far))


def learning(curve: Learning) -> Chart:
    """Return the error against the number of samples, suggested and random."""
    return svg_chart.draw(
        3.2,
        partial(_paint_learning, curve),
        "Line charts of the error against the number of samples, suggested and at random.",
        "Each point is the mean over several trials, with its standard error. Both curves start "
        "from the same samples.",
    )


def _paint_learning(curve: Learning, figure: Figure) -> None:
    axes = figure.subplots(1, 2)
    for ax, title, row in zip(axes, ("global", "root-relative"), (0, 1), strict=True):
        for (way, own), colour in zip(
            curve.errors.items(), (svg_chart.ORANGE, svg_chart.BLUE), strict=True
        ):
            off = 100 * curve.standard_errors[way][row]
            ax.errorbar(curve.sizes, 100 * own[row], off, fmt="o-", color=colour, label=way)
        ax.set(xlabel="samples", ylabel="error (cm)", title=f"{title} error", ylim=(0, None))
    axes[0].legend()


def event_charts(result: EvaluationResult) -> list[Chart]:
    """Return the clip of median error at its event, by several methods; empty without events."""
    titles = PANELS.get(result.protocol, {})
    place = event_bodies.median_clip(result.bodies, tuple(titles)) if titles else None
    if place is None:
        return []
    clip = result.clips[place]
    scene = _event_scene(result.bodies, titles, place, result.parents)
    drawn = svg_chart.draw(
        3.6,
        scene.paint,
        f"Stick figures of {clip} at its event: {', '.join(scene.bodies)}.",
        f"{clip} at its event; its effector error is the median over all clips. Orange: the "
        "answer of each method, over the captured body in grey. Dotted line: path of the event's "
        "joint. Cross: its captured position.",
    )
    return [drawn]


@dataclass(frozen=True)
class _EventScene:
    """Bodies of one clip at its event.

    bodies: by panel title, the captured one first. parents: of the joints.
    """

    bodies: dict[str, EventBody]
    parents: tuple[int, ...]

    def paint(self, figure: Figure) -> None:
        """Draw a panel for each body, from the side that shows most of the effector's path."""
        captured = self.bodies[CAPTURED]
        away = captured.path - captured.path.mean(axis=0)
        direction = stick_figures.widest_direction(away)
        panels = figure.subplots(1, len(self.bodies), sharex=True, sharey=True, squeeze=False)[0]
        for ax, (title, own) in zip(panels, self.bodies.items(), strict=True):
            if own is not captured:
                self._body(ax, captured, direction, svg_chart.FAINT)
                error = 100.0 * float(np.linalg.norm(own.event - captured.event))
                title = f"{title}: error {error:.1f} cm"
            self._body(ax, own, direction, svg_chart.INK if own is captured else svg_chart.ORANGE)
            at = stick_figures.project(captured.event[None], direction)
            ax.plot(*at.T, "+", color=svg_chart.INK, markersize=14)
            ax.set(title=title, aspect="equal")
            ax.grid(visible=False)
            ax.tick_params(length=0, labelbottom=False, labelleft=False)
            ax.spines[:].set_visible(False)

    def _body(self, ax: Axes, own: EventBody, direction: Floats, colour: str) -> None:
        joints = stick_figures.project(own.joints, direction)
        bones = [(joints[j], joints[p]) for j, p in enumerate(self.parents) if p >= 0]
        ax.add_collection(LineCollection(bones, colors=colour, linewidths=1.6))
        path = stick_figures.project(own.path, direction)
        ax.plot(*path.T, color=colour, linewidth=0.9, linestyle=":")
        low, high = joints.min(axis=0) - MARGIN, joints.max(axis=0) + MARGIN
        ax.update_datalim([low, high])
        ax.autoscale_view()


def _event_scene(
    found: EventBodies, titles: Mapping[str, str], place: int, parents: tuple[int, ...]
) -> _EventScene:
    bodies = {CAPTURED: found[CAPTURED][place]}
    bodies |= {title: found[name][place] for name, title in titles.items()}
    return _EventScene({title: own for title, own in bodies.items() if own}, parents)
