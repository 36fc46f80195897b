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


def compare(discovery: Discovery, data: Path) -> list[dict[str, Any]]:
    """Return the errors of models of each action, cm. data: folder of the recordings."""
    return [_compare(discovery, action, data) for action in ACTIONS]


def _compare(discovery: Discovery, action: str, data: Path) -> dict[str, Any]:
    families = [one for one in discovery.families if one.action == action]
    family = max(families, key=lambda one: len(one.pairs))
    by_hand = [
        FamilyRow(cut.file, *cut.frames, discovery.performers[cut.file], Path(cut.file).stem)
        for cut in discovery.cuts
        if cut.action == action
    ]
    family_recipe, automatic = _read(family, family.rows, data)
    _, manual = _read(family, by_hand, data)
    errors: dict[str, list[tuple[float, float]]] = {"found": [], "by_hand": []}
    for performer in sorted({one.row.performer for one in manual}):
        held_out = [one for one in manual if one.row.performer == performer]
        for name, examples in (("found", automatic), ("by_hand", manual)):
            rest = [one for one in examples if one.row.performer != performer]
            errors[name] += _errors(family_recipe, rest, held_out)
    return {
        "action": action,
        "clips": {"found": len(automatic), "by_hand": len(manual)},
        "relative_cm": {name: 100.0 * _mean(families, 0) for name, families in errors.items()},
        "absolute_rms_cm": {name: 100.0 * _rms(families, 1) for name, families in errors.items()},
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
        family_recipe = recipe.read(path)
        examples, _ = ingest.ingest(family_recipe, data)
    return family_recipe, list(examples)


def _errors(
    family_recipe: Recipe, rest: Sequence[Example], held_out: Sequence[Example]
) -> list[tuple[float, float]]:
    """Return the relative mean and the absolute root mean square of each held-out clip, m."""
    trained = train_examples(family_recipe, rest)
    queries = Queries(np.stack([one.controls for one in held_out]), [{}] * len(held_out))
    predicted = predictions.predict_posefield(trained, queries)
    motion_errors_found = []
    for one, answer in zip(held_out, predicted, strict=True):
        captured = motion_errors.motion_of_clip(one.captured or one.clip, None)
        errors = motion_errors.compare_motions(answer, captured, ())
        motion_errors_found.append((errors.relative.mean, errors.absolute.rms))
    return motion_errors_found


def rows(models: Sequence[dict[str, Any]]) -> list[Row]:
    """Return how much farther models of found clips are than those of clips cut by hand."""
    table_rows = []
    for model in models:
        clips, errors = model["clips"], model["relative_cm"]
        more = 100.0 * (errors["found"] / errors["by_hand"] - 1.0)
        remark = "{found} clips, {by_hand} by hand; ".format(**clips)
        remark += "{found:.2f} cm, {by_hand:.2f} cm by hand".format(**errors)
        table_rows.append(
            Row(f"{model['action']}: error", more, "% more", remark, None, MOST_WORSE)
        )
    return table_rows


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder hdm05_long, unpacked")
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        discovery = discovered_families.discover(options.folder, Path(folder))
        families = discovered_families.rows(discovered_families.document(discovery))
        models = rows(compare(discovery, options.folder / "bvh"))
    print(table([*families, *models]))
    if options.record:
        command = "python benchmarks/found_models.py HDM05_LONG --record"
        record({"found_families": families, "found_models": models}, command, RESULTS)


if __name__ == "__main__":
    main(sys.argv[1:])
