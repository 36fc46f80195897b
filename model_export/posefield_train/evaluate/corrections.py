"""Results of correcting answers to the captured event: as JSON and as a table."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield.common.units import Floats
from posefield_train.evaluate.corrected_answers import BEYOND_DISTANCES, Correction, Far
from posefield_train.evaluate.methods import EXACT, OURS
from posefield_train.evaluate.motion_errors import MotionErrors
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.report.drawing import markdown_table, significant_digits

TABLE_HEADER = ("correction to the captured event", "mean", "worst")


@dataclass(frozen=True)
class CorrectionStatistic:
    """One figure of every clip.

    key: name in the JSON. words: title of its row. values: (C,). shown: format of its cells. worst:
    True if the largest value is reported beside the mean.
    """

    key: str
    words: str
    values: Floats
    shown: str = "{:.2f}"
    worst: bool = True

    def cells(self) -> tuple[str, ...]:
        """Return the row of the table."""
        worst = self.shown.format(self.values.max()) if self.worst else ""
        return self.words, self.shown.format(self.values.mean()), worst

    def facts(self) -> dict[str, float]:
        """Return mean and worst by name."""
        own = {self.key: significant_digits.round_number(float(self.values.mean()))}
        worst = {f"{self.key}_worst": significant_digits.round_number(float(self.values.max()))}
        return {**own, **worst} if self.worst else own


def correction_statistics(result: EvaluationResult) -> list[CorrectionStatistic]:
    """Return all figures of a result; none if no answer was corrected."""
    found = result.corrections
    if not found:
        return []

    def of(value: Callable[[Correction], float]) -> Floats:
        return np.array([float(value(correction)) for correction in found])

    return [
        CorrectionStatistic(
            "effector_cm",
            "remaining distance of the effector (cm)",
            100.0 * _effector_errors(result),
            "{:.4f}",
        ),
        CorrectionStatistic("steps", "solver steps", of(lambda c: c.steps), "{:.1f}"),
        CorrectionStatistic(
            "acceleration", "acceleration, after over before", of(lambda c: c.acceleration)
        ),
        *_distance_changes(result),
        _time_statistic("ms", "time per clip, median (ms)", of(lambda c: c.seconds)),
        _time_statistic(
            "plain_ms",
            "time per clip without correction, median (ms)",
            of(lambda c: c.plain_seconds),
        ),
        CorrectionStatistic(
            "distance",
            "distance of the target from the prediction (sigma)",
            of(lambda c: c.distance),
        ),
        CorrectionStatistic(
            "out_of_reach", UNREACHABLE, of(lambda c: not c.reached), **SHARE_FORMAT
        ),
        *_beyond_statistics(found),
        *_far_statistics([correction.far for correction in found if correction.far]),
    ]


SHARE_FORMAT: dict[str, Any] = {"shown": "{:.1%}", "worst": False}
UNREACHABLE = "reported as unreachable"


def _time_statistic(key: str, words: str, seconds: Floats) -> CorrectionStatistic:
    # A median, because single clips are delayed by other work of the machine.
    return CorrectionStatistic(key, words, 1e3 * np.full(1, np.median(seconds)), worst=False)


def _effector_errors(result: EvaluationResult) -> Floats:
    return np.array([error.effector for error in result.of(EXACT, result.asked(EXACT))])


def _distance_changes(result: EvaluationResult) -> Iterator[CorrectionStatistic]:
    """Return the changes of the mean distances, as shares of those without correction."""

    def means(name: str, distance: str) -> Floats:
        return np.array([_mean(error, distance) for error in result.of(name, result.asked(name))])

    for distance, word in (("relative", "relative"), ("absolute", "global")):
        before, after = means(OURS, distance), means(EXACT, distance)
        change = np.full(1, after.mean() / before.mean() - 1.0)
        words = f"change of the mean {word} error"
        yield CorrectionStatistic(f"{word}_change", words, change, "{:+.1%}", worst=False)


def _mean(error: MotionErrors, distance: str) -> float:
    return float(getattr(error, distance).mean)


def _beyond_statistics(found: tuple[Correction, ...]) -> Iterator[CorrectionStatistic]:
    for place, metres in enumerate(BEYOND_DISTANCES[: len(found[0].beyond)]):
        told = np.array([float(not correction.beyond[place]) for correction in found])
        centimetres = round(100 * metres)
        key, words = (
            f"out_of_reach_{centimetres}cm",
            f"{UNREACHABLE}, target {centimetres} cm farther",
        )
        yield CorrectionStatistic(key, words, told, **SHARE_FORMAT)


def _far_statistics(found: list[Far]) -> list[CorrectionStatistic]:
    if not found:
        return []
    told, acceleration, root, steps = np.array(
        [(not far.reached, far.acceleration, far.root, far.steps) for far in found], np.float64
    ).T
    return [
        CorrectionStatistic(
            "far_out_of_reach", f"{UNREACHABLE}, target 1 m farther", told, **SHARE_FORMAT
        ),
        CorrectionStatistic("far_acceleration", "acceleration, target 1 m farther", acceleration),
        CorrectionStatistic(
            "far_root_cm", "movement of the root, target 1 m farther (cm)", 100.0 * root
        ),
        CorrectionStatistic("far_steps", "solver steps, target 1 m farther", steps, "{:.1f}"),
    ]


def facts(result: EvaluationResult) -> dict[str, Any]:
    """Return the figures by name: centimetres, milliseconds, shares."""
    return {
        key: value for own in correction_statistics(result) for key, value in own.facts().items()
    }


def rows(result: EvaluationResult) -> tuple[tuple[str, ...], ...]:
    """Return the rows of the table under HEAD."""
    return tuple(own.cells() for own in correction_statistics(result))


def table(result: EvaluationResult) -> str:
    """Return the table in Markdown; empty if no answer was corrected."""
    found = rows(result)
    return markdown_table.markdown_table(TABLE_HEADER, found) if found else ""
