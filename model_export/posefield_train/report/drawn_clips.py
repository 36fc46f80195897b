"""Stick figures of the clips with the largest error, as captured and as predicted from the others.

Both bodies have the performer's own bone lengths, so that only the motion differs.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield.common.units import Floats
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report.drawing import (
    left_out_clips,
    significant_digits,
    stick_figures,
    svg_chart,
)
from posefield_train.report.drawing.html_page import Section
from posefield_train.report.drawing.left_out_clips import BodyMotion
from posefield_train.report.drawing.svg_chart import Chart

NAMED_JOINTS = 3


@dataclass(frozen=True)
class NearestClip:
    """The clip with the nearest controls.

    distance: half-ranges. differs: RMS difference of the motions, m.
    """

    label: str
    distance: float
    differs: float


@dataclass(frozen=True)
class DrawnClip:
    """A clip as captured and as predicted.

    bones: indices of parent and child, the tips last. joints: joint names. nearest: the clip with
    the nearest controls.
    """

    label: str
    performer: str
    captured: BodyMotion
    predicted: BodyMotion
    bones: tuple[tuple[int, int], ...]
    joints: tuple[str, ...]
    nearest: NearestClip

    @property
    def gaps(self) -> Floats:
        """Return the RMS distance (J,) of each joint over frames, m."""
        squared = np.sum(np.square(self.captured.joints - self.predicted.joints), axis=-1)
        return np.sqrt(squared.mean(axis=0))

    @property
    def apart(self) -> float:
        """Return the RMS distance over joints and frames, m."""
        return float(np.sqrt(np.mean(np.square(self.gaps))))

    @property
    def farthest(self) -> dict[str, float]:
        """Return the joints with the largest distance, and that distance, m."""
        order = np.argsort(-self.gaps, kind="stable")[:NAMED_JOINTS]
        return {self.joints[joint]: float(self.gaps[joint]) for joint in order}

    def facts(self) -> dict[str, Any]:
        """Return the distances of the drawn bodies."""
        return {
            "clip": self.label,
            "performer": self.performer,
            "drawn_rms_m": significant_digits.round_number(self.apart),
            "root_rms_m": significant_digits.round_number(self.gaps[0]),
            "farthest_joints_m": {
                k: significant_digits.round_number(v) for k, v in self.farthest.items()
            },
            "nearest_clip": self.nearest.label,
            "nearest_half_ranges": significant_digits.round_number(self.nearest.distance),
            "nearest_differs_m": significant_digits.round_number(self.nearest.differs),
        }

    def chart(self) -> Chart:
        """Return both bodies at a few times, side by side."""
        joints = ", ".join(f"{name} {100 * gap:.0f} cm" for name, gap in self.farthest.items())
        nearest = self.nearest
        caption = (
            f"{self.label}{f', performer {self.performer}' if self.performer else ''}: joints "
            f"differ by {100 * self.apart:.1f} cm RMS, the root by {100 * self.gaps[0]:.1f} cm. "
            f"Largest differences: {joints}. The clip with the nearest controls, {nearest.label}, "
            f"is {nearest.distance:.2f} half-ranges away and differs by "
            f"{100 * nearest.differs:.1f} cm."
        )
        alt = f"Stick figures of {self.label}: as captured, and as predicted from other clips."
        strip = stick_figures.pose_strip(self.captured, self.predicted, self.bones)
        height = min(3.4, svg_chart.WIDTH * strip.size[1] / strip.size[0] + 0.5)
        return svg_chart.draw(height, strip.paint, alt, caption)


@dataclass(frozen=True)
class DrawnClips:
    """The clips with the largest error and, for comparison, the clip of median error."""

    worst: tuple[DrawnClip, ...]
    typical: DrawnClip

    def facts(self) -> dict[str, Any]:
        """Return the figures of each drawn clip."""
        return {
            "worst": [pair.facts() for pair in self.worst],
            "typical": self.typical.facts(),
        }

    def section(self) -> Section:
        """Return a chart for each clip."""
        paragraphs = (
            "These clips have the largest leave-one-out error; the last one has the median error. "
            "Both bodies have the performer's own bone lengths. Percentages are of canonical time. "
            "Each pose is drawn relative to the captured root, from the side that shows most of "
            "the motion.",
            "If the predicted body steps with the other foot or reaches in another way, the "
            "controls do not describe that behaviour: add a control for it, or train a separate "
            "model for it. The distances here are between drawn joints. The errors above use the "
            "training metric, which weights large rotations slightly more and includes the travel "
            "of cycles.",
        )
        charts = tuple(pair.chart() for pair in (*self.worst, self.typical))
        return Section("figures", "Clips with the largest error, drawn", paragraphs, charts=charts)


def draw_clips(trained: TrainedModel, worst: tuple[int, ...]) -> DrawnClips:
    """Return drawings of the given clips and of the clip of median error."""
    middle = int(
        np.argsort(trained.left_out_errors, kind="stable")[len(trained.left_out_errors) // 2]
    )
    return DrawnClips(
        tuple(compare_clip(trained, clip) for clip in worst), compare_clip(trained, middle)
    )


def compare_clip(trained: TrainedModel, clip: int) -> DrawnClip:
    """Return a clip beside its prediction from all other clips."""
    example = trained.examples[clip]
    own = example.clip.skeleton
    bones = [(parent, child) for child, parent in enumerate(own.parents) if parent >= 0]
    bones += [(joint, len(own) + tip) for tip, joint in enumerate(own.tip_joints)]
    return DrawnClip(
        left_out_clips.clip_label(example),
        example.row.performer,
        left_out_clips.body_motion(trained, clip, trained.tensor.values[:, :, clip]),
        left_out_clips.body_motion(trained, clip, left_out_clips.predicted_motion(trained, clip)),
        tuple(bones),
        own.names,
        _nearest(trained, clip),
    )


def _nearest(trained: TrainedModel, clip: int) -> NearestClip:
    points, values = trained.samples.half_ranges, trained.values["pose"]
    distances = np.linalg.norm(points - points[clip], axis=1)
    distances[clip] = np.inf
    other = int(np.argmin(distances))
    shared = trained.tensor.weight * trained.tensor.values.shape[1]
    squared = float(np.sum(np.square(values[clip] - values[other]))) / shared
    return NearestClip(
        left_out_clips.clip_label(trained.examples[other]),
        float(distances[other]),
        float(np.sqrt(squared)),
    )
