"""Minimal recipes, and folders of small motions to train them on."""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from posefield.motion import bvh_writer, quat
from posefield.motion.clip import Clip, assemble
from posefield.motion.skeleton import Skeleton
from posefield_train.source import ingest
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

TOML = """\
schema = 1
name = "tiny"
description = "Small motions"
licence = "CC0-1.0"
[source]
metres_per_unit = 1.0
up = "y"
[clips]
table = "clips.csv"
file = "file"
[[controls]]
name = "speed"
column = "v"
unit = "m/s"
description = "Mean speed"
[motion]
frames = 20
cyclic = false
root = "travelling"
[size]
rms_budget_cm = 1.0
"""
"""The recipe as text."""

SKELETON = Skeleton(
    ("Hips", "Spine", "Head", "LeftArm", "LeftHand"),
    (-1, 0, 1, 1, 3),
    np.array([(0, 0, 0), (0, 0.4, 0), (0, 0.3, 0.05), (0.2, 0.1, 0), (0.5, 0, 0)]),
    (2, 4),
    np.array([(0, 0.2, 0), (0.1, 0, 0)]),
)


def plain_recipe() -> dict[str, Any]:
    """A recipe of one control, as its TOML says it."""
    return tomllib.loads(TOML)


def recipe_with(**sections: Mapping[str, Any]) -> Recipe:
    """The recipe with values of its sections changed or added."""
    plain = plain_recipe()
    for section, values in sections.items():
        plain[section] = {**plain.get(section, {}), **values}
    return Recipe.model_validate(plain)


def small_clip(phase: float = 0.0, frames: int = 21, heading: float = 0.3) -> Clip:
    """A body that walks forwards, swings and turns a little; `heading` is where it sets out."""
    t = np.linspace(0.0, 1.0, frames)
    swing = 0.4 * np.sin(5 * t[:, None, None] + phase + np.arange(15).reshape(5, 3))
    rotations = quat.exp(swing)
    yaw = quat.from_axis_angle(np.array([0.0, 1.0, 0.0]), heading + 0.2 * t)
    rotations[:, 0] = quat.mul(yaw, quat.exp(0.2 * swing[:, 0]))
    path = np.stack([2 + t * np.sin(heading), 0.9 + 0.05 * t, 1 + t * np.cos(heading)], axis=-1)
    return assemble(SKELETON, rotations, path, SKELETON.offsets, 30.0)


def write_clips(folder: Path, clips: Sequence[Clip], metres_per_unit: float = 1.0) -> Path:
    """Folder of clips as 0.bvh, 1.bvh, … and the table that lists them, controls 0, 1, …"""
    folder.mkdir(parents=True, exist_ok=True)
    for index, clip in enumerate(clips):
        content = bvh_writer.dumps(clip, metres_per_unit=metres_per_unit)
        (folder / f"{index}.bvh").write_bytes(content)
    rows = [f"{index}.bvh,{index}" for index in range(len(clips))]
    (folder / "clips.csv").write_text("\n".join(["file,v", *rows]) + "\n")
    return folder


def ingested(
    folder: Path,
    motions: Sequence[Clip],
    rows: Sequence[str] | None = None,
    head: str = "file,v",
    **sections: Mapping[str, Any],
) -> tuple[Recipe, list[Example], list[str]]:
    """Recipe, examples and notes of motions that are written to a folder, with a table of rows."""
    write_clips(folder, motions)
    if rows is not None:
        (folder / "clips.csv").write_text("\n".join([head, *rows]) + "\n")
    own = recipe_with(**sections)
    return own, *ingest.ingest(own, folder)
