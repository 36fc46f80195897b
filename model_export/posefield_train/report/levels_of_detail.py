"""Levels of detail: error, size and time of each.

Times depend on the machine. They are measured before the model is reported and are not stored in
the model file.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield.inference import level_selection, session
from posefield.inference.level_selection import Camera
from posefield.model_file.model_card import Level
from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.report.page import Section, Table, centimetres, product

# Common resolution and field of view of games: 1080 lines, 60 degrees vertically.
CAMERA = Camera(np.zeros(3), math.radians(60.0), 1080.0)
# Measurements of one level differ by a few per cent, as some levels do, so take the median of many.
TIMING_ROUNDS = 51

_EXPLANATION = (
    "Errors are distances of joints from the model before truncation, over random controls, "
    "performers and times; they include the effect of clips that a level leaves out. A pixel is "
    f"one of an image of {CAMERA.height:.0f} lines with a vertical field of view of "
    f"{math.degrees(CAMERA.fov):.0f} degrees. Times are for one pose in batches of "
    f"{level_selection.ROWS_PER_CALL}, measured on one thread of the machine that trained, with "
    "the service's own code. A coarser level is never listed as slower than a finer one. Times are "
    "not stored in the model file."
)


@dataclass(frozen=True)
class LevelCosts:
    """The levels of a model, the finest first. seconds: time per pose of each."""

    levels: tuple[Level, ...]
    seconds: tuple[float, ...]

    def section(self) -> Section:
        """Return the use, size, time and error of each level."""
        chosen = list(map(_facts, self.levels, self.seconds))
        # Beyond this distance the worst pose is off by under a pixel, as that of each finer level.
        distances = np.maximum.accumulate([CAMERA.pixels * level.pose for level in self.levels])
        for level, distance in zip(chosen, distances.tolist(), strict=True):
            level["one_pixel_from_m"] = distance
        facts = {
            "poses_a_call": level_selection.ROWS_PER_CALL,
            "image_lines": CAMERA.height,
            "field_of_view_rad": CAMERA.fov,
            "levels": chosen,
        }
        rows = [{"level": number, **level} for number, level in enumerate(chosen)]
        tables = (
            Table.of(
                "Size and time of each level",
                rows,
                ("level", "level", str),
                ("ranks", "ranks", product),
                ("clips used", "clips_asked", str),
                ("joints that move", "joints_that_move", str),
                ("numbers", "numbers", "{:,}".format),
                ("kB", "bytes", lambda count: f"{count / 1000:.1f}"),
                ("multiply-adds per pose", "operations", "{:,}".format),
                ("µs per pose", "seconds_per_pose", lambda seconds: f"{1e6 * seconds:.2f}"),
            ),
            Table.of(
                "Error of each level (cm)",
                rows,
                ("level", "level", str),
                ("RMS", "rms_m", _three_digits),
                ("99th percentile", "p99_m", _three_digits),
                ("RMS of the worst pose", "pose_m", _three_digits),
                ("largest", "max_m", _three_digits),
                ("effector at its event", "effector_m", _effector),
                ("below a pixel from (m)", "one_pixel_from_m", "{:.0f}".format),
            ),
        )
        return Section("levels", "Levels of detail", (_EXPLANATION,), tables, (), facts)


def _three_digits(metres: float) -> str:
    return f"{100 * metres:.3g}"


def _effector(metres: float | None) -> str:
    return "" if metres is None else centimetres(metres)


def _facts(level: Level, seconds: float) -> dict[str, Any]:
    """Return a level as in the card, with the number of its joints and the seconds per pose."""
    lengths = {
        f"{name}_m": getattr(level, name) for name in ("rms", "p99", "pose", "max", "effector")
    }
    return {
        "ranks": list(level.ranks),
        "clips_asked": level.samples,
        "joints_that_move": len(level.joints),
        "numbers": level.numbers,
        "bytes": level.bytes,
        "operations": level.operations,
        **lengths,
        "seconds_per_pose": seconds,
    }


def time_levels(exported: ExportedModel) -> LevelCosts:
    """Measure the times of the levels of an exported model."""
    opened = session.open_bytes(exported.content, f"{exported.card.name}.onnx")
    levels = exported.card.levels
    seconds = level_selection.benchmark_levels(
        [(opened, number) for number in range(len(levels))], TIMING_ROUNDS
    )
    return LevelCosts(levels, level_selection.monotone_costs(seconds))
