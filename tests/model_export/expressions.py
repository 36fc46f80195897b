"""A family of faces of three performers and an unseen fourth, as files, with a head or without."""

from pathlib import Path

import numpy as np
from families import face_files, face_motion

from posefield.common.units import Floats
from posefield.motion import bvh_writer
from posefield_train.source.recipe import Recipe

RATE = 60.0
RAISED = {"a": 0.0, "b": 0.1, "d": 0.2, "cy": 0.25}
"""Value that is added to the curves in `OWN`, by performer."""
OWN = ("mouthFunnel", "browInnerUp")
"""Curves of `face_motion` by which the performers differ."""
HEADING = "file,curves,smile,openness,who"
POINTS = [(0.1 + 0.8 * i / 14, 0.1 + 0.8 * ((4 * i) % 15) / 14) for i in range(15)]
"""Controls of the clips, spread over the square."""


def values(who: str, smile: float, openness: float, shares: Floats) -> Floats:
    """Return the curves (F, 11) of a performer at shares (F,) of an expression."""
    found = face_motion.curve_values(smile, openness, shares)
    for name in OWN:
        found[:, face_motion.CURVE_NAMES.index(name)] += RAISED[who] * np.sin(np.pi * shares)
    return found


def recipe(alone: bool = False) -> Recipe:
    """Return the recipe of the family, whose clips are curves alone if told so."""
    plain = {
        "schema": 1,
        "name": "expressions",
        "description": "Expressions of several people",
        "licence": "CC0-1.0",
        "source": {"metres_per_unit": 1.0, "up": "y", "root_offset": "replace"},
        "clips": {"table": "clips.csv", "file": "curves" if alone else "file", "performer": "who"},
        "controls": [
            {"name": name, "column": name, "unit": "share", "description": name}
            for name in ("smile", "openness")
        ],
        "motion": {"frames": 40, "cyclic": False, "root": "travelling"},
        "alignment": {"knots": 3},
        "curves": {"rate": RATE} if alone else {"column": "curves"},
        "kriging": {"label": "performer", "covariance": "matern52", "drift": 1},
        "size": {"rms_budget_cm": 0.02},
    }
    return Recipe.model_validate(plain)


def write(folder: Path) -> Path:
    """Write the family's clips and clips.csv to a folder, and return it."""
    rows = [("abd"[i % 3], point) for i, point in enumerate(POINTS)]
    return _write(folder, rows, "clips.csv")


def write_newcomer(folder: Path, points: list[tuple[float, float]], who: str = "cy") -> Path:
    """Write a performer's clips, with their table, to a folder, and return the table."""
    _write(folder, [(who, point) for point in points], "cy.csv")
    return folder / "cy.csv"


def _write(folder: Path, rows: list[tuple[str, tuple[float, float]]], table: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    lines = [HEADING if table == "clips.csv" else HEADING.removesuffix(",who")]
    for index, (who, (smile, openness)) in enumerate(rows):
        clip = face_motion.expression(smile, openness)
        own = values(who, smile, openness, np.linspace(0.0, 1.0, len(clip)))
        motion, curves = f"{index}.bvh", f"{index}.curves.csv"
        (folder / motion).write_bytes(bvh_writer.dumps(clip, metres_per_unit=1.0))
        (folder / curves).write_text(face_files.curve_text(face_motion.CURVE_NAMES, own))
        more = [who] if table == "clips.csv" else []
        lines.append(",".join([motion, curves, f"{smile:.4f}", f"{openness:.4f}", *more]))
    (folder / table).write_text("\n".join(lines) + "\n")
    return folder
