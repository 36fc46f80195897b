"""Levels of detail: error, size and time of each, beside alternative levels.

Times depend on the machine. They are measured before the model is reported and are not stored in
the model file.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from posefield.inference import level_selection, session
from posefield.inference.level_selection import Camera
from posefield.inference.session import Session
from posefield.model_file import model_card
from posefield.model_file.model_card import Level, ModelCard
from posefield_train.graph import levels
from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report.drawing import svg_chart
from posefield_train.report.drawing.html_page import Chapter, Section, Table
from posefield_train.source.recipe import Recipe

# Common resolution and field of view of games: 1080 lines, 60 degrees vertically.
CAMERA = Camera(np.zeros(3), math.radians(60.0), 1080.0)
# Measurements of one level differ by a few per cent, as some levels do, so take the median of many.
TIMING_ROUNDS = 51
# Alternative levels are built for 1 to FARTHEST times the error limits of the finest level.
TIMED_POINTS, FARTHEST = 7, 16.0

_EXPLANATION = (
    "Errors are distances of joints from the model before truncation, over random controls, "
    "performers and times; they include the effect of clips that a level leaves out. A pixel is "
    f"one of an image of {CAMERA.height:.0f} lines with a vertical field of view of "
    f"{math.degrees(CAMERA.fov):.0f} degrees. Times are for one pose in batches of "
    f"{level_selection.ROWS_PER_CALL}, measured on one thread of the machine that trained, with "
    "the service's own code. A coarser level is never listed as slower than a finer one. Times are "
    "not stored in the model file."
)


@dataclass(frozen=True)
class TimedLevels:
    """Levels, the finest first. seconds: time per pose of each."""

    levels: tuple[Level, ...]
    seconds: tuple[float, ...]

    @property
    def centimetres(self) -> list[float]:
        """Return the RMS errors, cm."""
        return [100 * level.rms for level in self.levels]

    @property
    def microseconds(self) -> list[float]:
        """Return the times per pose, µs."""
        return [1e6 * seconds for seconds in self.seconds]


@dataclass(frozen=True)
class LevelCosts:
    """The levels of a model, and alternative levels.

    times: multiples of the finest level's error limits, for which the alternatives were built.
    """

    chosen: TimedLevels
    others: TimedLevels
    times: tuple[float, ...]

    @property
    def distances(self) -> tuple[float, ...]:
        """Return the distance, m, beyond which each level's worst pose is off by under a pixel.

        Never less than that of a finer level.
        """
        found = [CAMERA.pixels * own.pose for own in self.chosen.levels]
        return tuple(np.maximum.accumulate(found).tolist())

    def chapter(self) -> Chapter:
        """Return the use, size, time and error of each level, and a chart of all levels."""
        chosen, others = (
            list(map(_facts, timed.levels, timed.seconds)) for timed in (self.chosen, self.others)
        )
        for level, distance in zip(chosen, self.distances, strict=True):
            level["one_pixel_from_m"] = distance
        for level, times in zip(others, self.times, strict=True):
            level["times_budget"] = times
        facts = {
            "poses_a_call": level_selection.ROWS_PER_CALL,
            "image_lines": CAMERA.height,
            "field_of_view_rad": CAMERA.fov,
            "levels": chosen,
            "others": others,
        }
        summary = ", ".join(
            f"level {number} {100 * level['rms_m']:.2f} cm at {level['numbers']} numbers"
            for number, level in enumerate(chosen)
        )
        chart = svg_chart.draw(
            3.7,
            self._paint,
            f"Error against numbers read and time per pose; chosen: {summary}.",
            "Orange: the levels of this model. Blue: alternative levels, built for 1 to "
            f"{self.times[-1]:g} times the error limits of the finest level. The time has a lower "
            "bound: every level computes rotations and bone offsets of all joints.",
        )
        sizes = ("ranks", "clips used", "joints that move", "numbers", "kB")
        errors = ("RMS", "99th percentile", "RMS of the worst pose", "largest")
        tables = (
            Table(
                "Size and time of each level",
                ("level", *sizes, "multiply-adds per pose", "µs per pose"),
                tuple(_sizes(number, level) for number, level in enumerate(chosen)),
            ),
            Table(
                "Error of each level (cm)",
                ("level", *errors, "effector at its event", "below a pixel from (m)"),
                tuple(_errors(number, level) for number, level in enumerate(chosen)),
            ),
        )
        paragraphs = (_EXPLANATION, *self._uses())
        return Chapter(facts, Section("levels", "Levels of detail", paragraphs, tables, (chart,)))

    def _uses(self) -> tuple[str, ...]:
        """Return one sentence per level on its use."""
        pairs = zip_longest(self.distances, self.distances[1:])
        return tuple(self._use(number, *pair) for number, pair in enumerate(pairs))

    def _use(self, number: int, start: float, end: float | None) -> str:
        until = "" if end is None else f" to {end:.0f} m"
        if not number:
            near = f", and for characters up{until}" if until else ""
            return f"Level 0 is for export and measurement{near}."
        share = self.chosen.seconds[number] / self.chosen.seconds[0]
        return (
            f"Level {number} is for characters from {start:.0f} m{until or ' onwards'}: its worst "
            f"pose is off by less than a pixel there, in {100 * share:.0f} % of the time of the "
            "finest level."
        )

    def _paint(self, figure: Figure) -> None:
        left, right = figure.subplots(1, 2, sharey=True)
        for timed, style, colour, label in (
            (self.others, ".-", svg_chart.BLUE, "alternative levels"),
            (self.chosen, "o", svg_chart.ORANGE, "levels of this model"),
        ):
            drawn: dict[str, Any] = {"color": colour, "label": label, "zorder": 4}
            left.loglog([own.numbers for own in timed.levels], timed.centimetres, style, **drawn)
            right.semilogy(timed.microseconds, timed.centimetres, style, **drawn)
        _label_levels(left, [own.numbers for own in self.chosen.levels], self.chosen.centimetres)
        _label_levels(right, self.chosen.microseconds, self.chosen.centimetres)
        left.set(xlabel="numbers read", ylabel="error (cm, RMS)", title="size")
        right.set(xlabel="time (µs per pose)", title="time", xlim=(0.0, None))
        left.margins(y=0.12)
        left.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        svg_chart.plain_logarithm(left.xaxis)
        svg_chart.plain_logarithm(left.yaxis)
        left.legend(loc="upper right")


def _label_levels(ax: Axes, across: Sequence[float], errors: Sequence[float]) -> None:
    """Write the levels' names to the lower left, where a falling curve leaves space."""
    paper = {"boxstyle": "square,pad=0.1", "color": "white", "alpha": 0.8}
    for number, at in enumerate(zip(across, errors, strict=True)):
        beside = ax.annotate(f"level {number}", at, (-7, -2), textcoords="offset points", size=8)
        beside.set(ha="right", va="top", bbox=paper, zorder=3)


def _sizes(number: int, level: dict[str, Any]) -> tuple[str, ...]:
    return (
        str(number),
        " × ".join(map(str, level["ranks"])),
        str(level["clips_asked"]),
        str(level["joints_that_move"]),
        f"{level['numbers']:,}",
        f"{level['bytes'] / 1000:.1f}",
        f"{level['operations']:,}",
        f"{1e6 * level['seconds_per_pose']:.2f}",
    )


def _errors(number: int, level: dict[str, Any]) -> tuple[str, ...]:
    lengths = (f"{100 * level[f'{name}_m']:.3g}" for name in ("rms", "p99", "pose", "max"))
    effector = "" if level["effector_m"] is None else f"{100 * level['effector_m']:.2f}"
    return (str(number), *lengths, effector, f"{level['one_pixel_from_m']:.0f}")


def _facts(level: Level, seconds: float) -> dict[str, Any]:
    """Return a level as in the card, with the number of its joints and the seconds per pose."""
    lengths = {
        f"{name}_m": getattr(level, name) for name in ("rms", "p99", "pose", "max", "effector")
    }
    return {
        "ranks": list(level.ranks),
        "clips_asked": level.samples,
        "joints_that_move": len(level.joints),
        "numbers": level.numbers,
        "bytes": level.bytes,
        "operations": level.operations,
        **lengths,
        "seconds_per_pose": seconds,
    }


@dataclass(frozen=True)
class AlternativeLevels:
    """Levels below a model's own size, the finest first.

    times: multiples of the error limits that they were built for. opened: session with the model's
    own size as level 0 and these levels after it.
    """

    times: tuple[float, ...]
    levels: tuple[Level, ...]
    opened: Session


def build_alternatives(
    recipe: Recipe, trained: TrainedModel, own_card: ModelCard
) -> AlternativeLevels:
    """Build alternative levels, each within the ranks of the finer one, in one graph."""
    shop = levels.level_builder(recipe, trained)
    farthest = max([FARTHEST, *(detail.times for detail in recipe.size.details)])
    times = tuple(float(f"{times:.3g}") for times in np.geomspace(1.0, farthest, TIMED_POINTS))
    joints = shop.model.decoder.level_sizes[0].joints
    model = shop.model
    for one in times:
        model = shop.with_coarser_level(model, joints, one)
    found = tuple(shop.level(model, number) for number in range(len(times) + 1))
    content = model.onnx(model_card.dump(replace(own_card, levels=found)), {})
    return AlternativeLevels(times, found[1:], session.open_bytes(content, "alternative levels"))


def time_levels(exported: ExportedModel, others: AlternativeLevels) -> LevelCosts:
    """Measure the times of the levels of an exported model and of the alternatives."""
    own = session.open_bytes(exported.content, f"{exported.card.name}.onnx")
    chosen = exported.card.levels
    asked = [(own, number) for number in range(len(chosen))]
    asked += [(others.opened, 1 + number) for number in range(len(others.levels))]
    seconds = level_selection.benchmark_levels(asked, TIMING_ROUNDS)
    return LevelCosts(
        TimedLevels(chosen, level_selection.monotone_costs(seconds[: len(chosen)])),
        TimedLevels(others.levels, level_selection.monotone_costs(seconds[len(chosen) :])),
        others.times,
    )
