"""Stick figures on the ground, seen from the side that shows most of the motion."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from posefield.common.units import UP, Floats
from posefield_train.report.drawing import svg_chart
from posefield_train.report.drawing.left_out_clips import BodyMotion

FRAMES = 6
MARGIN = 0.25
"""Gap between two figures, m."""


def widest_direction(displacements: Floats) -> Floats:
    """Return the horizontal direction (3,) along which displacements (..., 3) are largest."""
    ways = displacements.reshape(-1, 3) * (1.0 - UP)
    _, vectors = np.linalg.eigh(ways.T @ ways)
    direction = vectors[:, -1]
    # A body that faces forward (+z) faces right; in a front view, its left is on the right.
    return direction if direction[2] + 1e-3 * direction[0] >= 0 else -direction


def project(points: Floats, direction: Floats) -> Floats:
    """Return points (..., 2) of a view with a horizontal direction (3,) to the right, m."""
    return points @ np.stack([direction, UP], axis=1)


@dataclass(frozen=True)
class PoseStrip:
    """Captured and predicted bodies at several times, side by side.

    captured, predicted: bones (F, B, 2, 2), m. times: shares of canonical time (F,). floor: height
    of the lowest captured point or of the ground, m. step: distance from one figure to the next, m.
    """

    captured: Floats
    predicted: Floats
    times: Floats
    floor: float
    step: float

    @property
    def size(self) -> tuple[float, float]:
        """Return width and height, m."""
        top = max(float(self.captured[..., 1].max()), float(self.predicted[..., 1].max()))
        return self.step * FRAMES, top - self.floor + 0.5 * MARGIN

    def paint(self, figure: Figure) -> None:
        """Draw captured bodies dark and predicted ones orange."""
        ax: Axes = figure.subplots()
        width, height = self.size
        ax.axhline(0.0, color=svg_chart.FAINT, linewidth=1.0)
        shown = {
            "predicted": (self.predicted, svg_chart.ORANGE),
            "captured": (self.captured, svg_chart.INK),
        }
        for bodies, colour in shown.values():
            ax.add_collection(LineCollection(list(bodies.reshape(-1, 2, 2)), colors=colour))
        ax.set(xlim=(0.0, width), ylim=(self.floor - 0.06, self.floor + height), aspect="equal")
        at = self.step * (np.arange(FRAMES) + 0.5)
        ax.set_xticks(at, [f"{100 * time:.0f} %" for time in self.times])
        ax.tick_params(length=0)
        ax.grid(visible=False)
        ax.yaxis.set_visible(False)
        ax.spines[:].set_visible(False)
        handles = [Line2D([], [], color=colour, label=name) for name, (_, colour) in shown.items()]
        figure.legend(handles=handles[::-1], loc="outside upper left", ncols=2)


def pose_strip(
    captured: BodyMotion, predicted: BodyMotion, bones: tuple[tuple[int, int], ...]
) -> PoseStrip:
    """Return both bodies at FRAMES times, drawn relative to the captured root.

    bones: indices of the points at both ends, the tips after the joints.
    """
    count = len(captured.joints)
    frames = np.rint(np.linspace(0, count - 1, FRAMES)).astype(np.int64)
    moved = captured.joints - captured.joints.mean(axis=0)
    direction = widest_direction(np.concatenate([moved, captured.joints - predicted.joints]))
    root = captured.joints[frames, :1] * (1.0 - UP)
    flat = [
        project(np.concatenate([body.joints, body.tips], axis=1)[frames] - root, direction)
        for body in (captured, predicted)
    ]
    left = min(float(points[..., 0].min()) for points in flat)
    right = max(float(points[..., 0].max()) for points in flat)
    step = right - left + MARGIN
    at = np.zeros((FRAMES, 1, 2))
    at[:, 0, 0] = step * np.arange(FRAMES) - left + 0.5 * MARGIN
    # A family of a single joint has no bones.
    ends = np.array(bones, dtype=np.int64).reshape(-1, 2)
    first, second = ((points + at)[:, ends] for points in flat)
    floor = float(first[..., 1].min(initial=0.0))
    return PoseStrip(first, second, frames / (count - 1), floor, step)
