"""How holding the model's answers to captured events went: as JSON and as a table."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from model_export.evaluate import columns
from model_export.evaluate.errors import Errors
from model_export.evaluate.exact import BEYOND, Correction, Far
from model_export.evaluate.methods import EXACT, OURS
from model_export.evaluate.protocol import Result
from model_export.report import plain
from service.motion.conventions import Floats

HEAD = ("held to the captured event", "mean", "worst")


@dataclass(frozen=True)
class Figure:
    """One number of every clip (C,): what it is, how it is written, whether its worst says more
    than its mean."""

    key: str
    words: str
    values: Floats
    shown: str = "{:.2f}"
    worst: bool = True

    def cells(self) -> tuple[str, ...]:
        """Its row of the table."""
        worst = self.shown.format(self.values.max()) if self.worst else ""
        return self.words, self.shown.format(self.values.mean()), worst

    def facts(self) -> dict[str, float]:
        """The same by name."""
        own = {self.key: plain.number(float(self.values.mean()))}
        worst = {f"{self.key}_worst": plain.number(float(self.values.max()))}
        return {**own, **worst} if self.worst else own


def figures(result: Result) -> list[Figure]:
    """All figures of a result; none where nothing was held to anything."""
    found = result.corrections
    if not found:
        return []

    def of(value: Callable[[Correction], float]) -> Floats:
        return np.array([float(value(correction)) for correction in found])

    return [
        Figure("effector_cm", "effector, cm", 100.0 * _effector(result), "{:.4f}"),
        Figure("steps", "steps", of(lambda c: c.steps), "{:.1f}"),
        Figure("acceleration", "acceleration, after over before", of(lambda c: c.acceleration)),
        *_changes(result),
        _time("ms", "a clip, median, ms", of(lambda c: c.seconds)),
        _time("plain_ms", "the same uncorrected, ms", of(lambda c: c.plain_seconds)),
        Figure("distance", "distance, standard deviations", of(lambda c: c.distance)),
        Figure("out_of_reach", "told to be out of reach", of(lambda c: not c.reached), **SHARE),
        *_beyond(found),
        *_far([correction.far for correction in found if correction.far]),
    ]


SHARE: dict[str, Any] = {"shown": "{:.1%}", "worst": False}


def _time(key: str, words: str, seconds: Floats) -> Figure:
    # A median: some clips come when the machine has woken up.
    return Figure(key, words, 1e3 * np.full(1, np.median(seconds)), worst=False)


def _effector(result: Result) -> Floats:
    return np.array([error.effector for error in result.of(EXACT, result.asked(EXACT))])


def _changes(result: Result) -> Iterator[Figure]:
    """Of the mean distances, as shares of those of the answers before."""

    def means(name: str, distance: str) -> Floats:
        return np.array([_mean(error, distance) for error in result.of(name, result.asked(name))])

    for distance, word in (("relative", "relative"), ("absolute", "global")):
        before, after = means(OURS, distance), means(EXACT, distance)
        change = np.full(1, after.mean() / before.mean() - 1.0)
        words = f"{word}, change of the mean"
        yield Figure(f"{word}_change", words, change, "{:+.1%}", worst=False)


def _mean(error: Errors, distance: str) -> float:
    return float(getattr(error, distance).mean)


def _beyond(found: tuple[Correction, ...]) -> Iterator[Figure]:
    for place, metres in enumerate(BEYOND[: len(found[0].beyond)]):
        told = np.array([float(not correction.beyond[place]) for correction in found])
        centimetres = round(100 * metres)
        key, words = f"out_of_reach_{centimetres}cm", f"the same {centimetres} cm beyond"
        yield Figure(key, words, told, **SHARE)


def _far(found: list[Far]) -> list[Figure]:
    if not found:
        return []
    told, acceleration, root, steps = np.array(
        [(not far.reached, far.acceleration, far.root, far.steps) for far in found], np.float64
    ).T
    return [
        Figure("far_out_of_reach", "the same a metre beyond", told, **SHARE),
        Figure("far_acceleration", "there: acceleration", acceleration),
        Figure("far_root_cm", "there: root moved, cm", 100.0 * root),
        Figure("far_steps", "there: steps", steps, "{:.1f}"),
    ]


def facts(result: Result) -> dict[str, Any]:
    """Figures by name: centimetres, milliseconds, plain shares."""
    return {key: value for own in figures(result) for key, value in own.facts().items()}


def rows(result: Result) -> tuple[tuple[str, ...], ...]:
    """Rows of a table, to stand under HEAD."""
    return tuple(own.cells() for own in figures(result))


def table(result: Result) -> str:
    """The same in Markdown; empty where nothing was held to anything."""
    found = rows(result)
    return columns.even(HEAD, found) if found else ""
