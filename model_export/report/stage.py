"""Two bodies at a few moments, side by side on the ground."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from model_export.report import picture
from model_export.report.left_out import Body
from service.motion.conventions import UP, Floats

FRAMES = 6
# Between two figures, m.
MARGIN = 0.25


@dataclass(frozen=True)
class Stage:
    """Bones of both bodies (F, B, 2, 2) where they are drawn, m.

    times (F,): shares of canonical time. floor: lowest captured point or the ground, m. step: from
    one figure to the next, m.
    """

    truth: Floats
    guess: Floats
    times: Floats
    floor: float
    step: float

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of what is drawn, m."""
        top = max(float(self.truth[..., 1].max()), float(self.guess[..., 1].max()))
        return self.step * FRAMES, top - self.floor + 0.5 * MARGIN

    def paint(self, figure: Figure) -> None:
        """Captured bodies dark, predicted ones orange, on the ground."""
        ax: Axes = figure.subplots()
        width, height = self.size
        ax.axhline(0.0, color=picture.FAINT, linewidth=1.0)
        for bodies, colour in ((self.guess, picture.ORANGE), (self.truth, picture.INK)):
            ax.add_collection(LineCollection(list(bodies.reshape(-1, 2, 2)), colors=colour))
        ax.set(xlim=(0.0, width), ylim=(self.floor - 0.06, self.floor + height), aspect="equal")
        at = self.step * (np.arange(FRAMES) + 0.5)
        ax.set_xticks(at, [f"{100 * time:.0f} %" for time in self.times])
        ax.tick_params(length=0)
        ax.grid(visible=False)
        ax.yaxis.set_visible(False)
        ax.spines[:].set_visible(False)
        shown = {"captured": picture.INK, "predicted": picture.ORANGE}
        handles = [Line2D([], [], color=colour, label=name) for name, colour in shown.items()]
        figure.legend(handles=handles, loc="outside upper left", ncols=2)


def of(truth: Body, guess: Body, bones: tuple[tuple[int, int], ...]) -> Stage:
    """Bodies seen from the side from which most of the motion is seen."""
    frames = np.rint(np.linspace(0, len(truth.joints) - 1, FRAMES)).astype(np.int64)
    view = np.stack([_side(truth.joints, guess.joints), UP], axis=1)
    root = truth.joints[frames, :1] * (1.0 - UP)
    flat = [
        (np.concatenate([body.joints, body.tips], axis=1)[frames] - root) @ view
        for body in (truth, guess)
    ]
    left = min(float(points[..., 0].min()) for points in flat)
    right = max(float(points[..., 0].max()) for points in flat)
    step = right - left + MARGIN
    at = np.zeros((FRAMES, 1, 2))
    at[:, 0, 0] = step * np.arange(FRAMES) - left + 0.5 * MARGIN
    captured, predicted = ((points + at)[:, np.array(bones)] for points in flat)
    floor = min(0.0, float(captured[..., 1].min()))
    return Stage(captured, predicted, frames / (len(truth.joints) - 1), floor, step)


def _side(truth: Floats, guess: Floats) -> Floats:
    """Horizontal direction (3,) across the view, along which bodies move and differ most."""
    moved = truth - truth.mean(axis=0)
    ways = np.concatenate([moved, truth - guess]).reshape(-1, 3) * (1.0 - UP)
    _, vectors = np.linalg.eigh(ways.T @ ways)
    across = vectors[:, -1]
    # Who faces ahead faces to the right, or in a view from the front, has the left on the right.
    return across if across[2] + 1e-3 * across[0] >= 0 else -across
