"""Families that `posefield discover` offers, against the cuts of long recordings by hand.

The action of a family is that of most of its clips. A clip is right if it has half of its time in
common with a cut of the family's action. Strides are no action of these takes and are left out.
"""

import json
import resource
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import hand_cuts
import numpy as np
from hand_cuts import HandCut
from rows import Row

from posefield_train.discover.motion_features import Span
from posefield_train.discover.recordings import Recording, read_recordings
from posefield_train.families import found_families
from posefield_train.families.found_families import FamilyRow

COMMAND = Path(sys.executable).with_name("posefield")
LICENCE = "CC BY-SA 3.0, HDM05 (Universit\u00e4t Bonn)"
Found = dict[str, Any]


@dataclass(frozen=True)
class JudgedFamily:
    """An offered family. recipe: its file. action: of most of its clips. pairs: each right clip
    with its cut."""

    recipe: Path
    rows: tuple[FamilyRow, ...]
    action: str
    pairs: tuple[tuple[Span, HandCut], ...]


@dataclass(frozen=True)
class Discovery:
    """Families of recordings with their cuts. performers: by file, as they were told. seconds:
    processor time of the command."""

    recordings: tuple[Recording, ...]
    cuts: tuple[HandCut, ...]
    families: tuple[JudgedFamily, ...]
    performers: dict[str, str]
    seconds: float


def discover(folder: Path, output: Path) -> Discovery:
    """Return the families of hdm05_long. made: folder for the recipes."""
    before = _seconds()
    words = [COMMAND, "discover", folder / "bvh", "-o", output, "--licence", LICENCE]
    subprocess.run(words, check=True, capture_output=True)
    seconds = _seconds() - before
    recordings = read_recordings(folder / "bvh").recordings
    cuts = hand_cuts.read(folder, recordings)
    facts = json.loads((output / "discover.json").read_text(encoding="utf-8"))
    names = [one["number"] for one in facts["families"] if one["kind"] == "motions"]
    paths = [output / f"family_{number:02d}.toml" for number in names]
    families = [judge(path, recordings, cuts) for path in paths]
    performers = {file: fact["performer"] for file, fact in facts["recordings"].items()}
    return Discovery(tuple(recordings), tuple(cuts), tuple(families), performers, seconds)


def _seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def judge(recipe: Path, recordings: Sequence[Recording], cuts: Sequence[HandCut]) -> JudgedFamily:
    """Return an offered family with its action and its right clips."""
    files = {recording.file: (at, recording.rate) for at, recording in enumerate(recordings)}
    rows = found_families.read(recipe.with_suffix(".csv"))
    spans = []
    for row in rows:
        at, rate = files[row.file]
        spans.append(Span(at, row.first_frame / rate, row.last_frame / rate))
    matches = [hand_cuts.same_cuts(span, cuts) for span in spans]
    counted = Counter(cut.action for match in matches for cut in match)
    action = counted.most_common(1)[0][0] if counted else ""
    pairs = [
        (span, cut)
        for span, match in zip(spans, matches, strict=True)
        for cut in match
        if cut.action == action
    ]
    return JudgedFamily(recipe, tuple(rows), action, tuple(pairs))


def document(discovery: Discovery) -> Found:
    """Return counts by action and in all, distances of the ends, and the processor time."""
    actions = sorted({cut.action for cut in discovery.cuts})
    return {
        "minutes": sum((len(recording) - 1) / recording.rate for recording in discovery.recordings)
        / 60.0,
        "seconds": discovery.seconds,
        "performers": len(set(discovery.performers.values())),
        "actions": [{"action": action, **_counts_of(discovery, action)} for action in actions],
        "all": counts(discovery.families, discovery.cuts),
        "ends": ends(discovery.families),
    }


def rows(document: Found) -> list[Row]:
    """Return shares of wrong clips and missed cuts, distances of ends and processor time."""
    counts, minutes = document["all"], document["minutes"]
    end_points = {name: round(seconds, 3) for name, seconds in document["ends"].items()}
    wrong = 100.0 * (1.0 - counts["right"] / counts["clips"])
    table_rows = [
        ("clips of families: wrong", wrong, "%", f"of {counts['clips']}", 10.0),
        _missed("all actions", counts, 20.0),
        *(_missed(action["action"], action, None) for action in document["actions"]),
        ("ends from those of the cuts", end_points["median"], "s", "median", None),
        (
            "the same but for the median of a family",
            end_points["convention_median"],
            "s",
            "median",
            0.1,
        ),
        ("its worst tenth", end_points["convention_p90"], "s", "90th percentile", 0.3),
        (
            "processor time",
            document["seconds"],
            "s",
            f"{minutes:.1f} minutes of recordings",
            5 * minutes,
        ),
    ]
    return [
        Row(name, value, unit, remark, None, goal) for name, value, unit, remark, goal in table_rows
    ]


def _missed(
    action: str, counts: dict[str, int], goal: float | None
) -> tuple[str, float, str, str, float | None]:
    share = 100.0 * (1.0 - counts["found"] / counts["cuts"])
    remark = f"of {counts['cuts']}; {counts['families']} families of {counts['clips']} clips"
    return f"{action}: cuts missed", share, "%", remark, goal


def _counts_of(discovery: Discovery, action: str) -> dict[str, int]:
    return counts(
        [one for one in discovery.families if one.action == action],
        [cut for cut in discovery.cuts if cut.action == action],
    )


def counts(families: Sequence[JudgedFamily], cuts: Sequence[HandCut]) -> dict[str, int]:
    """Return the numbers of families, of their clips, of the right ones, of cuts, of found cuts."""
    return {
        "families": len(families),
        "clips": sum(len(one.rows) for one in families),
        "right": sum(len({span for span, _ in one.pairs}) for one in families),
        "cuts": len(cuts),
        "found": len({cut for one in families for _, cut in one.pairs}),
    }


def ends(families: Sequence[JudgedFamily]) -> dict[str, float]:
    """Return how far first and last frames of clips lie from those of their cuts, s.

    convention: without the median of each family, since a person begins and ends the clips of an
    action where they choose to.
    """
    signed = [
        np.array(
            [(one.start - cut.span.start, one.end - cut.span.end) for one, cut in family.pairs]
        )
        for family in families
        if family.pairs
    ]
    all_values = np.abs(np.concatenate(signed))
    rest = np.abs(
        np.concatenate([differences - np.median(differences, axis=0) for differences in signed])
    )
    return {
        "median": float(np.median(all_values)),
        "p90": float(np.percentile(all_values, 90)),
        "convention_median": float(np.median(rest)),
        "convention_p90": float(np.percentile(rest, 90)),
    }
