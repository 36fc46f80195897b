"""Stick figures of the clips that the others predict worst: what was captured, what was expected.

Both stand on the performer's own bones, so that what differs is the motion.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from model_export.report import left_out, picture, plain, stage
from model_export.report.left_out import Body
from model_export.report.page import Section
from model_export.report.picture import Picture
from model_export.train import Trained
from service.motion.conventions import Floats

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
        scene = stage.of(self.truth, self.guess, self.bones)
        height = min(3.4, picture.WIDTH * scene.size[1] / scene.size[0] + 0.5)
        return picture.draw(f"figure-{self.index}", height, scene.paint, alt, caption)


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
            "metric of training, which counts large turns somewhat higher and, for a cycle, adds "
            "its travel.",
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
    points, values = trained.laid.half_ranges, trained.values["pose"]
    distances = np.linalg.norm(points - points[clip], axis=1)
    distances[clip] = np.inf
    other = int(np.argmin(distances))
    shared = trained.tensor.weight * trained.tensor.values.shape[1]
    squared = float(np.sum(np.square(values[clip] - values[other]))) / shared
    return Neighbour(
        left_out.label(trained.examples[other]), float(distances[other]), float(np.sqrt(squared))
    )
