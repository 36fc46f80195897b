"""The ladder of levels of detail: what each costs and is for, among others that it could have had.

Times are the machine's. They are measured before anything is written, and stand in no model file.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from model_export.export import Exported
from model_export.recipe import Recipe
from model_export.report import curve, picture, plain
from model_export.report.page import Section, Table
from model_export.train import Trained
from service.motion.detail import Level
from service.synthesis import pace, session
from service.synthesis.view import Camera

# An image as on most screens, seen as most games see: of 1080 lines, 60 degrees high.
CAMERA = Camera(np.zeros(3), math.radians(60.0), 1080.0)
# Levels may differ by a few per cent, and so does one call from the next.
ROUNDS = 51

_MEANT = (
    "Errors are true distances of joints from those of the model that nothing is cut from, over "
    "random controls, performers and times: truncation and the clips that are not asked. A pixel "
    f"is one of an image of {CAMERA.height:.0f} lines that spans {math.degrees(CAMERA.fov):.0f} "
    f"degrees from top to bottom. Times are a pose's in calls of {pace.BATCH}, by the service's "
    "own session on one thread of the machine that trained: they are not in the model file, and "
    "never grow from a level to the next."
)


@dataclass(frozen=True)
class Paced:
    """Levels, the finest first, and the seconds that a pose of each takes."""

    levels: tuple[Level, ...]
    seconds: tuple[float, ...]

    @property
    def centimetres(self) -> list[float]:
        """Root mean square errors."""
        return [100 * level.rms for level in self.levels]

    @property
    def microseconds(self) -> list[float]:
        """What a pose of each takes."""
        return [1e6 * seconds for seconds in self.seconds]

    def facts(self) -> list[dict[str, Any]]:
        """Every level in numbers."""
        return list(map(_facts, self.levels, self.seconds))


@dataclass(frozen=True)
class Ladder:
    """A model's levels, and others by how many times the budgets of its own size each may cost."""

    chosen: Paced
    others: Paced
    times: tuple[float, ...]

    @property
    def distances(self) -> tuple[float, ...]:
        """Metres from which the worst pose of each level is off by less than a pixel; never nearer
        than a finer level's."""
        found = [CAMERA.pixels * own.pose for own in self.chosen.levels]
        return tuple(np.maximum.accumulate(found).tolist())

    def facts(self) -> dict[str, Any]:
        """Every level, chosen or not."""
        chosen = zip(self.chosen.facts(), self.distances, strict=True)
        others = zip(self.others.facts(), self.times, strict=True)
        return {
            "poses_a_call": pace.BATCH,
            "image_lines": CAMERA.height,
            "field_of_view_rad": plain.number(CAMERA.fov),
            "levels": [
                {**facts, "one_pixel_from_m": plain.number(distance)} for facts, distance in chosen
            ],
            "others": [{**facts, "times_budget": times} for facts, times in others],
        }

    def section(self) -> Section:
        """What each level keeps, costs and is for, and all that there could have been."""
        drawn = picture.draw(
            "levels",
            3.7,
            self._paint,
            f"Error against numbers read and time a pose; chosen: {self._said()}.",
            "Orange: the levels of this model. Blue: other levels, each made alone, for 1 to "
            f"{self.times[-1]:g} times the budgets of the model's own size. Where the time falls "
            "no further it goes to what every level answers: rotations and bones of all joints.",
        )
        tables = self._kept(), self._errors()
        return Section("levels", "Levels of detail", (_MEANT, *self._uses()), tables, (drawn,))

    def _uses(self) -> tuple[str, ...]:
        """A sentence for each level on what it is for."""
        pairs = zip_longest(self.distances, self.distances[1:])
        return tuple(self._use(number, *pair) for number, pair in enumerate(pairs))

    def _use(self, number: int, start: float, end: float | None) -> str:
        until = "" if end is None else f" to {end:.0f} m"
        if not number:
            near = f", and for characters up{until}" if until else ""
            return f"Level 0 is for all that is exported or measured{near}."
        share = self.chosen.seconds[number] / self.chosen.seconds[0]
        return (
            f"Level {number} is for characters from {start:.0f} m{until or ' on'}: the worst pose "
            f"is off by less than a pixel there, in {100 * share:.0f} % of the finest level's time."
        )

    def _said(self) -> str:
        return ", ".join(
            f"level {number} {100 * own.rms:.2f} cm at {own.numbers} numbers"
            for number, own in enumerate(self.chosen.levels)
        )

    def _kept(self) -> Table:
        heading = ("ranks", "clips asked", "joints that move", "numbers", "kB")
        cells = map(_kept, self.chosen.levels, self.chosen.seconds)
        return _numbered((*heading, "multiply-adds a pose", "µs a pose"), cells)

    def _errors(self) -> Table:
        heading = ("RMS (cm)", "99th percentile", "worst pose", "largest", "effector at its event")
        cells = map(_errors, self.chosen.levels, self.distances)
        return _numbered((*heading, "less than a pixel from (m)"), cells)

    def _paint(self, figure: Figure) -> None:
        left, right = figure.subplots(1, 2, sharey=True)
        for paced, style, colour, label in (
            (self.others, ".-", picture.BLUE, "other levels"),
            (self.chosen, "o", picture.ORANGE, "this model's"),
        ):
            drawn: dict[str, Any] = {"color": colour, "label": label, "zorder": 4}
            left.loglog([own.numbers for own in paced.levels], paced.centimetres, style, **drawn)
            right.semilogy(paced.microseconds, paced.centimetres, style, **drawn)
        _name(left, [own.numbers for own in self.chosen.levels], self.chosen.centimetres)
        _name(right, self.chosen.microseconds, self.chosen.centimetres)
        left.set(xlabel="numbers read", ylabel="error (cm, RMS)", title="size")
        right.set(xlabel="time (µs a pose)", title="time", xlim=(0.0, None))
        left.margins(y=0.12)
        left.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        left.yaxis.set_major_formatter("{x:g}")
        left.yaxis.set_minor_formatter("")
        left.legend(loc="upper right")


def _name(ax: Axes, across: Sequence[float], errors: Sequence[float]) -> None:
    """The levels' names, where a falling curve leaves room."""
    paper = {"boxstyle": "square,pad=0.1", "color": "white", "alpha": 0.8}
    for number, at in enumerate(zip(across, errors, strict=True)):
        beside = ax.annotate(f"level {number}", at, (-7, -2), textcoords="offset points", size=8)
        beside.set(ha="right", va="top", bbox=paper, zorder=3)


def _numbered(heading: tuple[str, ...], cells: Iterable[tuple[str, ...]]) -> Table:
    rows = tuple((str(number), *row) for number, row in enumerate(cells))
    return Table(("level", *heading), rows)


def _kept(level: Level, seconds: float) -> tuple[str, ...]:
    return (
        " × ".join(map(str, level.ranks)),
        str(level.samples),
        str(len(level.joints)),
        f"{level.numbers:,}",
        f"{level.bytes / 1000:.1f}",
        f"{level.operations:,}",
        f"{1e6 * seconds:.2f}",
    )


def _errors(level: Level, distance: float) -> tuple[str, ...]:
    effector = "" if level.effector is None else f"{100 * level.effector:.2f}"
    lengths = (level.rms, level.p99, level.pose, level.max)
    return (*(f"{100 * length:.3g}" for length in lengths), effector, f"{distance:.0f}")


def _facts(level: Level, seconds: float) -> dict[str, Any]:
    """A level as in the card, its joints counted, and what a pose takes."""
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
        "seconds_per_pose": plain.number(seconds),
    }


def of(recipe: Recipe, trained: Trained, exported: Exported) -> Ladder:
    """Ladder of an exported model, measured now."""
    own = session.open_bytes(exported.content, f"{exported.card.name}.onnx")
    others = curve.of(recipe, trained, exported.card)
    chosen = exported.card.levels
    asked = [(own, number) for number in range(len(chosen))]
    asked += [(others.opened, 1 + number) for number in range(len(others.levels))]
    seconds = pace.in_turn(asked, ROUNDS)
    return Ladder(
        Paced(chosen, pace.falling(seconds[: len(chosen)])),
        Paced(others.levels, pace.falling(seconds[len(chosen) :])),
        others.times,
    )
