"""An evaluation as a page to look at: tables and pictures in one HTML file."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from model_export.evaluate import reach, shown, stills, summary
from model_export.evaluate.learning import Learning
from model_export.evaluate.methods import DEFINITIONS, EXACT, OURS
from model_export.evaluate.newcomers import SHOWN
from model_export.evaluate.protocol import Result
from model_export.evaluate.summary import Summary
from model_export.report import page, picture
from model_export.report.page import Section, Table
from model_export.report.picture import Picture

WORST = 8
TITLES = {
    "leave_one_clip_out": "Every clip predicted from the others",
    "leave_one_performer_out": "Every performer predicted from the others",
    "truth": "Against the truth at unseen control points",
}


def html(description: str, results: Sequence[Result], curve: Learning | None = None) -> bytes:
    """Page of a recipe's results, and of a learning curve; the same results give the same bytes."""
    sections = [part for result in results for part in (_section(result), _spread(result))]
    first = summary.of(results[0])[0]
    figures = [
        ("root-relative, ours", f"{100 * first.mean.relative.mean:.2f} cm"),
        ("global, ours", f"{100 * first.mean.absolute.mean:.2f} cm"),
        ("duration error", f"{100 * first.mean.duration:.1f} %"),
        ("sigma ratio (1 is right)", f"{summary.sigma_ratio(results[0]):.2f}"),
    ]
    learnt = [] if curve is None else [_learning(curve)]
    body = [*sections, *learnt, _methods(results)]
    return page.html("evaluation", results[0].family, description, figures, body).encode()


def _section(result: Result) -> Section:
    found = summary.of(result)
    return Section(
        result.protocol,
        TITLES[result.protocol],
        (summary.LEGEND, _verdict(found), *summary.trust_said(result)),
        (Table(summary.HEAD, tuple(one.cells() for one in found)), *_held(result)),
        (_bars(result, found), _clips(result, found), _calibration(result), *_stills(result)),
    )


def _clips_shown(count: int) -> str:
    return f"{count} clip{'s' * (count > 1)} shown"


PANELS: dict[str, dict[str, str]] = {
    "leave_one_clip_out": {OURS: "predicted", EXACT: "held to the target"},
    "leave_one_performer_out": {
        OURS: "nothing shown",
        **{
            name: _clips_shown(count)
            for name, count in SHOWN.items()
            if count < max(SHOWN.values())
        },
    },
}
"""What is drawn of a clip, and what is said of it."""


def _stills(result: Result) -> list[Picture]:
    """The reach of a clip in the middle of all, at its event."""
    words = PANELS.get(result.protocol, {})
    place = stills.chosen(result.stills, tuple(words)) if words else None
    if place is None:
        return []
    clip = result.clips[place]
    own = shown.scene(result.stills, words, clip, place, result.parents)
    caption = (
        f"{clip} at its event, in orange over the captured body; dotted, the way of the joint that "
        "counts there, and a cross where it was captured. Half of all clips are met nearer by the "
        "first of the answers."
    )
    return [shown.drawn(f"{result.protocol}-reach", own, caption)]


def _held(result: Result) -> list[Table]:
    rows = reach.rows(result)
    return [Table(reach.HEAD, rows)] if rows else []


def _verdict(found: Sequence[Summary]) -> str:
    """Who is ahead, and by how much beyond chance, in words."""
    others = _rivals(found)
    ahead = [one.name for one in others if one.worse < -one.worse_error]
    tied = [one.name for one in others if abs(one.worse) <= one.worse_error]
    if ahead:
        return f"Ahead of ours by more than one standard error: {', '.join(ahead)}."
    if tied:
        return f"No method is ahead by more than one standard error; within it: {', '.join(tied)}."
    return "Ours is ahead of every other method by more than one standard error."


def _bars(result: Result, found: Sequence[Summary]) -> Picture:
    return picture.draw(
        f"{result.protocol}-bars",
        0.9 + 0.27 * len(found),
        partial(_paint_bars, found),
        f"Root-relative, global and effector errors of {len(found)} methods.",
        "Mean distance by method, ours in orange, cut at two and a half times ours; the lines are "
        "standard errors over clips.",
    )


def _paint_bars(found: Sequence[Summary], figure: Figure) -> None:
    names = [one.name.replace("_", " ") for one in found]
    colours = [picture.ORANGE if one.name.startswith(OURS) else picture.BLUE for one in found]
    columns = {
        "root-relative": [one.mean.relative.mean for one in found],
        "global": [one.mean.absolute.mean for one in found],
        "effector": [one.mean.effector for one in found],
    }
    axes = figure.subplots(1, 3, sharey=True)
    for ax, (title, values) in zip(axes, columns.items(), strict=True):
        spread = [100 * one.standard_error for one in found] if title == "root-relative" else None
        ax.barh(names, 100 * np.nan_to_num(values), color=colours, xerr=spread)
        # Few methods go astray; what is near is worth telling apart.
        ax.set(title=title, xlabel="cm", xlim=(0, 250 * float(np.nan_to_num(values[0])) or 1.0))
        ax.grid(visible=False, axis="y")
    axes[0].invert_yaxis()


def _rivals(found: Sequence[Summary]) -> list[Summary]:
    """Other methods than ours, however it is asked."""
    return [one for one in found if not one.name.startswith(OURS)]


def _rival(found: Sequence[Summary]) -> str:
    return min(_rivals(found), key=lambda one: one.worse).name


def _clips(result: Result, found: Sequence[Summary]) -> Picture:
    rival = _rival(found)
    return picture.draw(
        f"{result.protocol}-clips",
        3.6,
        partial(_paint_clips, result, rival),
        f"Error of each clip, ours against {rival}.",
        f"Each point is a motion: below the line ours is nearer than {rival}, the best of the "
        "other methods.",
    )


def _paint_clips(result: Result, rival: str, figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    ours = 100 * summary.relative(result.of(OURS, result.asked(OURS)))
    theirs = 100 * summary.relative(result.of(rival, result.asked(rival)))
    left.plot(theirs, ours, ".", color=picture.BLUE, rasterized=len(ours) > WORST**3)
    far = 1.05 * max(ours.max(), theirs.max())
    left.plot([0, far], [0, far], color=picture.GREY, linewidth=0.8)
    left.set(xlabel=f"{rival} (cm)", ylabel="ours (cm)", title="root-relative", aspect="equal")
    worst = np.argsort(-ours)[:WORST]
    right.barh([result.clips[i] for i in worst], ours[worst], color=picture.ORANGE)
    right.invert_yaxis()
    right.set(xlabel="cm", title="ours at its worst")
    right.grid(visible=False, axis="y")


def _calibration(result: Result) -> Picture:
    return picture.draw(
        f"{result.protocol}-sigma",
        3.2,
        partial(_paint_calibration, result),
        "Actual distance against the predicted standard deviation.",
        "Root-mean-square global distance of each motion against sigma: about the line where the "
        "error bar is honest.",
    )


def _paint_calibration(result: Result, figure: Figure) -> None:
    ax = figure.subplots()
    actual = 100 * np.sqrt([error.squared for error in result.of(OURS, result.asked(OURS))])
    sigma = 100 * result.sigma
    ax.plot(sigma, actual, ".", color=picture.BLUE, rasterized=len(actual) > WORST**3)
    far = 1.1 * float(sigma.max())
    ax.plot([0, far], [0, far], color=picture.GREY, linewidth=0.8)
    ax.set(xlabel="sigma (cm)", ylabel="actual (cm)", title="sigma", xlim=(0, far))


def _spread(result: Result) -> Section:
    """Every distance of every method: mean, root mean square, percentiles, largest."""
    heading = ("method", "distance", "mean", "rms", "p95", "p99", "largest")
    rows = [
        (one.name, name.replace("_", " "), *(f"{100 * v:.2f}" for v in vars(spread).values()))
        for one in summary.of(result)
        for name in summary.DISTANCES
        for spread in (getattr(one.mean, name),)
    ]
    words = (
        "Centimetres over joints and frames; percentiles are of a clip, averaged over clips. "
        "absolute is global; shell is the farthest of three points 3 cm around each joint, "
        "root-relative.",
    )
    title = f"Distances in full: {result.protocol.replace('_', ' ')}"
    return Section(f"{result.protocol}-distances", title, words, (Table(heading, tuple(rows)),))


def _learning(curve: Learning) -> Section:
    drawn = picture.draw(
        "learning",
        3.2,
        partial(_paint_learning, curve),
        "Distance to the truth against the number of samples, suggested and at random.",
        "Each point is the mean of models trained anew in several trials, and its standard error; "
        "both ways begin with the same samples.",
    )
    words = (
        f"From {curve.sizes[0]} samples to {curve.sizes[-1]}, added as `posefield suggest` ranks "
        f"them and as chance has it: suggested ones are at {curve.reached:.0f} where random ones "
        f"are at {curve.sizes[-1]}, {curve.faster:.1f} times as fast.",
    )
    return Section("learning", "What suggested clips are worth", words, (), (drawn,))


def _paint_learning(curve: Learning, figure: Figure) -> None:
    axes = figure.subplots(1, 2)
    for ax, title, row in zip(axes, ("global", "root-relative"), (0, 1), strict=True):
        for (way, own), colour in zip(
            curve.errors.items(), (picture.ORANGE, picture.BLUE), strict=True
        ):
            off = 100 * curve.doubts[way][row]
            ax.errorbar(curve.sizes, 100 * own[row], off, fmt="o-", color=colour, label=way)
        ax.set(xlabel="samples", ylabel="cm", title=title, ylim=(0, None))
    axes[0].legend()


def _methods(results: Sequence[Result]) -> Section:
    names = dict.fromkeys(name for result in results for name in result.errors)
    rows = tuple((name, DEFINITIONS[name]) for name in names)
    words = ("All methods get the same aligned clips; each predicts motion, bones, timing.",)
    return Section("methods", "What each method is", words, (Table(("method", "what"), rows),))
