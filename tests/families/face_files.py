"""Files of the family of a face: motion in BVH, curves in CSV, the table, and the recipe."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from families import face_motion
from families.face_motion import FaceTrial
from posefield.common.units import Floats
from posefield.motion import bvh_writer
from posefield_train.sample import sample_files
from posefield_train.source import clip_table

RECIPE = """\
schema = 1
name = "face"
description = "Procedural facial expressions: a smile, and a mouth that opens"
licence = "CC0-1.0"

[source]
metres_per_unit = 1.0
up = "y"
root_offset = "replace"

[clips]
table = "clips.csv"
file = "file"

[[controls]]
name = "smile"
column = "smile"
unit = "share"
description = "strength of the smile, 0 to 1"

[[controls]]
name = "openness"
column = "openness"
unit = "share"
description = "how far the mouth opens, 0 to 1"

[motion]
frames = 60
cyclic = false
root = "travelling"

# Expressions differ in strength rather than in timing: more knots would fit the difference.
[alignment]
knots = 3

[curves]
column = "curves"
range = [0.0, 1.0]
distance_cm = 2.0

[presets.laugh]
smile = 0.9
openness = 0.85

[presets.surprise]
smile = 0.1
openness = 0.9

[size]
rms_budget_cm = 0.02
"""

DECIMALS = 4
"""Decimals of the curves in their files."""


def write_family(output: Path, chosen: Iterable[FaceTrial] | None = None) -> Path:
    """Write trials to a directory atomically and return their recipe's path.

    chosen: trials; default: the family's 25. Raises FileError as `sample_files.write_folder` does.
    """
    files: dict[str, bytes] = {}
    rows = [["file", "curves", "smile", "openness"]]
    for number, each in enumerate(face_motion.trials() if chosen is None else chosen, start=1):
        motion, curves = f"bvh/face_{number:03}.bvh", f"curves/face_{number:03}.csv"
        files[motion] = bvh_writer.dumps(each.clip, metres_per_unit=1.0)
        files[curves] = curve_text(face_motion.CURVE_NAMES, each.clip.curve_values).encode()
        rows.append([motion, curves, f"{each.smile:.4f}", f"{each.openness:.4f}"])
    files |= {"clips.csv": clip_table.csv_text(rows).encode(), "recipe.toml": RECIPE.encode()}
    return sample_files.write_folder(output, files)


def curve_text(names: Sequence[str], values: Floats) -> str:
    """Return the CSV text of curves (F, C): frames from 0, and a column for each curve."""
    rows = [["frame", *names]]
    for frame, row in enumerate(values.tolist()):
        rows.append([str(frame), *(f"{value:.{DECIMALS}f}" for value in row)])
    return clip_table.csv_text(rows)
