"""How clips were stretched in time to meet each other."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from model_export.report import left_out, picture, plain
from model_export.report.page import Section, Table
from model_export.train import Trained
from model_export.warp import DENSE, FLOOR
from service.motion.conventions import Floats

NAMED = 3
# Of the largest stretch that there can be; the increments that it bounds are smoothed.
NEAR = 0.85
# First and last share of a clip, where a stretch means that it was cut at another phase.
ENDS = 0.1


@dataclass(frozen=True)
class Warps:
    """maps (N, 501): canonical time of each clip's own times. labels and durations, s, of each.
    shifts (N,): the share of its cycle by which each begins later than it was cut."""

    maps: Floats
    labels: tuple[str, ...]
    durations: Floats
    shifts: Floats | None = None

    @property
    def _factors(self) -> Floats:
        """How many times slower or faster (N, 500) than its mean pace each clip is made."""
        slopes = np.diff(self.maps, axis=1) / np.diff(DENSE)
        return np.maximum(slopes, 1.0 / slopes)

    @property
    def stretches(self) -> Floats:
        """The largest stretch (N,) of each clip, of its pace or the inverse."""
        return self._factors.max(axis=1)

    @property
    def places(self) -> Floats:
        """Where in each clip (N,) that is, as a share of its time."""
        return DENSE[np.argmax(self._factors, axis=1)]

    @property
    def bound(self) -> npt.NDArray[np.bool_]:
        """Which clips (N,) have all but met the bound that alignment sets."""
        return self.stretches > NEAR / FLOOR

    @property
    def _order(self) -> list[int]:
        return [int(i) for i in np.argsort(-self.stretches, kind="stable")]

    def facts(self) -> dict[str, Any]:
        """The largest stretch of every clip, the worst first."""
        return {
            "clips": [
                {
                    "clip": self.labels[i],
                    "duration_s": plain.number(self.durations[i]),
                    "largest_stretch": plain.number(self.stretches[i]),
                    "at_share": plain.number(self.places[i]),
                    "at_the_bound": bool(self.bound[i]),
                    "shift": plain.number(0.0 if self.shifts is None else self.shifts[i]),
                }
                for i in self._order
            ]
        }

    def section(self) -> Section:
        """Every clip's map, and the ones that are stretched most."""
        worst = self._order[:NAMED]
        said = (
            f"Durations are {self.durations.min():.2f} to {self.durations.max():.2f} s. Every "
            "clip's time runs evenly to a common one but for these maps; the largest stretch, "
            f"{self.stretches[worst[0]]:.2f} times, is in {self.labels[worst[0]]}."
        )
        rows = tuple(
            (
                self.labels[i],
                f"{self.durations[i]:.2f}",
                f"{self.stretches[i]:.2f}",
                f"{100 * self.places[i]:.0f} %",
            )
            for i in worst
        )
        drawn = picture.draw(
            "warps",
            3.5,
            self._paint,
            f"Time maps of {len(self.maps)} clips; stretched most: {self.labels[worst[0]]}.",
            "Left: from each clip's own time to canonical time; a straight diagonal is no warp. "
            "Right: how much the pace of each clip was changed where it was changed most, sorted.",
        )
        table = Table(("stretched most", "duration (s)", "times", "at"), rows)
        words = (said, self._bounded(), *self._shifted())
        return Section("warps", "Alignment in time", words, (table,), (drawn,))

    def _shifted(self) -> tuple[str, ...]:
        if self.shifts is None or not self.shifts.any():
            return ()
        most = int(np.argmax(np.abs(self.shifts)))
        return (
            "Before that every cycle was begun at the family's phase: "
            f"{100 * np.sqrt(np.mean(np.square(self.shifts))):.1f} % of a cycle from where it was "
            f"cut (root mean square), {self.labels[most]} by {100 * self.shifts[most]:+.1f} %. Its "
            "end, and what is said to happen there, moved with it.",
        )

    def _bounded(self) -> str:
        met = int(self.bound.sum())
        rule = f"Alignment lets no part pass at less than about {FLOOR:g} of the clip's mean pace"
        if not met:
            return f"{rule}: no clip comes near that."
        ends = int(np.sum(self.bound & (np.abs(self.places - 0.5) > 0.5 - ENDS)))
        return (
            f"{rule}: {met} of {len(self.maps)} clips met that bound, {ends} of them in the "
            "first or last tenth. There it mostly means that a clip was cut at another phase "
            "than the others; further in, that it pauses where they do not."
        )

    def _paint(self, figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        order = self._order
        worst = order[:NAMED]
        for i in order[NAMED:]:
            left.plot(DENSE, self.maps[i], color=picture.FAINT, linewidth=0.8)
        left.plot([0, 1], [0, 1], color=picture.INK, linewidth=0.8, linestyle="--")
        for i, style in zip(worst, ("-", "--", ":"), strict=False):
            left.plot(DENSE, self.maps[i], style, color=picture.ORANGE, label=self.labels[i])
        left.legend(loc="lower right", fontsize=7.5)
        left.set(xlabel="share of the clip's time", ylabel="canonical time", title="time maps")
        colours = [picture.ORANGE if rank < NAMED else picture.BLUE for rank in range(len(order))]
        right.bar(np.arange(len(order)), self.stretches[order], width=0.72, color=colours)
        right.set(ylabel="largest stretch (times)", title="clips", ylim=(1.0, None))
        right.set_xticks([])


def of(trained: Trained) -> Warps:
    """Warps of a trained model's clips."""
    aligned = trained.aligned
    return Warps(
        trained.model.timing.basis.evaluate(aligned.logs, DENSE),
        tuple(left_out.label(example) for example in trained.examples),
        aligned.durations,
        np.array([example.shift for example in trained.examples]),
    )
