"""Leave-one-out errors of the clips, possible outliers, and the clips of largest error, drawn."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from posefield.common.units import Floats
from posefield.model_file.model_card import Control
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report.drawing import left_out_clips, stick_figures, svg_chart
from posefield_train.report.drawing.html_page import Chapter, Section, Table
from posefield_train.report.drawing.left_out_clips import BodyMotion
from posefield_train.report.drawing.svg_chart import Chart

# Clips named in the table, and clips drawn as stick figures.
NAMED_CLIPS, DRAWN = 10, 3
# The names of more performers than this do not fit below the bars.
MAX_LABELLED_CLIPS = 110
NAMED_JOINTS = 3


def worst_first(trained: TrainedModel) -> list[int]:
    """Return the indices of the clips, the largest leave-one-out error first."""
    return [int(i) for i in np.argsort(-trained.left_out_errors, kind="stable")]


def errors_by_performer(trained: TrainedModel) -> list[dict[str, Any]]:
    """Return number of clips and RMS error, m, of each performer, the largest error first."""
    names = np.array([example.row.performer for example in trained.examples])
    rows = [
        {
            "performer": name,
            "clips": int(np.sum(names == name)),
            "rms_m": float(np.sqrt(trained.left_out_errors[names == name].mean())),
        }
        for name in sorted(set(names.tolist()) - {""})
    ]
    return sorted(rows, key=lambda row: -row["rms_m"])


def error_chapter(trained: TrainedModel, controls: tuple[Control, ...]) -> Chapter:
    """Return a bar chart of all clips, and tables of the largest errors and of outliers."""
    performers, clips = errors_by_performer(trained), list[dict[str, Any]]()
    for clip in worst_first(trained):
        example = trained.examples[clip]
        evidence = "; ".join(one.evidence for one in trained.outliers if one.clip == clip)
        names = (control.name for control in controls)
        clips.append(
            {
                "clip": left_out_clips.clip_label(example),
                "performer": example.row.performer,
                "missed_m": float(np.sqrt(trained.left_out_errors[clip])),
                "controls": dict(zip(names, example.controls.tolist(), strict=True)),
                "against": evidence,
            }
        )
    rms = float(np.sqrt(np.mean(np.square([clip["missed_m"] for clip in clips]))))
    files = [clip["clip"] for clip in clips]
    largest, least = (f"{100 * clips[at]['missed_m']:.1f}" for at in (0, -1))
    paragraphs = (
        "Each clip is predicted from all other clips and compared with its capture on aligned "
        f"time. The error is {100 * rms:.2f} cm (RMS over joints and frames). The "
        f"largest error is {100 * clips[0]['missed_m']:.2f} cm, of {files[0]}.",
    )
    caption = (
        "Error of each left-out clip, the largest first, with its performer. The clips of the "
        "orange bars are drawn below. The dashed line is the RMS over all clips."
    )
    if trained.outliers:
        caption += " Outlined bars are possible outliers."
    chart = svg_chart.draw(
        3.0,
        partial(_paint_bars, clips, rms),
        f"Bar chart of the error of {len(clips)} clips, from {largest} "
        f"to {least} cm; largest: {', '.join(files[:DRAWN])}.",
        caption,
    )
    listed = tuple(
        (
            clip["clip"],
            clip["performer"],
            f"{100 * clip['missed_m']:.2f}",
            *(f"{value:.4g}" for value in clip["controls"].values()),
        )
        for clip in clips[:NAMED_CLIPS]
    )
    heading = ("clip", "performer", "error (cm)", *(control.name for control in controls))
    outliers = tuple((clip["clip"], clip["against"]) for clip in clips if clip["against"])
    by_name = tuple(
        (one["performer"], str(one["clips"]), f"{100 * one['rms_m']:.2f}") for one in performers
    )
    tables = (
        Table("Possible outliers", ("clip", "evidence"), outliers),
        Table("Clips with the largest error", heading, listed),
        Table("Error by performer", ("performer", "clips", "error (cm)"), by_name),
    )
    shown = tuple(table for table in tables if table.rows)
    title = "Error of each left-out clip"
    return Chapter(
        {"rms_m": rms, "performers": performers, "clips": clips},
        Section("clips", title, paragraphs, shown, (chart,)),
    )


def _paint_bars(clips: list[dict[str, Any]], rms: float, figure: Figure) -> None:
    ax = figure.subplots()
    at = np.arange(len(clips))
    ax.bar(
        at,
        [100 * clip["missed_m"] for clip in clips],
        width=0.72,
        color=[svg_chart.ORANGE if i < DRAWN else svg_chart.BLUE for i in at],
        edgecolor=[svg_chart.INK if clip["against"] else "none" for clip in clips],
        linewidth=1.6,
    )
    ax.axhline(100 * rms, color=svg_chart.INK, linestyle="--", linewidth=0.9)
    ax.grid(visible=False, axis="x")
    ax.set(ylabel="error (cm)", xlim=(-0.7, len(at) - 0.3))
    if len(at) <= MAX_LABELLED_CLIPS:
        names = [svg_chart.label(clip["performer"]) for clip in clips]
        ax.set_xticks(at, names, rotation=90, fontsize=min(8.5, 640 / len(at)))
    else:
        ax.set_xticks([])


@dataclass(frozen=True)
class DrawnClip:
    """A clip as captured and as predicted from the others, with its own bone lengths.

    joint_rms: RMS distance (J,) of each joint over frames, m. nearest: index of the clip with the
    nearest controls. nearest_distance: half-ranges. nearest_rms: RMS difference of the motions, m.
    """

    clip: int
    captured: BodyMotion
    predicted: BodyMotion
    joint_rms: Floats
    nearest: int
    nearest_distance: float
    nearest_rms: float

    @property
    def rms(self) -> float:
        """Return the RMS distance over joints and frames, m."""
        return float(np.sqrt(np.mean(np.square(self.joint_rms))))


def compare_clip(trained: TrainedModel, clip: int) -> DrawnClip:
    """Return a clip beside its prediction from all other clips."""
    captured, predicted = (
        left_out_clips.body_motion(trained, clip, motion)
        for motion in (
            trained.tensor.values[:, :, clip],
            left_out_clips.predicted_motion(trained, clip),
        )
    )
    squared = np.sum(np.square(captured.joints - predicted.joints), axis=-1)
    points, values = trained.samples.half_ranges, trained.values["pose"]
    distances = np.linalg.norm(points - points[clip], axis=1)
    distances[clip] = np.inf
    nearest = int(np.argmin(distances))
    shared = trained.tensor.weight * trained.tensor.values.shape[1]
    apart = float(np.sum(np.square(values[clip] - values[nearest]))) / shared
    return DrawnClip(
        clip,
        captured,
        predicted,
        np.sqrt(squared.mean(axis=0)),
        nearest,
        float(distances[nearest]),
        float(np.sqrt(apart)),
    )


def drawn_chapter(trained: TrainedModel) -> Chapter:
    """Return a chart for each clip of largest error and, for comparison, that of median error."""
    order = np.argsort(trained.left_out_errors, kind="stable")
    drawn = [*worst_first(trained)[:DRAWN], int(order[len(order) // 2])]
    both = [_drawn(trained, compare_clip(trained, clip)) for clip in drawn]
    *worst, typical = (facts for facts, _ in both)
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
    charts = tuple(chart for _, chart in both)
    title = "Clips with the largest error, drawn"
    return Chapter(
        {"worst": worst, "typical": typical}, Section("figures", title, paragraphs, (), charts)
    )


def _drawn(trained: TrainedModel, drawn: DrawnClip) -> tuple[dict[str, Any], Chart]:
    """Return the figures of a clip, and both bodies at a few times, side by side."""
    example = trained.examples[drawn.clip]
    figure, performer = example.clip.skeleton, example.row.performer
    farthest = np.argsort(-drawn.joint_rms, kind="stable")[:NAMED_JOINTS]
    facts: dict[str, Any] = {
        "clip": left_out_clips.clip_label(example),
        "performer": performer,
        "drawn_rms_m": drawn.rms,
        "root_rms_m": float(drawn.joint_rms[0]),
        "farthest_joints_m": {figure.names[i]: float(drawn.joint_rms[i]) for i in farthest},
        "nearest_clip": left_out_clips.clip_label(trained.examples[drawn.nearest]),
        "nearest_half_ranges": drawn.nearest_distance,
        "nearest_differs_m": drawn.nearest_rms,
    }
    joints = ", ".join(
        f"{name} {100 * gap:.0f} cm" for name, gap in facts["farthest_joints_m"].items()
    )
    caption = (
        f"{facts['clip']}{f', performer {performer}' if performer else ''}: joints "
        f"differ by {100 * drawn.rms:.1f} cm RMS, the root by {100 * facts['root_rms_m']:.1f} cm. "
        f"Largest differences: {joints}. The clip with the nearest controls, "
        f"{facts['nearest_clip']}, is {drawn.nearest_distance:.2f} half-ranges away and differs by "
        f"{100 * drawn.nearest_rms:.1f} cm."
    )
    alt = f"Stick figures of {facts['clip']}: as captured, and as predicted from other clips."
    bones = [(parent, child) for child, parent in enumerate(figure.parents) if parent >= 0]
    bones += [(joint, len(figure) + tip) for tip, joint in enumerate(figure.tip_joints)]
    strip = stick_figures.pose_strip(drawn.captured, drawn.predicted, tuple(bones))
    height = min(3.4, svg_chart.WIDTH * strip.size[1] / strip.size[0] + 0.5)
    return facts, svg_chart.draw(height, strip.paint, alt, caption)
