"""HTML page of an evaluation."""

from collections.abc import Sequence

import numpy as np

from posefield_train.evaluate import corrections, equal_information
from posefield_train.evaluate.footing import feet_summary
from posefield_train.evaluate.learning_curves import Learning
from posefield_train.evaluate.methods import OURS, TOLD, definition
from posefield_train.evaluate.pages import evaluation_charts
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.evaluate.summary import evaluation_summary, method_summary
from posefield_train.evaluate.summary.method_summary import NOT_APPLICABLE, MethodSummary
from posefield_train.evaluate.variation import take_summary
from posefield_train.report.drawing.html_page import Page, Section, Table

TITLES = {
    "leave_one_clip_out": "Each clip predicted from the other clips",
    "leave_one_performer_out": "Each performer predicted from the other performers",
    "truth": "Comparison with the noise-free truth",
}

EQUAL = (
    "Posefield is compared with the best single peer of each measure with equal information. "
    "Differences are the peer's error less that of posefield, clip by clip; ± is their standard "
    "error over takes. Posefield is better or worse by more than that, or within it."
)


def html(
    description: str, results: Sequence[EvaluationResult], curve: Learning | None = None
) -> bytes:
    """Return the page of a recipe's results and learning curve; equal results, equal bytes."""
    first = evaluation_summary.summarize(results[0])[0]
    figures = [
        *_distance_figures(first),
        ("error of the duration", f"{100 * first.mean.duration:.1f} %"),
        ("sigma ratio (1 is ideal)", f"{evaluation_summary.sigma_ratio(results[0]):.2f}"),
    ]
    sections = [part for result in results for part in (_section(result), _distances(result))]
    sections += [] if curve is None else [_learning(curve)]
    sections += [_legend(results)]
    return Page("evaluation", results[0].family, description, figures, sections).html()


def _distance_figures(first: MethodSummary) -> list[tuple[str, str]]:
    """Return the errors of posefield that the page begins with."""
    found = {
        "root-relative error": first.mean.relative.mean,
        "global error": first.mean.absolute.mean,
    }
    shown = [
        (title, f"{100 * metres:.2f} cm" if first.has_positions else NOT_APPLICABLE)
        for title, metres in found.items()
    ]
    if first.curves:
        shown.append(("error of the curves", f"{100 * first.curve_distance:.3f} cm"))
    return shown


def _section(result: EvaluationResult) -> Section:
    found = evaluation_summary.summarize(result)
    caption = "Mean error of each method (cm; columns are explained under Methods and columns)"
    head = tuple(title for title, _ in method_summary.columns(result))
    rival = min(_other_methods(found), key=lambda one: one.worse).name
    return Section(
        result.protocol,
        TITLES[result.protocol],
        (
            *method_summary.units(result),
            EQUAL,
            *map(_sentence, evaluation_summary.trust_text(result)),
        ),
        (
            *_equal_information(result),
            Table(caption, head, tuple(one.cells() for one in found)),
            *_curves(result, found),
            *_corrections(result),
            *_feet(result),
            *_takes(result),
        ),
        (
            evaluation_charts.method_bars(found),
            evaluation_charts.clips(result, rival),
            evaluation_charts.calibration(result),
            *evaluation_charts.event_charts(result),
        ),
    )


def _curves(result: EvaluationResult, found: Sequence[MethodSummary]) -> list[Table]:
    """Return the table of the error of each curve by method; none without curves."""
    rows = [(one.name, *(f"{error:.4f}" for error in np.sqrt(one.mean.curves))) for one in found]
    caption = "Root mean square error of each curve, in its own unit"
    return [Table(caption, ("method", *result.curves), tuple(rows))] if result.curves else []


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _corrections(result: EvaluationResult) -> list[Table]:
    rows = corrections.rows(result)
    caption = "Answers corrected to the captured position of the effector"
    return [Table(caption, corrections.TABLE_HEADER, rows)] if rows else []


def _feet(result: EvaluationResult) -> list[Table]:
    rows = feet_summary.rows(result.feet)
    caption = "Feet of the service's clips: as predicted, and standing"
    return [Table(caption, feet_summary.HEADER, rows)] if rows else []


def _takes(result: EvaluationResult) -> list[Table]:
    rows = take_summary.rows(result.variation)
    caption = "Takes: random fields against the model's, and motions against captured ones"
    return [Table(caption, take_summary.HEADER, rows)] if rows else []


def _other_methods(found: Sequence[MethodSummary]) -> list[MethodSummary]:
    """Return the methods other than the variants of posefield."""
    return [one for one in found if not one.name.startswith(OURS)]


def _equal_information(result: EvaluationResult) -> list[Table]:
    """Return the tables of posefield and the best single peers with equal information."""
    return [
        Table(f"Posefield and the best single peer: {title}", equal_information.HEAD, tuple(rows))
        for information, title in equal_information.TITLES.items()
        if (rows := equal_information.best_rows(result, information))
    ]


def _distances(result: EvaluationResult) -> Section:
    """Return the statistics of every distance of every method."""
    heading = ("method", "distance", "mean", "RMS", "p95", "p99", "largest")
    rows = [
        (
            one.name,
            title,
            *(
                f"{100 * value:.2f}" if one.has_positions else NOT_APPLICABLE
                for value in vars(spread).values()
            ),
        )
        for one in evaluation_summary.summarize(result)
        for name, title in method_summary.DISTANCES.items()
        for spread in (getattr(one.mean, name),)
    ]
    paragraphs = (
        "Centimetres over joints and frames. p95 and p99 are percentiles within a clip, averaged "
        "over clips. Global distances include the root's position; relative ones do not. Unwarped "
        "distances are taken at equal shares of the duration, the others after time warping. The "
        "shell distance is the largest of three points 3 cm from each joint, without the root's "
        "position.",
    )
    title = f"All distances: {result.protocol.replace('_', ' ')}"
    table = Table("Distances by method (cm)", heading, tuple(rows))
    return Section(f"{result.protocol}-distances", title, paragraphs, (table,))


def _learning(curve: Learning) -> Section:
    paragraphs = (
        f"Samples were added from {curve.sizes[0]} to {curve.sizes[-1]}: those that `posefield "
        f"suggest` ranks first, or random ones. {curve.text()}",
    )
    title = "Suggested captures against random ones"
    return Section("learning", title, paragraphs, (), (evaluation_charts.learning(curve),))


def _legend(results: Sequence[EvaluationResult]) -> Section:
    names = dict.fromkeys(name for result in results for name in result.errors)
    columns = dict.fromkeys(one for own in results for one in method_summary.columns(own)[1:])
    methods = tuple((name, definition(name)) for name in names)
    paragraphs = (
        "All methods get the same aligned clips, and predict motion, bone lengths and timing.",
        TOLD,
    )
    tables = (
        Table("Methods", ("method", "definition"), methods),
        Table("Columns", ("column", "meaning"), tuple(columns)),
    )
    return Section("methods", "Methods and columns", paragraphs, tables)
