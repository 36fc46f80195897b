"""Stick figures of the clips that the others predict worst: what was captured, what was expected.

Both stand on the performer's own bones, so that what differs is the motion.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from model_export.report import left_out, picture, plain
from model_export.report.left_out import Body
from model_export.report.page import Section
from model_export.report.picture import Picture
from model_export.train import Trained
from service.motion.conventions import UP, Floats

FRAMES = 6
# Between two figures, m.
MARGIN = 0.25
NAMED_JOINTS = 3


@dataclass(frozen=True)
class Neighbour:
    """The clip of the nearest controls: how far off these are, in half-ranges, and it is, m."""

    label: str
    distance: float
    differs: float


@dataclass(frozen=True)
class Compared:
    """A clip as captured and as the others predict it; bones: parent and child, tips last.

    joints: names. nearest: what the controls say is most like it.
    """

    index: int
    label: str
    performer: str
    truth: Body
    guess: Body
    bones: tuple[tuple[int, int], ...]
    joints: tuple[str, ...]
    nearest: Neighbour

    @property
    def gaps(self) -> Floats:
        """Distances (J,) of each joint, root mean square over frames, m."""
        squared = np.sum(np.square(self.truth.joints - self.guess.joints), axis=-1)
        return np.sqrt(squared.mean(axis=0))

    @property
    def apart(self) -> float:
        """Root mean square distance over joints and frames, m."""
        return float(np.sqrt(np.mean(np.square(self.gaps))))

    @property
    def farthest(self) -> dict[str, float]:
        """The joints that are farthest off, and by how much, m."""
        order = np.argsort(-self.gaps, kind="stable")[:NAMED_JOINTS]
        return {self.joints[joint]: float(self.gaps[joint]) for joint in order}

    def facts(self) -> dict[str, Any]:
        """How far bodies as drawn are apart, and where."""
        return {
            "clip": self.label,
            "performer": self.performer,
            "drawn_rms_m": plain.number(self.apart),
            "root_rms_m": plain.number(self.gaps[0]),
            "farthest_joints_m": {k: plain.number(v) for k, v in self.farthest.items()},
            "nearest_clip": self.nearest.label,
            "nearest_half_ranges": plain.number(self.nearest.distance),
            "nearest_differs_m": plain.number(self.nearest.differs),
        }

    def picture(self) -> Picture:
        """Both bodies at a few moments, side by side."""
        joints = ", ".join(f"{name} {100 * gap:.0f} cm" for name, gap in self.farthest.items())
        nearest = self.nearest
        caption = (
            f"{self.label}{f', performer {self.performer}' if self.performer else ''}: "
            f"{100 * self.apart:.1f} cm apart over joints and frames, the root "
            f"{100 * self.gaps[0]:.1f} cm; farthest: {joints}. Its nearest neighbour in the "
            f"controls, {nearest.label}, is {nearest.distance:.2f} half-ranges away and moves "
            f"{100 * nearest.differs:.1f} cm otherwise."
        )
        alt = f"Stick figures of {self.label}: captured, and as the other clips predict it."
        stage = _Stage.of(self)
        height = min(3.4, picture.WIDTH * stage.size[1] / stage.size[0] + 0.5)
        return picture.draw(f"figure-{self.index}", height, stage.paint, alt, caption)


@dataclass(frozen=True)
class _Stage:
    """Segments of both bodies (F, B, 2, 2) where they are drawn; size of the whole, m."""

    truth: Floats
    guess: Floats
    times: Floats
    floor: float
    step: float

    @classmethod
    def of(cls, pair: Compared) -> "_Stage":
        """Bodies seen from the side from which most of the motion is seen."""
        frames = np.rint(np.linspace(0, len(pair.truth.joints) - 1, FRAMES)).astype(np.int64)
        side = _side(pair.truth.joints, pair.guess.joints)
        view = np.stack([side, UP], axis=1)
        root = pair.truth.joints[frames, :1] * (1.0 - UP)
        flat = [
            (np.concatenate([body.joints, body.tips], axis=1)[frames] - root) @ view
            for body in (pair.truth, pair.guess)
        ]
        left = min(float(points[..., 0].min()) for points in flat)
        right = max(float(points[..., 0].max()) for points in flat)
        step = right - left + MARGIN
        at = np.zeros((FRAMES, 1, 2))
        at[:, 0, 0] = step * np.arange(FRAMES) - left + 0.5 * MARGIN
        bones = np.array(pair.bones)
        truth, guess = ((points + at)[:, bones] for points in flat)
        times = frames / (len(pair.truth.joints) - 1)
        return cls(truth, guess, times, float(min(0.0, truth[..., 1].min())), step)

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
        for bodies, colour, wide in (
            (self.guess, picture.ORANGE, 1.3),
            (self.truth, picture.INK, 1.6),
        ):
            ax.add_collection(
                LineCollection(list(bodies.reshape(-1, 2, 2)), colors=colour, linewidths=wide)
            )
        ax.set(xlim=(0.0, width), ylim=(self.floor - 0.06, self.floor + height), aspect="equal")
        ax.set_xticks(
            self.step * (np.arange(FRAMES) + 0.5), [f"{100 * time:.0f} %" for time in self.times]
        )
        ax.grid(visible=False)
        ax.tick_params(length=0)
        ax.yaxis.set_visible(False)
        ax.spines[:].set_visible(False)
        shown = {"captured": picture.INK, "predicted": picture.ORANGE}
        handles = [Line2D([], [], color=colour, label=name) for name, colour in shown.items()]
        figure.legend(handles=handles, loc="outside upper left", ncols=2)


def _side(truth: Floats, guess: Floats) -> Floats:
    """Horizontal direction (3,) across the view, along which bodies move and differ most."""
    moved = truth - truth.mean(axis=0)
    ways = np.concatenate([moved, truth - guess]).reshape(-1, 3) * (1.0 - UP)
    _, vectors = np.linalg.eigh(ways.T @ ways)
    across = vectors[:, -1]
    # Who faces ahead faces to the right, or in a view from the front, has the left on the right.
    return across if across[2] + 1e-3 * across[0] >= 0 else -across


@dataclass(frozen=True)
class Figures:
    """The worst clips and, to compare with, one of the middle."""

    worst: tuple[Compared, ...]
    typical: Compared

    def facts(self) -> dict[str, Any]:
        """What the pictures show, in numbers."""
        return {
            "worst": [pair.facts() for pair in self.worst],
            "typical": self.typical.facts(),
        }

    def section(self) -> Section:
        """A picture a clip."""
        words = (
            "The clips that the others predict worst, and last one of the middle. Both bodies have "
            "the performer's own bones. Percentages are of canonical time; each moment is drawn "
            "about the captured root, from the side that shows most of the motion.",
            "Where a body steps with the other foot or reaches in another way, that is a behaviour "
            "which the controls do not name: a control for it, or a family of its own, helps more "
            "than finer tuning. Distances here are between joints as drawn; those above are in the "
            "metric of training, which counts large turns somewhat higher.",
        )
        pictures = tuple(pair.picture() for pair in (*self.worst, self.typical))
        return Section("figures", "The worst clips, drawn", words, pictures=pictures)


def of(trained: Trained, worst: tuple[int, ...]) -> Figures:
    """Drawings of the worst clips of a trained model."""
    middle = int(np.argsort(trained.missed, kind="stable")[len(trained.missed) // 2])
    return Figures(tuple(compare(trained, clip) for clip in worst), compare(trained, middle))


def compare(trained: Trained, clip: int) -> Compared:
    """One clip beside what all others predict for it."""
    example = trained.examples[clip]
    own = example.clip.skeleton
    bones = [(parent, child) for child, parent in enumerate(own.parents) if parent >= 0]
    bones += [(joint, len(own) + tip) for tip, joint in enumerate(own.tip_joints)]
    return Compared(
        clip,
        left_out.label(example),
        example.row.performer,
        left_out.body(trained, clip, trained.tensor.values[:, :, clip]),
        left_out.body(trained, clip, left_out.motion(trained, clip)),
        tuple(bones),
        own.names,
        _nearest(trained, clip),
    )


def _nearest(trained: Trained, clip: int) -> Neighbour:
    points, values = left_out.points(trained), left_out.values(trained)
    distances = np.linalg.norm(points - points[clip], axis=1)
    distances[clip] = np.inf
    other = int(np.argmin(distances))
    shared = trained.tensor.weight * trained.tensor.values.shape[1]
    squared = float(np.sum(np.square(values[clip] - values[other]))) / shared
    return Neighbour(
        left_out.label(trained.examples[other]), float(distances[other]), float(np.sqrt(squared))
    )
