"""Review of a folder of recipes: decisions are applied to its recipes, tables and summary."""

import json
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from posefield.common import atomic_files
from posefield.common.errors import FileError, InvalidField, MotionError
from posefield_train.discover.control_proposals import ControlProposal
from posefield_train.families import (
    family_controls,
    family_recipe,
    family_table,
    recipe_folder,
)
from posefield_train.families.decisions import Decisions, DroppedClip
from posefield_train.families.family_table import FamilyRow
from posefield_train.source import data_folder

MOST_BYTES = 16_000_000


@dataclass(frozen=True)
class ReviewedFolder:
    """Files of a folder of recipes while they are reviewed.

    data: folder of the takes. facts: of the summary. texts: recipes by number. rows: by number.
    """

    data: Path
    facts: dict[str, Any]
    texts: dict[int, str]
    rows: dict[int, list[FamilyRow]]

    def family(self, number: int) -> dict[str, Any]:
        """Return the facts of a family."""
        return next(one for one in self.facts["families"] if one["number"] == number)


def apply(folder: Path, decisions: Decisions, data: Path | None = None) -> dict[str, Any]:
    """Write decisions into the files of a folder of recipes and return its summary.

    data: folder of the takes; None for that of the search. The same decisions again change nothing.
    Raises InvalidField for a family or a clip that the folder does not have, and FileError for a
    folder that posefield discover did not write; no file is changed then.
    """
    own = _read(folder, data)
    _check_numbers(own, decisions)
    for clip in decisions.drop:
        _drop(own, clip)
    for first, second in decisions.merge:
        if own.family(second)["status"] != "merged":
            _merge(own, first, second)
    for numbers, status in ((decisions.accept, "accepted"), (decisions.reject, "rejected")):
        for number in numbers:
            own.family(number)["status"] = status
            own.texts[number] = family_recipe.with_accepted(own.texts[number], status == "accepted")
    _write(folder, own)
    return own.facts


def _read(folder: Path, data: Path | None) -> ReviewedFolder:
    path = folder / recipe_folder.SUMMARY
    if not path.is_file():
        raise FileError(folder, f"no {path.name}, expected a folder that posefield discover wrote")
    try:
        facts = json.loads(data_folder.read(path, MOST_BYTES, "a summary of families"))
        numbers = [one["number"] for one in facts["families"] if one["status"] != "merged"]
    except (ValueError, KeyError, TypeError, RecursionError) as fault:
        raise FileError(path, f"not a summary of posefield discover: {fault}") from fault
    texts, rows = {}, {}
    for number in numbers:
        name = recipe_folder.family_name(number)
        found = data_folder.read(folder / f"{name}.toml", MOST_BYTES, "a recipe")
        texts[number] = found.decode(errors="strict")
        rows[number] = family_table.read(folder / f"{name}.csv")
    return ReviewedFolder(data or Path(facts["folder"]), facts, texts, rows)


def _check_numbers(own: ReviewedFolder, decisions: Decisions) -> None:
    """Raise InvalidField for a family that is unknown, or was merged by another decision."""
    merged = {one["number"]: one.get("into") for one in own.facts["families"]}
    again = {second for first, second in decisions.merge if merged.get(second) == first}
    for field, number in decisions.numbers():
        if number not in own.texts and number not in again:
            into = merged.get(number)
            gone = f", which was merged into {into}" if into else ""
            known = ", ".join(map(str, own.texts))
            raise InvalidField(field, f"family {number}{gone}, expected one of {known}")


def _drop(own: ReviewedFolder, clip: DroppedClip) -> None:
    """Mark the clip of a family that a file and a time name as not accepted."""
    # A family that the same decisions merged before has its clips in the other one.
    number = own.family(clip.family).get("into", clip.family)
    takes, rows = own.facts["takes"], own.rows[number]
    found = [
        at
        for at, row in enumerate(rows)
        if (row.file == clip.file or row.file.endswith(f"/{clip.file}"))
        and row.first_frame <= clip.at * takes[row.file]["rate"] <= row.last_frame
    ]
    if len(found) != 1:
        starts = [f"{row.file}@{row.first_frame / takes[row.file]['rate']:.1f}" for row in rows]
        known = ", ".join(starts[:8]) + (" and others" if len(starts) > 8 else "")
        what = f"{len(found)} clips at {clip}" if found else f"no clip at {clip}"
        raise InvalidField("drop", f"{what}, expected one of {known}")
    rows[found[0]] = replace(rows[found[0]], accepted=False)


def _merge(own: ReviewedFolder, first: int, second: int) -> None:
    """Move the clips of a family into another, and propose its event and controls again."""
    into, gone = own.family(first), own.family(second)
    if into["kind"] != gone["kind"]:
        said = f"{first} are {into['kind']} and {second} {gone['kind']}, expected the same"
        raise InvalidField("merge", said)
    known = {row.frames for row in own.rows[first]}
    moved = [row for row in own.rows.pop(second) if row.frames not in known]
    own.rows[first] += moved
    own.texts.pop(second)
    into["performers"] = sorted({row.performer for row in own.rows[first]})
    into["seconds"] = _median_seconds(own, first)
    into["left_out"] |= gone["left_out"]
    text = family_recipe.with_merged(
        own.texts[first],
        family_recipe.clips_text(len(own.rows[first]), len(into["performers"]), into["seconds"]),
        _merged_text(gone),
    )
    found = _propose(own, first, text)
    own.texts[first] = family_recipe.with_proposal(
        text, family_recipe.proposal_lines(found, into["roles"])
    )
    into |= recipe_folder.proposal_facts(found)
    into["clips"] = len(own.rows[first])
    gone |= {"status": "merged", "into": first}


def _median_seconds(own: ReviewedFolder, number: int) -> float:
    rates = {file: float(take["rate"]) for file, take in own.facts["takes"].items()}
    spans = [(row.last_frame - row.first_frame) / rates[row.file] for row in own.rows[number]]
    return round(statistics.median(spans), 3)


def _merged_text(gone: Mapping[str, Any]) -> str:
    """Return the evidence on a family that is merged into another."""
    said = f"Family {gone['number']} was merged into it: {gone['clips']} clips"
    if gone["within"] is None:
        return f"{said}."
    return (
        f"{said}, which differ by {gone['within']:.1%} of all motion; {gone['shared']:.0%} of "
        "their motion is common."
    )


def _propose(own: ReviewedFolder, number: int, text: str) -> ControlProposal:
    name = recipe_folder.family_name(number)
    rows: Sequence[FamilyRow] = own.rows[number]
    draft = family_recipe.with_licence(text, "not stated yet")
    try:
        return family_controls.propose(draft, name, rows, own.data)
    except (MotionError, ValueError) as fault:
        said = f"the clips of {number} and those merged into it make no family: {fault}"
        raise InvalidField("merge", said) from fault


def _write(folder: Path, own: ReviewedFolder) -> None:
    for number, text in own.texts.items():
        name = recipe_folder.family_name(number)
        atomic_files.write(text.encode(), folder / f"{name}.toml")
        atomic_files.write(family_table.table(own.rows[number]), folder / f"{name}.csv")
    for one in own.facts["families"]:
        if one["status"] == "merged":
            for ending in ("toml", "csv"):
                name = recipe_folder.family_name(one["number"])
                (folder / f"{name}.{ending}").unlink(missing_ok=True)
    # The summary is last: a review that was interrupted is repeated.
    atomic_files.write(recipe_folder.json_bytes(own.facts), folder / recipe_folder.SUMMARY)
