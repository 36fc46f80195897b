"""Comparisons in which every method knows the performer, or none does.

A method with the performer's name has an advantage over one without it, so they are compared in
two tables. The table with performers also has peers that ignore the performer. Standard errors are
over takes, because clips of one take resemble each other.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield.common.units import Floats, Indices
from posefield_train.evaluate.methods import NO_PERFORMER, OURS
from posefield_train.evaluate.motion_errors import MotionErrors
from posefield_train.evaluate.peers.predicted_values import OPEN
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.report.drawing import markdown_table, significant_digits

KNOWN, LEFT_OPEN = "known", "open"
TITLES = {
    KNOWN: "every method knows the performer",
    LEFT_OPEN: "no method knows the performer",
}
"""Title of each table by its name in the JSON."""
BETTER, WITHIN, WORSE = "better", "within one standard error", "worse"
HEAD = ("measure", "posefield", "best peer", "its error", "difference", "±", "verdict")


@dataclass(frozen=True)
class Measure:
    """A measure of errors. key: name in the JSON. title: in tables. unit: of `scale` times it.

    squared: whether means are root mean squares. curve: index of the curve that it is of. decimals:
    in tables.
    """

    key: str
    title: str
    unit: str
    scale: float
    squared: bool = False
    curve: int | None = None
    decimals: int = 2

    def of(self, error: MotionErrors) -> float:
        """Return the error of one clip; its square where means are root mean squares."""
        if self.curve is not None:
            return float(error.curves[self.curve])
        if self.key == CURVES:
            return float(np.mean(error.counted))
        if self.key == "effector":
            return error.effector
        if self.key == "duration":
            return error.duration**2
        distance = error.relative if self.key == "relative" else error.absolute
        return distance.mean

    def mean(self, values: Floats) -> float:
        """Return the mean over clips, in the unit."""
        average = float(np.mean(values))
        return self.scale * (np.sqrt(average) if self.squared else average)


POSITIONS = (
    Measure("relative", "relative (cm)", "cm", 100.0),
    Measure("global", "global (cm)", "cm", 100.0),
    Measure("effector", "effector (cm)", "cm", 100.0),
)
DURATION = Measure("duration", "duration (%)", "%", 100.0, squared=True)
CURVES = "curves"
"""Key of the error of all curves, as the distance that they count as."""


def measures(result: EvaluationResult) -> tuple[Measure, ...]:
    """Return the measures of a result: of positions if it has some, durations, and each curve."""
    found = (*(POSITIONS if result.has_positions else ()), DURATION)
    if not result.curves:
        return found
    each = (
        Measure(f"curve {name}", name, "", 1.0, squared=True, curve=index, decimals=4)
        for index, name in enumerate(result.curves)
    )
    return (*found, Measure(CURVES, "curves (cm)", "cm", 100.0, squared=True, decimals=3), *each)


@dataclass(frozen=True)
class PairedDifference:
    """Error of a method less that of posefield, clip by clip.

    ours, theirs: means in the measure's unit. difference: of the means. standard_error: of it, over
    takes. verdict: of posefield.
    """

    name: str
    ours: float
    theirs: float
    difference: float
    standard_error: float
    verdict: str

    def facts(self) -> dict[str, Any]:
        """Return the figures as JSON values."""
        return {
            "posefield": significant_digits.round_number(self.ours),
            "peer": self.name,
            "error": significant_digits.round_number(self.theirs),
            "difference": significant_digits.round_number(self.difference),
            "standard_error": significant_digits.round_number(self.standard_error),
            "verdict": self.verdict,
        }


def clustered_standard_error(values: Floats, takes: Indices) -> float:
    """Return the standard error of the mean of values (C,) that agree within takes (C,).

    Sums of residuals over takes take the place of residuals (Liang & Zeger 1986); with one clip per
    take it is the usual standard error. Zero for a single take.
    """
    groups = np.unique(takes, return_inverse=True)[1]
    count = int(groups.max()) + 1
    if count < 2:
        return 0.0
    sums = np.bincount(groups, weights=values - values.mean(), minlength=count)
    return float(np.sqrt(count / (count - 1) * np.sum(np.square(sums))) / len(values))


def compare(
    result: EvaluationResult, measure: Measure, ours: str, name: str
) -> PairedDifference | None:
    """Return the difference of a method from posefield's row `ours` on the clips of both.

    None where the measure is undefined.
    """
    places = sorted(set(result.asked(ours)) & set(result.asked(name)))
    own, other = (
        np.array([measure.of(error) for error in result.of(one, places)]) for one in (ours, name)
    )
    if not places or np.isnan(own).any() or np.isnan(other).any():
        return None
    apart = other - own
    error = clustered_standard_error(apart, np.array(result.takes)[places])
    mean = float(apart.mean())
    verdict = BETTER if mean > error else WORSE if mean < -error else WITHIN
    means = measure.mean(own), measure.mean(other)
    # The difference of squares, told as that of their roots.
    slope = sum(means) / measure.scale**2 if measure.squared else 1.0 / measure.scale
    error = error / slope if slope > 0.0 else 0.0
    return PairedDifference(name, *means, means[1] - means[0], error, verdict)


def rivals(result: EvaluationResult, information: str) -> tuple[str, list[str]]:
    """Return posefield's row and the peers of a table; no peers where the table does not exist."""
    peers = [name for name in result.errors if not name.startswith(OURS)]
    told = any(name.endswith(OPEN) for name in peers)
    if information == LEFT_OPEN:
        alone = [name for name in peers if name.endswith(OPEN)]
        return (NO_PERFORMER if NO_PERFORMER in result.errors else OURS), alone if told else peers
    return OURS, peers if told and NO_PERFORMER in result.errors else []


def posefield_row(result: EvaluationResult, name: str) -> str:
    """Return posefield's row with the same information as a method."""
    is_open = name.endswith(OPEN) and NO_PERFORMER in result.errors
    return NO_PERFORMER if is_open else OURS


def best_peers(result: EvaluationResult, information: str) -> dict[str, PairedDifference]:
    """Return the difference from the best single peer of each measure, by its key."""
    ours, peers = rivals(result, information)
    found = {}
    for measure in measures(result):
        all_of_them = [compare(result, measure, ours, name) for name in peers]
        defined = [one for one in all_of_them if one]
        if defined:
            found[measure.key] = min(defined, key=lambda one: one.theirs)
    return found


def facts(result: EvaluationResult) -> dict[str, Any]:
    """Return the figures of each table: best peers, and the differences from every peer."""
    found = {}
    for information in TITLES:
        ours, peers = rivals(result, information)
        if peers:
            found[information] = {
                "posefield": ours,
                "takes": len(set(result.takes)),
                "best": {key: one.facts() for key, one in best_peers(result, information).items()},
                "peers": {
                    name: {
                        measure.key: found_one.facts()
                        for measure in measures(result)
                        if (found_one := compare(result, measure, ours, name))
                    }
                    for name in peers
                },
            }
    return found


def table(result: EvaluationResult) -> str:
    """Return a table in Markdown for each kind of information, under its title."""
    parts = []
    for information, title in TITLES.items():
        if rows := best_rows(result, information):
            shown = markdown_table.markdown_table(HEAD, rows)
            parts.append(
                f"Equal information, {title}: posefield and the best single peer\n\n{shown}"
            )
    return "\n\n".join(parts)


def best_rows(result: EvaluationResult, information: str) -> Sequence[tuple[str, ...]]:
    """Return the rows of a table under HEAD."""
    known = {measure.key: measure for measure in measures(result)}
    return [_row(known[key], one) for key, one in best_peers(result, information).items()]


def _row(measure: Measure, one: PairedDifference) -> tuple[str, ...]:
    digits = measure.decimals
    return (
        measure.title,
        f"{one.ours:.{digits}f}",
        one.name,
        f"{one.theirs:.{digits}f}",
        f"{one.difference:+.{digits}f}",
        f"{one.standard_error:.{digits}f}",
        one.verdict,
    )
