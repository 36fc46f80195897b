"""Temporal alignment: the map from each clip's time to canonical time."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from posefield.common.units import Floats
from posefield_train.align.warp import FIT_TIMES, MINIMUM_INCREMENT
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report.drawing import left_out_clips, significant_digits, svg_chart
from posefield_train.report.drawing.html_page import Section, Table

NAMED_CLIPS = 3
# Share of the largest possible change of speed from which a clip counts as at the limit; the
# increments that the limit applies to are smoothed.
NEAR_LIMIT = 0.85
# First and last share of a clip, where a large change of speed suggests another cut.
END_SHARE = 0.1


@dataclass(frozen=True)
class TimeWarps:
    """Time maps of N clips.

    maps: canonical time (N, 501) at uniform shares of each clip's time. durations: (N,), s. shifts:
    share (N,) of a cycle by which each clip was shifted to begin later.
    """

    maps: Floats
    labels: tuple[str, ...]
    durations: Floats
    shifts: Floats

    @property
    def _factors(self) -> Floats:
        """Return the change of speed (N, 500) relative to the clip's mean, at least 1."""
        slopes = np.diff(self.maps, axis=1) / np.diff(FIT_TIMES)
        return np.maximum(slopes, 1.0 / slopes)

    @property
    def stretches(self) -> Floats:
        """Return the largest change of speed (N,) of each clip, as a factor."""
        return self._factors.max(axis=1)

    @property
    def change_times(self) -> Floats:
        """Return the place (N,) of the largest change, as a share of the clip's time."""
        return FIT_TIMES[np.argmax(self._factors, axis=1)]

    @property
    def at_limit(self) -> npt.NDArray[np.bool_]:
        """Return a mask (N,) of clips with a change of speed at the limit of the alignment."""
        return self.stretches > NEAR_LIMIT / MINIMUM_INCREMENT

    @property
    def _order(self) -> list[int]:
        return [int(i) for i in np.argsort(-self.stretches, kind="stable")]

    def facts(self) -> dict[str, Any]:
        """Return the largest change of speed of every clip, the largest first."""
        return {
            "clips": [
                {
                    "clip": self.labels[i],
                    "duration_s": significant_digits.round_number(self.durations[i]),
                    "largest_stretch": significant_digits.round_number(self.stretches[i]),
                    "at_share": significant_digits.round_number(self.change_times[i]),
                    "at_the_bound": bool(self.at_limit[i]),
                    "shift": significant_digits.round_number(self.shifts[i]),
                }
                for i in self._order
            ]
        }

    def section(self) -> Section:
        """Return a chart of the maps, and the clips with the largest change of speed."""
        worst = self._order[:NAMED_CLIPS]
        summary = (
            f"The clips last {self.durations.min():.2f} to {self.durations.max():.2f} s. Alignment "
            "maps the time of each clip to a canonical time, at which all clips are in the same "
            "phase of the motion. The largest change of speed by this map is a factor of "
            f"{self.stretches[worst[0]]:.2f}, in {self.labels[worst[0]]}."
        )
        rows = tuple(
            (
                self.labels[i],
                f"{self.durations[i]:.2f}",
                f"{self.stretches[i]:.2f}",
                f"{100 * self.change_times[i]:.0f} %",
            )
            for i in worst
        )
        drawn = svg_chart.draw(
            3.5,
            self._paint,
            f"Time maps of {len(self.maps)} clips, and the largest change of speed of each; "
            f"largest: {self.labels[worst[0]]}.",
            "Left: canonical time against the time of each clip; on the dashed diagonal the speed "
            "is unchanged. Right: largest change of speed of each clip, sorted. Orange: the clips "
            "in the table.",
        )
        heading = ("clip", "duration (s)", "factor", "at")
        table = Table("Clips with the largest change of speed", heading, rows)
        paragraphs = (summary, self._limit_text(), *self._shift_text())
        return Section("warps", "Alignment in time", paragraphs, (table,), (drawn,))

    def _shift_text(self) -> tuple[str, ...]:
        if not self.shifts.any():
            return ()
        most = int(np.argmax(np.abs(self.shifts)))
        return (
            "Before the alignment the start of each cycle was moved to a common phase, by "
            f"{100 * np.sqrt(np.mean(np.square(self.shifts))):.1f} % of a cycle (RMS), and of "
            f"{self.labels[most]} by {100 * self.shifts[most]:+.1f} %. The end of the cycle and "
            "its landmarks moved with it.",
        )

    def _limit_text(self) -> str:
        met = int(self.at_limit.sum())
        rule = (
            f"The alignment limits the speed to at least about {MINIMUM_INCREMENT:g} of the clip's "
            "mean speed"
        )
        if not met:
            return f"{rule}. No clip is near this limit."
        ends = int(np.sum(self.at_limit & (np.abs(self.change_times - 0.5) > 0.5 - END_SHARE)))
        return (
            f"{rule}. {met} of {len(self.maps)} clips are at this limit, {ends} of them in the "
            "first or last tenth. There it usually means that the clip was cut at another phase "
            "than the others, and elsewhere that it pauses where the others do not."
        )

    def _paint(self, figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        order = self._order
        worst = order[:NAMED_CLIPS]
        for i in order[NAMED_CLIPS:]:
            left.plot(FIT_TIMES, self.maps[i], color=svg_chart.FAINT, linewidth=0.8)
        left.plot([0, 1], [0, 1], color=svg_chart.INK, linewidth=0.8, linestyle="--")
        for i, style in zip(worst, ("-", "--", ":"), strict=False):
            left.plot(
                FIT_TIMES,
                self.maps[i],
                style,
                color=svg_chart.ORANGE,
                label=svg_chart.label(self.labels[i]),
            )
        left.legend(loc="lower right", fontsize=7.5)
        left.set(xlabel="share of the clip's time", ylabel="canonical time", title="time maps")
        colours = [
            svg_chart.ORANGE if rank < NAMED_CLIPS else svg_chart.BLUE for rank in range(len(order))
        ]
        right.bar(np.arange(len(order)), self.stretches[order], width=0.72, color=colours)
        right.set(ylabel="largest change of speed (factor)", title="clips", ylim=(1.0, None))
        right.set_xticks([])


def collect_warps(trained: TrainedModel) -> TimeWarps:
    """Return the time maps of a trained model's clips."""
    aligned = trained.aligned
    return TimeWarps(
        trained.model.timing.basis.evaluate(aligned.logs, FIT_TIMES),
        tuple(left_out_clips.clip_label(example) for example in trained.examples),
        aligned.durations,
        np.array([example.shift for example in trained.examples]),
    )
