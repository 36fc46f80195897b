"""Leave-one-out errors of the clips, possible outliers, and the clips of largest error, drawn."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from posefield.common.units import UP, Floats
from posefield.model_file.model_card import Control
from posefield.motion import quat, skeleton
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report import page
from posefield_train.report.page import (
    WIDTH,
    Chapter,
    Chart,
    Section,
    Table,
    draw_chart,
    short_label,
)
from posefield_train.source.ingest import Example


@dataclass(frozen=True)
class BodyMotion:
    """Positions of joints (T, J, 3) and of end sites (T, E, 3), m."""

    joints: Floats
    tips: Floats


def predicted_motion(trained: TrainedModel, clip: int) -> Floats:
    """Return the slice (D', T) of the motion tensor predicted for a clip from all others."""
    residual = trained.full.slices(trained.pose.residuals[[clip]])[:, :, 0]
    return trained.tensor.values[:, :, clip] - residual


def body_motion(trained: TrainedModel, clip: int, own_motion: Floats) -> BodyMotion:
    """Return the body of a clip's performer in a slice (D', T) of the motion tensor."""
    example, tensor = trained.examples[clip], trained.tensor
    rotations, root = tensor.chart.poses(tensor.numbers(own_motion[:, :, None])[0])
    translations = skeleton.translations(example.offsets, root)
    own = example.clip.skeleton
    joints, turns = skeleton.forward_kinematics(own.parents, rotations, translations)
    ends = list(own.tip_joints)
    return BodyMotion(joints, joints[:, ends] + quat.rotate(turns[:, ends], own.tip_offsets))


def clip_label(example: Example) -> str:
    """Return a clip's name on the page: its file, and its line in the table of clips."""
    return f"{example.row.place.name.removesuffix('.bvh')} (line {example.row.line})"


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
        ax.axhline(0.0, color=page.FAINT, linewidth=1.0)
        shown = {
            "predicted": (self.predicted, page.ORANGE),
            "captured": (self.captured, page.INK),
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
                "clip": clip_label(example),
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
    chart = draw_chart(
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
        color=[page.ORANGE if i < DRAWN else page.BLUE for i in at],
        edgecolor=[page.INK if clip["against"] else "none" for clip in clips],
        linewidth=1.6,
    )
    ax.axhline(100 * rms, color=page.INK, linestyle="--", linewidth=0.9)
    ax.grid(visible=False, axis="x")
    ax.set(ylabel="error (cm)", xlim=(-0.7, len(at) - 0.3))
    if len(at) <= MAX_LABELLED_CLIPS:
        names = [short_label(clip["performer"]) for clip in clips]
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
        body_motion(trained, clip, motion)
        for motion in (
            trained.tensor.values[:, :, clip],
            predicted_motion(trained, clip),
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
        "clip": clip_label(example),
        "performer": performer,
        "drawn_rms_m": drawn.rms,
        "root_rms_m": float(drawn.joint_rms[0]),
        "farthest_joints_m": {figure.names[i]: float(drawn.joint_rms[i]) for i in farthest},
        "nearest_clip": clip_label(trained.examples[drawn.nearest]),
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
    strip = pose_strip(drawn.captured, drawn.predicted, tuple(bones))
    height = min(3.4, WIDTH * strip.size[1] / strip.size[0] + 0.5)
    return facts, draw_chart(height, strip.paint, alt, caption)
