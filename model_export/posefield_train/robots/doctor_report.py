"""The doctor's answer as text and as a picture."""

import io
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from posefield.robots.robot import UNLIMITED, Robot
from posefield_train.robots.cycle_search import Cycle
from posefield_train.robots.doctor import Diagnosis

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_DRAWN = 8
"""Motions of a picture: those with the most faults."""


def text(diagnoses: Sequence[Diagnosis]) -> str:
    """Return a paragraph for each motion and a line on all of them."""
    faulty = sum(bool(diagnosis.findings) for diagnosis in diagnoses)
    kinds = Counter(kind for each in diagnoses for kind in {f.kind for f in each.findings})
    counts = ", ".join(f"{kind} {count}" for kind, count in sorted(kinds.items()))
    motions = "motion" if len(diagnoses) == 1 else "motions"
    total = f"{len(diagnoses)} {motions}, {faulty} with faults{counts and ': '}{counts}"
    return "\n".join([*("\n".join(_lines(diagnosis)) for diagnosis in diagnoses), total])


def _lines(diagnosis: Diagnosis) -> list[str]:
    motion, facts = diagnosis.motion, diagnosis.facts()
    fastest = facts["largest_speed"]
    loops = {True: "repeats", False: "ends", None: "says not whether it repeats"}[motion.loops]
    return [
        motion.source,
        f"  {motion.format}: {len(motion)} frames at {motion.rate:g} a second, "
        f"{motion.duration:.2f} s, {motion.angles.shape[1]} joints; {loops}",
        *(f"  {name}: {told}" for name, told in motion.evidence.items()),
        f"  fastest: {fastest['joint']}, {fastest['rad_s']:.1f} rad/s; largest acceleration "
        f"{facts['largest_acceleration_rad_s2']:.0f} rad/s²",
        *([f"  cycle: {_cycle_text(diagnosis.cycle)}"] if diagnosis.cycle else []),
        *(f"  {finding.kind}: {finding.text}" for finding in diagnosis.findings),
        *([] if diagnosis.findings else ["  no faults"]),
    ]


def _cycle_text(cycle: Cycle) -> str:
    cycles = "one" if cycle.count == 1 else "two, which close better than one"
    return (
        f"{cycle.seconds:.3f} s; frames {cycle.first} to {cycle.last} hold {cycles}, open by "
        f"{np.degrees(cycle.gap):.2f} degrees"
    )


def picture(diagnoses: Sequence[Diagnosis], robot: Robot | None, suffix: str) -> bytes:
    """Return a picture: angles within their limits over time, and heights of the feet.

    suffix: "png" or "svg". Of many motions those with the most faults are drawn.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    ordered = sorted(diagnoses, key=lambda diagnosis: -len(diagnosis.findings))[:MOST_DRAWN]
    figure = Figure(figsize=(11, 2.6 * len(ordered)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(ordered), 2, squeeze=False, width_ratios=(3, 2))
    for diagnosis, (left, right) in zip(ordered, axes, strict=True):
        _draw_angles(left, diagnosis, robot)
        _draw_feet(right, diagnosis, robot)
    buffer = io.BytesIO()
    # Without a date and with set identifiers equal motions give equal bytes.
    metadata = {"Date": None} if suffix == "svg" else {"Software": None}
    figure.savefig(buffer, format=suffix, metadata=metadata)
    return buffer.getvalue()


def _draw_angles(axes: "Axes", diagnosis: Diagnosis, robot: Robot | None) -> None:
    motion = diagnosis.motion
    ranges = np.stack([motion.angles.min(axis=0), motion.angles.max(axis=0)], axis=-1)
    if robot:
        ranges = np.where(np.abs(robot.ranges) < UNLIMITED, robot.ranges, ranges)
    extents = np.maximum(ranges[:, 1] - ranges[:, 0], 1e-9)
    shares = (motion.angles - ranges[:, 0]) / extents
    axes.imshow(
        np.clip(shares, 0.0, 1.0).T,
        aspect="auto",
        interpolation="nearest",
        cmap="cividis",
        extent=(0.0, motion.duration, len(extents) - 0.5, -0.5),
    )
    frames, hinges = np.nonzero((shares < -1e-3) | (shares > 1.001))
    axes.plot(frames / motion.rate, hinges, "s", color="red", markersize=2)
    axes.set_title(
        f"{motion.source}: angles within their limits, red beyond", fontsize=8, wrap=True
    )
    names = motion.hinges or tuple(str(hinge + 1) for hinge in range(len(extents)))
    axes.set_yticks(range(len(names)), names, fontsize=4)
    axes.set_xlabel("s", fontsize=7)


def _draw_feet(axes: "Axes", diagnosis: Diagnosis, robot: Robot | None) -> None:
    motion = diagnosis.motion
    times = np.arange(len(motion)) / motion.rate
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    for foot in range(diagnosis.heights.shape[1]):
        heights = 100.0 * diagnosis.heights[:, foot]
        name = robot.bodies[robot.feet[foot].body] if robot else ""
        (line,) = axes.plot(times, heights, linewidth=0.8, label=name)
        standing = np.where(diagnosis.contacts[:, foot], heights, np.nan)
        axes.plot(times, standing, linewidth=2.5, color=line.get_color())
    axes.set_title("lowest points of the feet, cm; thick where they stand", fontsize=8)
    if diagnosis.heights.shape[1]:
        axes.legend(fontsize=6)
    else:
        axes.text(0.5, 0.5, "feet are known with --robot", transform=axes.transAxes, ha="center")
    axes.set_xlabel("s", fontsize=7)
