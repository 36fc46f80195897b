"""Compression of the motion tensor, and alignment of the clips in time."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from posefield.common.units import Booleans, Floats
from posefield_train.align.warp import FIT_TIMES, MINIMUM_INCREMENT
from posefield_train.graph import truncation_cost
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report import clip_errors, page
from posefield_train.report.page import (
    Section,
    Table,
    centimetres,
    draw_chart,
    percent,
    product,
    short_label,
)
from posefield_train.tensor import hosvd

# Error limits, m, for which the smallest size is listed.
BUDGETS = (0.0025, 0.005, 0.01, 0.02, 0.03, 0.05)
NAMED_CLIPS = 3
# Share of the largest possible change of speed from which a clip counts as at the limit; the
# increments that the limit applies to are smoothed.
NEAR_LIMIT = 0.85


@dataclass(frozen=True)
class Truncation:
    """Error and size of every truncation (Mukai & Kuriyama 2006, table 1).

    errors: (D', T, N), m. stored: numbers stored (D', T, N). chosen: ranks of the model.
    """

    errors: Floats
    stored: Floats
    chosen: tuple[int, int, int]

    def smallest(self, allowed: float) -> tuple[int, ...]:
        """Return the ranks of fewest numbers stored within an error, m."""
        fits = self.errors <= max(allowed, float(self.errors.min()))
        best = int(np.argmin(np.where(fits, self.stored, np.inf)))
        return tuple(int(i) + 1 for i in np.unravel_index(best, self.errors.shape))

    def facts(self, ranks: tuple[int, ...]) -> dict[str, Any]:
        """Return the error and size of some ranks."""
        index, core = tuple(rank - 1 for rank in ranks), int(np.prod(ranks))
        stored = int(self.stored[index])
        return {
            "ranks": list(ranks),
            "rms_m": float(self.errors[index]),
            "numbers_stored": stored,
            "core_numbers": core,
            "compression_all_in": self.errors.size / stored,
            "compression_core_only": self.errors.size / core,
        }


def measure_truncation(trained: TrainedModel) -> Truncation:
    """Return every truncation of a trained model's tensor."""
    core, reduced = trained.full.core, trained.model.decoder.reduced.core
    price = truncation_cost.storage_cost(trained.tensor, len(trained.model.bank.low))
    stored = price.evaluate(*np.ix_(*(np.arange(1, size + 1) for size in core.shape)))
    r1, r2, r3 = reduced.shape
    return Truncation(trained.tensor.rms(hosvd.squared_errors(core)), stored, (r1, r2, r3))


def truncation_section(trained: TrainedModel) -> Section:
    """Return the smallest sizes for some errors, and the errors around the chosen size."""
    truncation = measure_truncation(trained)
    chosen = truncation.facts(truncation.chosen)
    smallest = [{"budget_m": b, **truncation.facts(truncation.smallest(b))} for b in BUDGETS]
    error, numbers = 100 * chosen["rms_m"], chosen["numbers_stored"]
    paragraphs = (
        f"The chosen ranks {product(truncation.chosen)} cause an error of {error:.2f} cm (RMS over "
        f"joints, frames and clips in the training metric). The model stores {numbers:,} "
        f"numbers in place of {truncation.errors.size:,}: a compression of "
        f"{chosen['compression_all_in']:.1f} with "
        f"bases and kriging weights, and of {chosen['compression_core_only']:.1f} for the core "
        "alone.",
    )
    limited = [{"limit": f"{100 * row['budget_m']:g} cm", **row} for row in smallest]
    table = Table.of(
        "Smallest size for an error limit",
        [{"limit": "chosen", **chosen}, *limited],
        ("error limit", "limit", str),
        ("ranks", "ranks", product),
        ("error (cm)", "rms_m", centimetres),
        ("numbers stored", "numbers_stored", "{:,}".format),
        ("compression", "compression_all_in", _ratio),
        ("of the core alone", "compression_core_only", _ratio),
    )
    chart = draw_chart(
        3.7,
        partial(_paint_sizes, truncation),
        f"Truncation error against ranks; chosen: {error:.2f} cm at {numbers} numbers.",
        "Error against two of the ranks, the third as chosen. The orange dot is the chosen size.",
    )
    facts = {"tensor_numbers": truncation.errors.size, "chosen": chosen, "smallest": smallest}
    return Section("sizes", "Error against size", paragraphs, (table,), (chart,), facts)


def _ratio(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}"


def _paint_sizes(truncation: Truncation, figure: Figure) -> None:
    """Draw the error, cm, over two ranks, and the chosen ones."""
    axes = figure.subplots()
    r1, r2, r3 = truncation.chosen
    errors = 100 * truncation.errors[:, r2 - 1, :].T
    extent = (0.5, errors.shape[1] + 0.5, 0.5, errors.shape[0] + 0.5)
    image = axes.imshow(errors, origin="lower", aspect="auto", extent=extent, cmap="Blues")
    ranks = np.arange(1, errors.shape[1] + 1), np.arange(1, errors.shape[0] + 1)
    levels = [level for level in (0.5, 1, 2, 5, 10) if errors.min() < level < errors.max()]
    if levels:
        lines = axes.contour(*ranks, errors, levels, colors=page.INK, linewidths=0.7)
        axes.clabel(lines, fmt="%g cm", fontsize=8)
    axes.plot(r1, r3, "o", color=page.ORANGE, clip_on=False)
    axes.grid(visible=False)
    title = f"ranks, with {r2} of frames"
    axes.set(xlabel="rank of degrees of freedom", ylabel="rank of samples", title=title)
    figure.colorbar(image, ax=axes, label="error (cm)")


@dataclass(frozen=True)
class TimeWarps:
    """Maps (N, 501) from uniform shares of the time of N clips to canonical time."""

    maps: Floats

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
    def at_limit(self) -> Booleans:
        """Return a mask (N,) of clips with a change of speed at the limit of the alignment."""
        return self.stretches > NEAR_LIMIT / MINIMUM_INCREMENT


def warp_section(trained: TrainedModel) -> Section:
    """Return a chart of the time maps, and the clips with the largest change of speed."""
    warps = TimeWarps(trained.model.timing.basis.evaluate(trained.aligned.logs, FIT_TIMES))
    order = np.argsort(-warps.stretches, kind="stable")
    clips = [
        {
            "clip": clip_errors.clip_label(trained.examples[i]),
            "duration_s": float(trained.aligned.durations[i]),
            "largest_stretch": float(warps.stretches[i]),
            "at_share": float(warps.change_times[i]),
            "at_the_bound": bool(warps.at_limit[i]),
            "shift": trained.examples[i].shift,
        }
        for i in order
    ]
    durations, worst = trained.aligned.durations, clips[:NAMED_CLIPS]
    summary = (
        f"The clips last {durations.min():.2f} to {durations.max():.2f} s. Alignment "
        "maps the time of each clip to a canonical time, at which all clips are in the same "
        "phase of the motion. The largest change of speed by this map is a factor of "
        f"{worst[0]['largest_stretch']:.2f}, in {worst[0]['clip']}."
    )
    table = Table.of(
        "Clips with the largest change of speed",
        worst,
        ("clip", "clip", str),
        ("duration (s)", "duration_s", "{:.2f}".format),
        ("factor", "largest_stretch", "{:.2f}".format),
        ("at", "at_share", percent),
    )
    chart = draw_chart(
        3.5,
        partial(_paint_maps, warps.maps[order], clips),
        f"Time maps of {len(clips)} clips; largest change of speed: {worst[0]['clip']}.",
        "Canonical time against the time of each clip; on the dashed diagonal the speed is "
        "unchanged. Orange: the clips in the table.",
    )
    paragraphs = (summary, _limit_text(warps), *_shift_text(trained))
    facts = {"clips": clips}
    return Section("warps", "Alignment in time", paragraphs, (table,), (chart,), facts)


def _shift_text(trained: TrainedModel) -> tuple[str, ...]:
    shifts = np.array([example.shift for example in trained.examples])
    if not shifts.any():
        return ()
    farthest = int(np.argmax(np.abs(shifts)))
    return (
        "Before the alignment the start of each cycle was moved to a common phase, by "
        f"{100 * np.sqrt(np.mean(np.square(shifts))):.1f} % of a cycle (RMS), and of "
        f"{clip_errors.clip_label(trained.examples[farthest])} by {100 * shifts[farthest]:+.1f} %. "
        "The end of the cycle and its landmarks moved with it.",
    )


def _limit_text(warps: TimeWarps) -> str:
    count = int(warps.at_limit.sum())
    rule = (
        f"The alignment limits the speed to at least about {MINIMUM_INCREMENT:g} of the clip's "
        "mean speed"
    )
    if not count:
        return f"{rule}. No clip is near this limit."
    return (
        f"{rule}. {count} of {len(warps.maps)} clips are at this limit. Near an end a clip is then "
        "usually cut at another phase than the others, and elsewhere it pauses where they do not."
    )


def _paint_maps(maps: Floats, clips: list[dict[str, Any]], figure: Figure) -> None:
    """Draw the maps of clips, the largest change of speed first."""
    axes = figure.subplots()
    for row in maps[NAMED_CLIPS:]:
        axes.plot(FIT_TIMES, row, color=page.FAINT, linewidth=0.8)
    axes.plot([0, 1], [0, 1], color=page.INK, linewidth=0.8, linestyle="--")
    for row, clip, style in zip(maps, clips, ("-", "--", ":"), strict=False):
        axes.plot(FIT_TIMES, row, style, color=page.ORANGE, label=short_label(clip["clip"]))
    axes.legend(loc="lower right", fontsize=7.5)
    axes.set(xlabel="share of the clip's time", ylabel="canonical time", title="time maps")
