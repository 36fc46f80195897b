"""Leave-one-out errors of the clips, possible outliers, and the clips of largest error, drawn."""

from functools import partial
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from posefield.common.units import UP, Floats
from posefield.model_file.model_card import Control
from posefield.motion import quat, skeleton
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.report import page
from posefield_train.report.page import Chart, Section, Table, centimetres, draw_chart, short_label
from posefield_train.source.ingest import Example

# Clips named in the table, and clips drawn as stick figures.
NAMED_CLIPS, DRAWN = 10, 3
# The names of more performers than this do not fit below the bars.
MAX_LABELLED_CLIPS = 110
NAMED_JOINTS = 3
# Poses of a clip that are drawn, and the gap between two, m.
FRAMES, MARGIN = 6, 0.25


def clip_label(example: Example) -> str:
    """Return a clip's name on the page: its file, and its line in the table of clips."""
    return f"{example.row.file.name.removesuffix('.bvh')} (line {example.row.line})"


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


def error_section(trained: TrainedModel, controls: tuple[Control, ...]) -> Section:
    """Return a bar chart of all clips, and tables of the largest errors and of outliers."""
    names = [control.name for control in controls]
    clips: list[dict[str, Any]] = []
    for clip in worst_first(trained):
        example = trained.examples[clip]
        evidence = [outlier.evidence for outlier in trained.outliers if outlier.clip == clip]
        clips.append(
            {
                "clip": clip_label(example),
                "performer": example.row.performer,
                "missed_m": float(np.sqrt(trained.left_out_errors[clip])),
                "controls": dict(zip(names, example.controls.tolist(), strict=True)),
                "against": "; ".join(evidence),
            }
        )
    performers = errors_by_performer(trained)
    rms = float(np.sqrt(np.mean(np.square([clip["missed_m"] for clip in clips]))))
    files = [clip["clip"] for clip in clips]
    largest, smallest = (f"{100 * clips[index]['missed_m']:.1f}" for index in (0, -1))
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
        f"to {smallest} cm; largest: {', '.join(files[:DRAWN])}.",
        caption,
    )
    columns = [(name, f"controls/{name}", "{:.4g}".format) for name in names]
    name, performer = ("clip", "clip", str), ("performer", "performer", str)
    error = ("error (cm)", "missed_m", centimetres)
    outliers = [clip for clip in clips if clip["against"]]
    tables = (
        Table.of("Possible outliers", outliers, name, ("evidence", "against", str)),
        Table.of(
            "Clips with the largest error", clips[:NAMED_CLIPS], name, performer, error, *columns
        ),
        Table.of(
            "Error by performer",
            performers,
            performer,
            ("clips", "clips", str),
            ("error (cm)", "rms_m", centimetres),
        ),
    )
    filled = tuple(table for table in tables if table.rows)
    title = "Error of each left-out clip"
    facts = {"rms_m": rms, "performers": performers, "clips": clips}
    return Section("clips", title, paragraphs, filled, (chart,), facts)


def _paint_bars(clips: list[dict[str, Any]], rms: float, figure: Figure) -> None:
    ax = figure.subplots()
    bars = np.arange(len(clips))
    ax.bar(
        bars,
        [100 * clip["missed_m"] for clip in clips],
        width=0.72,
        color=[page.ORANGE if i < DRAWN else page.BLUE for i in bars],
        edgecolor=[page.INK if clip["against"] else "none" for clip in clips],
        linewidth=1.6,
    )
    ax.axhline(100 * rms, color=page.INK, linestyle="--", linewidth=0.9)
    ax.grid(visible=False, axis="x")
    ax.set(ylabel="error (cm)", xlim=(-0.7, len(bars) - 0.3))
    if len(bars) <= MAX_LABELLED_CLIPS:
        names = [short_label(clip["performer"]) for clip in clips]
        ax.set_xticks(bars, names, rotation=90, fontsize=min(8.5, 640 / len(bars)))
    else:
        ax.set_xticks([])


def drawn_section(trained: TrainedModel) -> Section:
    """Return a chart for each clip of largest error and, for comparison, that of median error."""
    order = np.argsort(trained.left_out_errors, kind="stable")
    clips = [*worst_first(trained)[:DRAWN], int(order[len(order) // 2])]
    figures, charts = zip(*(_drawn_clip(trained, clip) for clip in clips), strict=True)
    *worst, typical = figures
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
    title = "Clips with the largest error, drawn"
    facts = {"worst": worst, "typical": typical}
    return Section("figures", title, paragraphs, (), charts, facts)


def _drawn_clip(trained: TrainedModel, clip: int) -> tuple[dict[str, Any], Chart]:
    """Return the figures of a clip, and its body as captured and as predicted, side by side."""
    example = trained.examples[clip]
    figure, performer = example.clip.skeleton, example.row.performer
    captured = body_points(trained, clip, trained.tensor.values[:, :, clip])
    predicted = body_points(trained, clip, predicted_motion(trained, clip))
    squared = np.sum(np.square(captured - predicted), axis=-1)[:, : len(figure)]
    joint_rms = np.sqrt(squared.mean(axis=0))
    rms = float(np.sqrt(np.mean(np.square(joint_rms))))
    points, values = trained.samples.half_ranges, trained.values["pose"]
    distances = np.linalg.norm(points - points[clip], axis=1)
    distances[clip] = np.inf
    nearest = int(np.argmin(distances))
    weight = trained.tensor.weight * trained.tensor.values.shape[1]
    nearest_rms = float(np.sqrt(float(np.sum(np.square(values[clip] - values[nearest]))) / weight))
    farthest = np.argsort(-joint_rms, kind="stable")[:NAMED_JOINTS]
    facts: dict[str, Any] = {
        "clip": clip_label(example),
        "performer": performer,
        "drawn_rms_m": rms,
        "root_rms_m": float(joint_rms[0]),
        "farthest_joints_m": {figure.names[i]: float(joint_rms[i]) for i in farthest},
        "nearest_clip": clip_label(trained.examples[nearest]),
        "nearest_half_ranges": float(distances[nearest]),
        "nearest_differs_m": nearest_rms,
    }
    joints = ", ".join(
        f"{name} {100 * gap:.0f} cm" for name, gap in facts["farthest_joints_m"].items()
    )
    caption = (
        f"{facts['clip']}{f', performer {performer}' if performer else ''}: joints "
        f"differ by {100 * rms:.1f} cm RMS, the root by {100 * facts['root_rms_m']:.1f} cm. "
        f"Largest differences: {joints}. The clip with the nearest controls, "
        f"{facts['nearest_clip']}, is {distances[nearest]:.2f} half-ranges away and differs by "
        f"{100 * nearest_rms:.1f} cm."
    )
    alt = f"Stick figures of {facts['clip']}: as captured, and as predicted from other clips."
    bones = [(parent, child) for child, parent in enumerate(figure.parents) if parent >= 0]
    bones += [(joint, len(figure) + tip) for tip, joint in enumerate(figure.tip_joints)]
    centred = captured[:, : len(figure)] - captured[:, : len(figure)].mean(axis=0)
    direction = widest_direction(
        np.concatenate([centred, (captured - predicted)[:, : len(figure)]])
    )
    return facts, _draw_strip(captured, predicted, bones, direction, alt, caption)


def predicted_motion(trained: TrainedModel, clip: int) -> Floats:
    """Return the slice (D', T) of the motion tensor predicted for a clip from all others."""
    residual = trained.full.slices(trained.pose.residuals[[clip]])[:, :, 0]
    return trained.tensor.values[:, :, clip] - residual


def body_points(trained: TrainedModel, clip: int, motion: Floats) -> Floats:
    """Return the joints and, behind them, the end sites (T, J + E, 3), m, of a clip's performer.

    motion: slice (D', T) of the motion tensor.
    """
    example, tensor = trained.examples[clip], trained.tensor
    rotations, root = tensor.chart.poses(tensor.numbers(motion[:, :, None])[0])
    translations = skeleton.translations(example.offsets, root)
    figure = example.clip.skeleton
    joints, turns = skeleton.forward_kinematics(figure.parents, rotations, translations)
    tip_joints = list(figure.tip_joints)
    tips = joints[:, tip_joints] + quat.rotate(turns[:, tip_joints], figure.tip_offsets)
    return np.concatenate([joints, tips], axis=1)


def widest_direction(displacements: Floats) -> Floats:
    """Return the horizontal direction (3,) along which displacements (..., 3) are largest."""
    ways = displacements.reshape(-1, 3) * (1.0 - UP)
    _, vectors = np.linalg.eigh(ways.T @ ways)
    direction = vectors[:, -1]
    # A body that faces forward (+z) faces right; in a front view, its left is on the right.
    return direction if direction[2] + 1e-3 * direction[0] >= 0 else -direction


def _draw_strip(
    captured: Floats,
    predicted: Floats,
    bones: list[tuple[int, int]],
    direction: Floats,
    alt: str,
    caption: str,
) -> Chart:
    """Return bodies of points (T, P, 3) at FRAMES times, relative to the captured root.

    bones: indices of the points at both ends. direction: horizontal (3,), to the right.
    """
    count = len(captured)
    frames = np.rint(np.linspace(0, count - 1, FRAMES)).astype(np.int64)
    root = captured[frames, :1] * (1.0 - UP)
    view = np.stack([direction, UP], axis=1)
    flat = [(points[frames] - root) @ view for points in (captured, predicted)]
    left = min(float(points[..., 0].min()) for points in flat)
    right = max(float(points[..., 0].max()) for points in flat)
    step = right - left + MARGIN
    shifts = np.zeros((FRAMES, 1, 2))
    shifts[:, 0, 0] = step * np.arange(FRAMES) - left + 0.5 * MARGIN
    # A family of a single joint has no bones.
    indices = np.array(bones, dtype=np.int64).reshape(-1, 2)
    lines = [(points + shifts)[:, indices] for points in flat]
    floor = float(lines[0][..., 1].min(initial=0.0))
    width, height = step * FRAMES, max(float(ys[..., 1].max()) for ys in lines) - floor
    height += 0.5 * MARGIN

    def paint(figure: Figure) -> None:
        ax = figure.subplots()
        ax.axhline(0.0, color=page.FAINT, linewidth=1.0)
        bodies = {"predicted": (lines[1], page.ORANGE), "captured": (lines[0], page.INK)}
        for segments, colour in bodies.values():
            ax.add_collection(LineCollection(list(segments.reshape(-1, 2, 2)), colors=colour))
        ax.set(xlim=(0.0, width), ylim=(floor - 0.06, floor + height), aspect="equal")
        centres = step * (np.arange(FRAMES) + 0.5)
        ax.set_xticks(centres, [f"{100 * time:.0f} %" for time in frames / (count - 1)])
        ax.tick_params(length=0)
        ax.grid(visible=False)
        ax.yaxis.set_visible(False)
        ax.spines[:].set_visible(False)
        handles = [Line2D([], [], color=colour, label=name) for name, (_, colour) in bodies.items()]
        figure.legend(handles=handles[::-1], loc="outside upper left", ncols=2)

    return draw_chart(min(3.4, page.WIDTH * height / width + 0.5), paint, alt, caption)
