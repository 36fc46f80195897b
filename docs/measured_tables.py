"""Tables of figures that a command has measured and written to a file of docs/results.

Files of `speed` hold rows as benchmarks/rows.py writes them; `models.json` is by
docs/measure_models.py. Each file names the command, the date and the machine of its figures.
"""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "results"
SPEED_COLUMNS = ["subject", "value", "baseline", "ratio", "goal"]
RECIPE_COLUMNS = [
    "recipe",
    "clips",
    "file",
    "motion is stored in",
    "truncation cost, cm",
    "distance of a left-out clip, cm",
]
LEVEL_COLUMNS = [
    "level",
    "ranks",
    "clips used",
    "numbers",
    "multiply-adds per pose",
    "error (RMS)",
    "worst pose",
    "below a pixel from",
]
STRIDE_COLUMNS = [
    "speed, m/s",
    "pelvis range, cm",
    "pelvis, mean height, cm",
    "knee, straightest",
    "sole below the floor, cm",
    "peak of a leg, m/s²",
    "skate, cm/s",
]
GAIT_COLUMNS = [
    "method",
    "joints, degrees",
    "worst gait, degrees",
    "bodies, cm",
    "travel, cm/s",
    "turn, degrees/s",
]
PIXELS, FIELD = 1080, math.pi / 3.0
"""Height of the image, pixels, and vertical field of view, rad, for the distance of a level."""
LEVELS_OF = "cmu_walk"
JUDGED_COLUMNS = ["figure", "value", "must", "wish", "remark"]
WISHES = {
    "target_frames": {f"{rate} frames a second": 0.1 for rate in (24, 30, 60)},
    "joins": {
        "slide of standing feet": 0.2,
        "pelvis lowered": 2.0,
        "hdm05_grab_high, 25 joins: peak over the real one": 1.3,
        "cmu_walk, 69 joins: peak over the real one": 1.0,
    },
    "discovered": {
        "strides: missed": 0.0,
        "one example: missed by the best R": 5.0,
        "processor time of reading and features": 10.0,
    },
    "found_families": {"clips of families: wrong": 5.0, "all actions: cuts missed": 5.0},
    "robot_faults": {
        "go_bdx, with robot: broken, missed": 1.0,
        "biped, with robot: broken, missed": 1.0,
    },
    "robot_gaits": {
        "tenths: joints": 0.6,
        "measured tenths: joints": 0.6,
        "command tracked": 0.5,
        "seam": 1e-7,
        "skate": 0.2,
        "penetration": 0.5,
        "beyond limits": 0.0,
        "evaluator, angles": 1e-6,
        "evaluator, sigma": 1e-6,
        "factor between error and sigma": 1.1,
        "4,096 environments, a step": 2.0,
        "4,096 environments, a step with eight new commands": 2.0,
    },
    "scaled": {
        "92 clips: processor time": 8.0,
        "2,000 clips: distance to the truth": 0.4,
        "2,000 clips: error of new clips over sigma": 1.2,
        **{f"{clips} clips: file": 200.0 for clips in ("300", "1,000", "2,000")},
    },
}
"""Wishes for figures by table, and by their name or the part of it after the subject."""
VERDICTS = {True: "met", False: "**missed**", None: "not measured yet"}
"""Words for a goal that is met, missed, or whose row has no value."""
Rows = Iterator[list[str]]
Found = dict[str, Any]


def read(name: str) -> Found:
    """Return the content of a file of docs/results."""
    found: Found = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return found


def exists(table: str) -> bool:
    """Return whether a table of speed is measured; all others are."""
    return not table.startswith("speed/") or (FOLDER / f"{table}.json").exists()


def origin(name: str) -> str:
    """Return a sentence on the command, the date and the machine of a file's figures."""
    found = read(name)
    return f"Measured by `{found['command']}`, {found['date']}. Machine: {found['machine']}."


def speed(name: str) -> Rows:
    """Yield the rows of a benchmark; a subject or baseline that is repeated is left out."""
    before = ""
    for row in read(name)["rows"]:
        subject = "the same" if row["name"] == before else row["name"]
        value = "" if subject != row["name"] else _value(row)
        yield [subject, value, row["baseline"], _ratio(row), _goal(row)]
        before = row["name"]


def recipes() -> Rows:
    """Yield size and errors of each model."""
    for own in read("models")["models"]:
        yield [
            f"`{own['name']}`",
            f"{own['clips']}",
            f"{own['bytes'] / 1000:.0f} kB",
            f"1/{own['compression']:.0f} of its numbers",
            f"{100 * own['truncation_rms_m']:.2f} ({100 * own['truncation_p99_m']:.1f})",
            f"{100 * own['leave_one_out_rms_m']:.1f}",
        ]


def gaits(trial: str) -> Rows:
    """Yield the errors of each method on the gaits of a robot that are left out together."""
    for row in read("robot_gaits")["trials"][trial]["methods"]:
        keys = ("joints_deg", "worst_gait_deg", "bodies_cm", "speed_cm_s", "turn_deg_s")
        yield [row["method"], *(f"{row[key]:.2f}" for key in keys)]


def levels() -> Rows:
    """Yield the levels of detail of one model."""
    (own,) = [each for each in read("models")["models"] if each["name"] == LEVELS_OF]
    for number, level in enumerate(own["levels"]):
        far = level["pose"] * PIXELS / (2.0 * math.tan(0.5 * FIELD))
        yield [
            f"{number}",
            " × ".join(map(str, level["ranks"])),
            f"{level['samples']}",
            f"{level['numbers']:,}",
            f"{level['operations']:,}",
            f"{100 * level['rms']:.2f} cm",
            f"{100 * level['pose']:.1f} cm",
            f"{far:.0f} m",
        ]


def stride_speeds() -> Rows:
    """Yield the measures of straight strides by speed: predicted, standing, captured."""
    for own in read("strides")["speeds"]:
        kinds = [own["clip predicted"], own["clip standing"], own["captured"]]
        cells = [
            ", ".join(f"{kind[name]:.{digits}f}" for kind in kinds)
            for name, digits in (
                ("range", 1),
                ("height", 1),
                ("knee", 0),
                ("sole", 1),
                ("peak", 0),
                ("skate", 1),
            )
        ]
        yield [f"{own['speed']:g} ({own['strides']})", *cells]


def _value(row: Found) -> str:
    if row["value"] is None:
        return ""
    others = [number(value) for value in row.get("other_runs", []) if row["ratio"] is None]
    text = f"{number(row['value'])} {row['unit']}"
    return f"{text} ({' and '.join(others)} in other runs)" if others else text


def _ratio(row: Found) -> str:
    if row["ratio"] is None:
        return ""
    others = [number(value) for value in row.get("other_runs", [])]
    text = number(row["ratio"])
    return f"{text} ({' and '.join(others)} in other runs)" if others else text


def _goal(row: Found) -> str:
    if row["goal"] is None:
        return ""
    unit = row["unit"] if row["ratio"] is None else "times"
    goal = " ".join(filter(None, [number(row["goal"]), unit]))
    return f"{goal}, {VERDICTS[row['met']]}"


def number(value: float) -> str:
    """Return a number with three significant digits, and groups of thousands."""
    return f"{float(f'{value:.3g}'):,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def judged(table: str) -> Rows:
    """Yield figures with a value that they must have and one that is wished for."""
    wishes = WISHES.get(table, {})
    for row in read(table)["rows"]:
        wish = row.get("wish", wishes.get(row["name"], wishes.get(row["name"].partition(": ")[2])))
        value = f"{number(row['value'])} {row['unit']}"
        limits = [_limit(row, most) for most in (row["goal"], wish)]
        yield [row["name"], value, *limits, row["baseline"]]


def _limit(row: Found, most: float | None) -> str:
    """Return the most that a figure may be, and whether it is no more; empty without one."""
    if most is None:
        return ""
    verdict = "met" if row["value"] <= most else "**missed**"
    return f"{number(most)} {row['unit']}, {verdict}"
