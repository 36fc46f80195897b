"""Review of a folder of recipes: decisions are applied to its recipes, tables and summary."""

import json
import re
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from posefield.common import atomic_files
from posefield.common.errors import FileError, InvalidField, MotionError
from posefield_train.families import found_families, recipe_folder
from posefield_train.families.found_families import FamilyRow
from posefield_train.source import data_folder

DROP = re.compile(r"(\d+):(.+)@(\d+(?:\.\d+)?)")
MAX_DECISIONS_BYTES = 1_000_000


@dataclass(frozen=True)
class DroppedClip:
    """A clip of a family that is not trained from. at: a time within it, s."""

    family: int
    file: str
    at: float

    def __str__(self) -> str:
        return f"{self.family}:{self.file}@{self.at:g}"


@dataclass(frozen=True)
class Decisions:
    """Decisions by the numbers of families. merge: pairs, the second into the first."""

    accept: tuple[int, ...] = ()
    reject: tuple[int, ...] = ()
    merge: tuple[tuple[int, int], ...] = ()
    drop: tuple[DroppedClip, ...] = ()

    def numbers(self) -> Iterator[tuple[str, int]]:
        """Yield each number of a family with the decision that names it."""
        yield from (("accept", number) for number in self.accept)
        yield from (("reject", number) for number in self.reject)
        yield from (("merge", number) for pair in self.merge for number in pair)
        yield from (("drop", clip.family) for clip in self.drop)


def of_texts(
    accept: str | None, reject: str | None, merge: Sequence[str], drop: Sequence[str]
) -> Decisions:
    """Return the decisions of a command's options.

    accept, reject: numbers such as "1,2". merge: pairs such as "4,5". drop: clips such as
    "2:bd_1.bvh@33.2". Raises InvalidField for a text that is none, and for contradictions.
    """
    pairs = [_numbers("merge", text) for text in merge]
    if odd := next((text for text, pair in zip(merge, pairs, strict=True) if len(pair) != 2), None):
        raise InvalidField("merge", f"{odd!r}, expected two numbers of families, such as 4,5")
    accepted = _numbers("accept", accept) if accept else ()
    rejected = _numbers("reject", reject) if reject else ()
    clips = []
    for text in drop:
        match = DROP.fullmatch(text)
        if match is None:
            expected = "expected FAMILY:FILE@SECONDS, such as 2:bd_1.bvh@33.2"
            raise InvalidField("drop", f"{text!r}, {expected}")
        clips.append(DroppedClip(int(match[1]), match[2], float(match[3])))
    merged = tuple((pair[0], pair[1]) for pair in pairs)
    both = sorted(set(accepted) & set(rejected))
    if both:
        raise InvalidField("reject", f"{both[0]} is accepted too, expected one of both")
    seconds = [second for _, second in merged]
    for first, second in merged:
        if first == second or first in seconds or seconds.count(second) > 1:
            raise InvalidField("merge", f"{first},{second}: expected each family merged once")
        if second in accepted or second in rejected:
            fault = f"{second} goes into {first}, expected no other decision on it"
            raise InvalidField("merge", fault)
    return Decisions(accepted, rejected, merged, tuple(clips))


def read(path: Path) -> Decisions:
    """Return the decisions of a JSON file, which the page saves; FileError for another file."""
    try:
        decisions = json.loads(data_folder.read(path, MAX_DECISIONS_BYTES, "decisions"))
    except (ValueError, RecursionError) as fault:
        raise FileError(path, f"not JSON: {fault}") from fault
    if not isinstance(decisions, dict) or not set(decisions) <= {
        "accept",
        "reject",
        "merge",
        "drop",
    }:
        raise FileError(path, "expected an object of accept, reject, merge and drop")
    lists = {key: decisions.get(key, []) for key in ("accept", "reject", "merge", "drop")}
    if not all(isinstance(values, list) for values in lists.values()):
        raise FileError(path, "expected a list for each decision")
    return of_texts(
        ",".join(map(str, lists["accept"])),
        ",".join(map(str, lists["reject"])),
        [",".join(map(str, p)) if isinstance(p, list) else str(p) for p in lists["merge"]],
        [str(clip) for clip in lists["drop"]],
    )


def _numbers(field: str, text: str) -> tuple[int, ...]:
    if not re.fullmatch(r"\d{1,6}(\s*,\s*\d{1,6})*", text):
        raise InvalidField(field, f"{text!r}, expected numbers of families, such as 1,2")
    return tuple(dict.fromkeys(int(word) for word in text.split(",")))


MAX_FAMILIES_BYTES = 16_000_000
FORMER_KEY = ('\ntake = "take"\n', '\nrecording = "recording"\n')
"""Line of the recipes that an earlier version wrote, and the line in its place."""


@dataclass(frozen=True)
class ReviewedFolder:
    """Files of a folder of recipes while they are reviewed.

    data: folder of the recordings. facts: of the summary. texts: recipes by number. rows: by
    number.
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

    data: folder of the recordings; None for that of the search. The same decisions again change
    nothing. Raises InvalidField for a family or a clip that the folder does not have, and FileError
    for a folder that posefield discover did not write; no file is changed then.
    """
    reviewed = _read(folder, data)
    _check_numbers(reviewed, decisions)
    for clip in decisions.drop:
        _drop(reviewed, clip)
    for first, second in decisions.merge:
        if reviewed.family(second)["status"] != "merged":
            _merge(reviewed, first, second)
    for numbers, status in ((decisions.accept, "accepted"), (decisions.reject, "rejected")):
        for number in numbers:
            reviewed.family(number)["status"] = status
            reviewed.texts[number] = recipe_folder.with_accepted(
                reviewed.texts[number], status == "accepted"
            )
    _write(folder, reviewed)
    return reviewed.facts


def _read(folder: Path, data: Path | None) -> ReviewedFolder:
    path = folder / recipe_folder.SUMMARY
    if not path.is_file():
        raise FileError(folder, f"no {path.name}, expected a folder that posefield discover wrote")
    try:
        facts = json.loads(data_folder.read(path, MAX_FAMILIES_BYTES, "a summary of families"))
        if "takes" in facts:
            facts["recordings"] = facts.pop("takes")
        numbers = [one["number"] for one in facts["families"] if one["status"] != "merged"]
    except (ValueError, KeyError, TypeError, RecursionError) as fault:
        raise FileError(path, f"not a summary of posefield discover: {fault}") from fault
    texts, rows = {}, {}
    for number in numbers:
        name = recipe_folder.family_name(number)
        content = data_folder.read(folder / f"{name}.toml", MAX_FAMILIES_BYTES, "a recipe")
        texts[number] = content.decode(errors="strict").replace(*FORMER_KEY)
        rows[number] = found_families.read(folder / f"{name}.csv")
    return ReviewedFolder(data or Path(facts["folder"]), facts, texts, rows)


def _check_numbers(reviewed: ReviewedFolder, decisions: Decisions) -> None:
    """Raise InvalidField for a family that is unknown, or was merged by another decision."""
    merged = {one["number"]: one.get("into") for one in reviewed.facts["families"]}
    again = {second for first, second in decisions.merge if merged.get(second) == first}
    for field, number in decisions.numbers():
        if number not in reviewed.texts and number not in again:
            into = merged.get(number)
            gone = f", which was merged into {into}" if into else ""
            numbers = ", ".join(map(str, reviewed.texts))
            raise InvalidField(field, f"family {number}{gone}, expected one of {numbers}")


def _drop(reviewed: ReviewedFolder, clip: DroppedClip) -> None:
    # A family that the same decisions merged before has its clips in the other one.
    number = reviewed.family(clip.family).get("into", clip.family)
    recordings, rows = reviewed.facts["recordings"], reviewed.rows[number]
    indices = [
        at
        for at, row in enumerate(rows)
        if (row.file == clip.file or row.file.endswith(f"/{clip.file}"))
        and row.first_frame <= clip.at * recordings[row.file]["rate"] <= row.last_frame
    ]
    if len(indices) != 1:
        starts = [
            f"{row.file}@{row.first_frame / recordings[row.file]['rate']:.1f}" for row in rows
        ]
        examples = ", ".join(starts[:8]) + (" and others" if len(starts) > 8 else "")
        what = f"{len(indices)} clips at {clip}" if indices else f"no clip at {clip}"
        raise InvalidField("drop", f"{what}, expected one of {examples}")
    rows[indices[0]] = replace(rows[indices[0]], accepted=False)


def _merge(reviewed: ReviewedFolder, first: int, second: int) -> None:
    into, gone = reviewed.family(first), reviewed.family(second)
    if into["kind"] != gone["kind"]:
        said = f"{first} are {into['kind']} and {second} {gone['kind']}, expected the same"
        raise InvalidField("merge", said)
    frames = {row.frames for row in reviewed.rows[first]}
    new_rows = [row for row in reviewed.rows.pop(second) if row.frames not in frames]
    reviewed.rows[first] += new_rows
    reviewed.texts.pop(second)
    into["performers"] = sorted({row.performer for row in reviewed.rows[first]})
    rates = {
        file: float(recording["rate"]) for file, recording in reviewed.facts["recordings"].items()
    }
    spans = [(row.last_frame - row.first_frame) / rates[row.file] for row in reviewed.rows[first]]
    into["seconds"] = round(statistics.median(spans), 3)
    into["left_out"] |= gone["left_out"]
    evidence = f"Family {second} was merged into it: {gone['clips']} clips"
    if gone["within"] is not None:
        evidence += (
            f", which differ by {gone['within']:.1%} of all motion; {gone['shared']:.0%} of their "
            "motion is common"
        )
    text = recipe_folder.with_merged(
        reviewed.texts[first],
        recipe_folder.clips_text(
            len(reviewed.rows[first]), len(into["performers"]), into["seconds"]
        ),
        f"{evidence}.",
    )
    draft = re.sub('^licence = ""$', 'licence = "not stated yet"', text, count=1, flags=re.M)
    name = recipe_folder.family_name(first)
    try:
        proposal = recipe_folder.propose(
            draft, name, reviewed.rows[first], reviewed.data, into["roles"]
        )
    except (MotionError, ValueError) as fault:
        said = f"the clips of {first} and those merged into it make no family: {fault}"
        raise InvalidField("merge", said) from fault
    reviewed.texts[first] = recipe_folder.with_proposal(
        text, recipe_folder.proposal_lines(proposal, into["roles"])
    )
    into |= recipe_folder.proposal_facts(proposal)
    into["clips"] = len(reviewed.rows[first])
    gone |= {"status": "merged", "into": first}


def _write(folder: Path, reviewed: ReviewedFolder) -> None:
    for number, text in reviewed.texts.items():
        name = recipe_folder.family_name(number)
        atomic_files.write(text.encode(), folder / f"{name}.toml")
        atomic_files.write(found_families.table(reviewed.rows[number]), folder / f"{name}.csv")
    for one in reviewed.facts["families"]:
        if one["status"] == "merged":
            for ending in ("toml", "csv"):
                name = recipe_folder.family_name(one["number"])
                (folder / f"{name}.{ending}").unlink(missing_ok=True)
    # The summary is last: a review that was interrupted is repeated.
    atomic_files.write(recipe_folder.json_bytes(reviewed.facts), folder / recipe_folder.SUMMARY)
