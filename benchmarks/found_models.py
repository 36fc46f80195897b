"""Families that are found in hdm05_long, and their models against models of clips cut by hand.

Both models have the recipe of the found family. Each is trained without one performer and asked
for all clips of that performer as they were cut by hand.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import discovered_families
import numpy as np
from discovered_families import Discovery, JudgedFamily
from rows import Row, record, table

from posefield_train.evaluate import motion_errors, predictions
from posefield_train.evaluate.predictions import Queries
from posefield_train.families import found_families, recipe_folder
from posefield_train.families.found_families import FamilyRow
from posefield_train.source import ingest, recipe
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.training import train_examples

RESULTS = Path(__file__).resolve().parents[1] / "docs/results"
ACTIONS = ("grabHighR", "depositFloorR", "kickLFront1Reps")
MOST_WORSE = 5.0
"""Percent that a model of found clips may be worse."""


def compare(found: Discovery, data: Path) -> list[dict[str, Any]]:
    """Return the errors of models of each action, cm. data: folder of the recordings."""
    return [_compare(found, action, data) for action in ACTIONS]


def _compare(found: Discovery, action: str, data: Path) -> dict[str, Any]:
    own = [one for one in found.families if one.action == action]
    family = max(own, key=lambda one: len(one.pairs))
    by_hand = [
        FamilyRow(cut.file, *cut.frames, found.performers[cut.file], Path(cut.file).stem)
        for cut in found.cuts
        if cut.action == action
    ]
    told, automatic = _read(family, family.rows, data)
    _, manual = _read(family, by_hand, data)
    errors: dict[str, list[tuple[float, float]]] = {"found": [], "by_hand": []}
    for performer in sorted({one.row.performer for one in manual}):
        held = [one for one in manual if one.row.performer == performer]
        for name, examples in (("found", automatic), ("by_hand", manual)):
            rest = [one for one in examples if one.row.performer != performer]
            errors[name] += _errors(told, rest, held)
    return {
        "action": action,
        "clips": {"found": len(automatic), "by_hand": len(manual)},
        "relative_cm": {name: 100.0 * _mean(own, 0) for name, own in errors.items()},
        "absolute_rms_cm": {name: 100.0 * _rms(own, 1) for name, own in errors.items()},
    }


def _mean(errors: Sequence[tuple[float, float]], column: int) -> float:
    return float(np.mean(np.array(errors)[:, column]))


def _rms(errors: Sequence[tuple[float, float]], column: int) -> float:
    return float(np.sqrt(np.mean(np.square(np.array(errors)[:, column]))))


def _read(
    family: JudgedFamily, rows: Sequence[FamilyRow], data: Path
) -> tuple[Recipe, list[Example]]:
    """Return the recipe of a family and the examples of a table's rows."""
    text = recipe_folder.with_accepted(family.recipe.read_text(encoding="utf-8"), True)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / family.recipe.name
        path.write_text(text, encoding="utf-8")
        path.with_suffix(".csv").write_bytes(found_families.table(rows))
        own = recipe.read(path)
        examples, _ = ingest.ingest(own, data)
    return own, list(examples)


def _errors(
    told: Recipe, rest: Sequence[Example], held: Sequence[Example]
) -> list[tuple[float, float]]:
    """Return the relative mean and the absolute root mean square of each held-out clip, m."""
    trained = train_examples(told, rest)
    asked = Queries(np.stack([one.controls for one in held]), [{}] * len(held))
    made = predictions.predict_posefield(trained, asked)
    found = []
    for one, answer in zip(held, made, strict=True):
        captured = motion_errors.motion_of_clip(one.captured or one.clip, None)
        errors = motion_errors.compare_motions(answer, captured, ())
        found.append((errors.relative.mean, errors.absolute.rms))
    return found


def rows(models: Sequence[dict[str, Any]]) -> list[Row]:
    """Return how much farther models of found clips are than those of clips cut by hand."""
    found = []
    for model in models:
        clips, errors = model["clips"], model["relative_cm"]
        more = 100.0 * (errors["found"] / errors["by_hand"] - 1.0)
        remark = "{found} clips, {by_hand} by hand; ".format(**clips)
        remark += "{found:.2f} cm, {by_hand:.2f} cm by hand".format(**errors)
        found.append(Row(f"{model['action']}: error", more, "% more", remark, None, MOST_WORSE))
    return found


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder hdm05_long, unpacked")
    parser.add_argument("--record", action="store_true")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as made:
        found = discovered_families.discover(given.folder, Path(made))
        families = discovered_families.rows(discovered_families.document(found))
        models = rows(compare(found, given.folder / "bvh"))
    print(table([*families, *models]))
    if given.record:
        command = "python benchmarks/found_models.py HDM05_LONG --record"
        record({"found_families": families, "found_models": models}, command, RESULTS)


if __name__ == "__main__":
    main(sys.argv[1:])
