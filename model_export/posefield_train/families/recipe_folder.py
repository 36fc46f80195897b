"""Folder of recipes: the families of a folder of takes, each with its recipe and its table."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import posefield
from posefield.common import atomic_files
from posefield.common.errors import FileError, MotionError
from posefield_train.discover import family_quality, family_search
from posefield_train.discover.control_proposals import ControlProposal
from posefield_train.discover.take_reading import ReadTakes
from posefield_train.families import (
    family_controls,
    family_recipe,
    family_table,
    mixed_bodies,
)
from posefield_train.families.body_kinds import BodyKind
from posefield_train.families.family_recipe import RecipeFacts
from posefield_train.families.found_families import FoundFamily
from posefield_train.source.motion_readers import MotionFiles

SUMMARY, PAGE = "discover.json", "index.html"
OWN_FILES = re.compile(r"family_\d{2,}\.(toml|csv)|discover\.json|index\.html|decisions\.json")
"""Names of the files of a folder of recipes."""


@dataclass(frozen=True)
class OfferedFamily:
    """A family with its recipe. number: from 1. facts: of the recipe. text: the recipe."""

    number: int
    family: FoundFamily
    facts: RecipeFacts
    proposal: ControlProposal
    text: str

    @property
    def name(self) -> str:
        """Return the name of its files."""
        return self.facts.name


@dataclass(frozen=True)
class FoundFamilies:
    """Families of a folder. refused: those that are not offered, with their reasons."""

    offered: tuple[OfferedFamily, ...]
    refused: tuple[FoundFamily, ...]


def offer(
    found: Sequence[FoundFamily], data: Path, licence: str, known: MotionFiles | None = None
) -> FoundFamilies:
    """Return the families with recipes, in the order found, numbered from 1.

    data: folder of the takes. known: files that were read before. A family whose clips cannot be
    read together, or that no control predicts, is refused with the reason.
    """
    offered: list[OfferedFamily] = []
    refused = []
    for family in found:
        if family.reasons:
            refused.append(family)
            continue
        facts = _facts(family, len(offered) + 1, licence)
        draft = replace(facts, licence="not stated yet")
        text = family_recipe.recipe_text(draft, family_recipe.PLACEHOLDER)
        try:
            proposal = family_controls.propose(text, facts.name, family.rows, data, known)
        except (MotionError, ValueError) as fault:
            refused.append(replace(family, reasons=(str(fault),)))
            continue
        told = family_recipe.recipe_text(facts, proposal)
        offered.append(OfferedFamily(len(offered) + 1, family, facts, proposal, told))
    return FoundFamilies(tuple(offered), tuple(refused))


def _facts(family: FoundFamily, number: int, licence: str) -> RecipeFacts:
    kind, own = family.kinds[0], family.kinds
    is_mixed = len(own) > 1
    performers = {row.performer for row in family.rows}
    what = "Strides" if family.kind == "strides" else "Similar motions"
    evidence = [family_recipe.clips_text(len(family.rows), len(performers), family.seconds)]
    if family.quality is not None:
        evidence.append(
            f"The clips differ by {family.quality.within:.1%} of all motion; "
            f"{family.quality.shared:.0%} of the family's motion is common to them."
        )
    return RecipeFacts(
        family_name(number),
        f"{what} found in long takes, family {number}",
        licence,
        mixed_bodies.shared_report(kind.report, own) if is_mixed else kind.report,
        family.kind == "strides",
        len(performers) > 1,
        tuple(evidence),
        tuple(mixed_bodies.skeleton_lines(own)) if is_mixed else (),
    )


def summary(
    found: FoundFamilies, folder: Path, read: ReadTakes, kinds: Sequence[BodyKind], count: int
) -> dict[str, Any]:
    """Return all that was found as JSON values. count: of candidates that were searched."""
    performers = {file: who for kind in kinds for file, who in kind.performers.items()}
    return {
        "folder": folder.as_posix(),
        "versions": {"posefield": posefield.__version__},
        "parameters": {
            "candidates": count,
            "largest_cost": family_search.LARGEST_COST,
            "fewest_clips": family_search.FEWEST,
            "most_within": family_quality.MOST_WITHIN,
            "least_shared": family_quality.LEAST_SHARED,
        },
        "takes": {
            take.file: {"rate": take.rate, "frames": len(take), "performer": performers[take.file]}
            for take in read.takes
        },
        "refused": read.refused,
        "notes": read.notes,
        "families": [_offered_facts(one) for one in found.offered],
        "not_offered": [_family_facts(one) | {"reasons": one.reasons} for one in found.refused],
    }


def _offered_facts(one: OfferedFamily) -> dict[str, Any]:
    return {
        "number": one.number,
        "status": "proposed",
        **_family_facts(one.family),
        **proposal_facts(one.proposal),
        "roles": one.facts.report.roles,
    }


def proposal_facts(proposal: ControlProposal) -> dict[str, Any]:
    """Return the proposed event and controls as JSON values."""
    return {
        "controls": [family_recipe.control_name(own) for own in proposal.controls],
        "event": proposal.event,
        "remaining": [round(left, 4) for left in proposal.remaining],
    }


def family_name(number: int) -> str:
    """Return the name of a family's files, without the ending."""
    return f"family_{number:02d}"


def _family_facts(family: FoundFamily) -> dict[str, Any]:
    quality = family.quality
    return {
        "kind": family.kind,
        "clips": len(family.rows),
        "performers": sorted({row.performer for row in family.rows}),
        "seconds": round(family.seconds, 3),
        "within": None if quality is None else round(quality.within, 4),
        "shared": None if quality is None else round(quality.shared, 4),
        "example": None if family.example is None else asdict(family.example),
        "left_out": dict(family.left_out),
    }


def contents(found: FoundFamilies, facts: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the files of the folder, but for the page, by name."""
    files = {SUMMARY: json_bytes(facts)}
    for one in found.offered:
        files[f"{one.name}.toml"] = one.text.encode()
        files[f"{one.name}.csv"] = family_table.table(one.family.rows)
    return files


def json_bytes(facts: Mapping[str, Any]) -> bytes:
    """Return JSON values as a file."""
    return (json.dumps(facts, indent=2, ensure_ascii=False) + "\n").encode()


def expect_free(folder: Path, overwrite: bool) -> list[Path]:
    """Return the folder's files of an earlier search, which are replaced.

    Raises FileError if there are any and they may not be overwritten.
    """
    there = sorted(path for path in folder.glob("*") if OWN_FILES.fullmatch(path.name))
    if there and not overwrite:
        raise FileError(there[0], "exists already, and is not overwritten: say --overwrite")
    return there


def write(files: Mapping[str, bytes], folder: Path, replaced: Sequence[Path]) -> None:
    """Write the files of a folder, and remove those of an earlier search that are left over."""
    for path in replaced:
        if path.name not in files:
            path.unlink()
    for name, content in files.items():
        atomic_files.write(content, folder / name)
