"""Folder of recipes: the families of a folder of recordings, each with its recipe and its table."""

import json
import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import posefield
from posefield.common import atomic_files
from posefield.common.errors import FileError, MotionError
from posefield_train.discover import control_proposals, family_search
from posefield_train.discover.control_proposals import ControlProposal, FamilyClips, ProposedControl
from posefield_train.discover.recordings import ReadRecordings
from posefield_train.families import found_families
from posefield_train.families.found_families import BodyKind, FamilyRow, FoundFamily
from posefield_train.probe import recipe_draft
from posefield_train.probe.probe_report import ProbeReport
from posefield_train.source import common_topology, ingest, measured_controls, recipe
from posefield_train.source.motion_readers import MotionFiles
from posefield_train.source.recipe import Recipe


def propose(
    text: str,
    name: str,
    rows: Sequence[FamilyRow],
    data: Path,
    roles: dict[str, str],
    files_read: MotionFiles | None = None,
) -> ControlProposal:
    """Return the proposed controls of a family.

    text: of a recipe with any control. name: of its table without the ending. data: folder of the
    recordings. roles: joints by role. files_read: before. Raises MotionError for
    clips that cannot be read as one family, and ValueError for those that no control can be
    proposed for.
    """
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        (scratch / f"{name}.csv").write_bytes(found_families.table(rows))
        (scratch / f"{name}.toml").write_text(text, encoding="utf-8")
        draft = recipe.read(scratch / f"{name}.toml")
        examples, _ = ingest.ingest(draft, data, files_read)
        proposal = control_proposals.propose_controls(_family_clips(draft, examples))
        if not proposal.controls:
            raise ValueError(
                "no measure of the clips predicts those of recordings that are left out"
            )
        if proposal.event is None:
            return proposal
        # A moment at the start or the end of a clip is refused as an event.
        lines = proposal_lines(proposal, roles)
        (scratch / f"{name}.toml").write_text(with_proposal(text, lines), encoding="utf-8")
        try:
            ingest.ingest(recipe.read(scratch / f"{name}.toml"), data, files_read)
        except MotionError:
            return replace(proposal, event=None)
    return proposal


def _family_clips(draft: Recipe, examples: Sequence[ingest.Example]) -> FamilyClips:
    names = examples[0].clip.skeleton.names
    roles = {str(role): joint for role, joint in draft.roles.items()}
    if draft.skeleton.is_unified:
        roles = common_topology.model_roles(names)
    joints: Mapping[str, int] = {
        role: names.index(joint) for role, joint in roles.items() if joint in names
    }
    return FamilyClips(
        tuple(measured_controls.measured_quantities(one.clip) for one in examples),
        joints,
        tuple(one.row.performer for one in examples),
        tuple(one.recording for one in examples),
        draft.motion.cyclic,
    )


BEGIN = "# Proposed event and controls; posefield review --merge writes them again:"
END = "# End of the proposals."
PLACEHOLDER = ControlProposal((ProposedControl("height", "hips", "end"),), None, ())
"""Proposal that any family can follow, to read its clips before there is another."""
GAIT = {
    "speed": "Mean speed over the stride",
    "turn": "Change of heading over the stride, positive to the left",
    "stride_length": "Ground covered by one full stride, two steps",
}
DIRECTIONS = {
    "height": "Height of {} {}",
    "forward": "How far in front of the first pose's root {} is {}",
    "left": "How far to the left of the first pose's root {} is {}",
}
MOMENTS = {
    "start": "at the start",
    "end": "at the end",
    "highest": "when it is highest",
    "lowest": "when it is lowest",
    "farthest": "when it is farthest from the root",
}


@dataclass(frozen=True)
class RecipeFacts:
    """Facts of a family's recipe besides its controls.

    name: of the files. description: of the motions. licence: empty for one that has to be written.
    report: on the motion files. cyclic: of strides. labelled: whether performers are told apart.
    evidence: comment lines. skeleton: lines of the section [skeleton]; empty for equal joints.
    """

    name: str
    description: str
    licence: str
    report: ProbeReport
    cyclic: bool = False
    labelled: bool = True
    evidence: tuple[str, ...] = field(default=())
    skeleton: tuple[str, ...] = ()


def recipe_text(facts: RecipeFacts, proposal: ControlProposal, accepted: bool = False) -> str:
    """Return the recipe of a family."""
    quote = recipe_draft.quote
    licence = [f"licence = {quote(facts.licence)}"]
    if not facts.licence:
        licence.insert(0, "# TODO licence of the motions with its attribution, without which no")
        licence.insert(1, "# model is trained; motion files state none.")
    return "\n".join(
        [
            "# Found by posefield discover: look at its clips in index.html, then accept it.",
            *(f"# {sentence}" for sentence in facts.evidence),
            "schema = 1",
            f"name = {quote(facts.name)}",
            f"description = {quote(facts.description)}",
            *licence,
            f"accepted = {str(accepted).lower()}",
            "",
            *recipe_draft.source_lines(facts.report),
            "[clips]",
            f'table = "{facts.name}.csv"',
            'file = "file"',
            'performer = "performer"',
            'recording = "recording"',
            'first_frame = "first_frame"',
            'last_frame = "last_frame"',
            'where = { accepted = { among = ["true"] } }',
            "",
            *proposal_lines(proposal, facts.report.roles),
            "",
            *facts.skeleton,
            *recipe_draft.motion_lines(facts.report, facts.cyclic),
            *([] if facts.skeleton else recipe_draft.role_lines(facts.report)),
            *(["[kriging]", 'label = "performer"', ""] if facts.labelled else []),
            "[size]",
            "rms_budget_cm = 1.0",
            "",
        ]
    )


def with_proposal(text: str, lines: Sequence[str]) -> str:
    """Return a recipe with other proposals, and the rest of it as it is."""
    block = re.compile(f"^{re.escape(BEGIN)}$.*?^{re.escape(END)}$", re.DOTALL | re.MULTILINE)
    return block.sub(lambda _: "\n".join(lines), text, count=1)


def clips_text(clips: int, performers: int, seconds: float) -> str:
    """Return the evidence on a family's clips. seconds: their median duration."""
    return f"{clips} clips of {performers} performers, {seconds:.1f} s long in the median."


def with_merged(text: str, clips: str, merged: str) -> str:
    """Return a recipe with the evidence on the clips of a family that was merged into it.

    clips: evidence on all clips, in place of that on the family's own. merged: on those merged.
    """
    counted = r"^# \d+ clips of \d+ performers, [\d.]+ s long in the median\.$"
    counted_text = re.sub(counted, lambda _: f"# {clips}", text, count=1, flags=re.M)
    return re.sub(
        r"^schema = ", lambda start: f"# {merged}\n{start[0]}", counted_text, count=1, flags=re.M
    )


def with_accepted(text: str, accepted: bool) -> str:
    """Return a recipe that is accepted or not, and the rest of it as it is."""
    line = re.compile(r"^accepted = (true|false)$", re.MULTILINE)
    return line.sub(f"accepted = {str(accepted).lower()}", text, count=1)


def proposal_lines(proposal: ControlProposal, roles: dict[str, str]) -> list[str]:
    """Return the event and the controls of a recipe, with what they explain as comments."""
    quote = recipe_draft.quote
    lines = [BEGIN, *_evidence(proposal)]
    for control in proposal.controls:
        lines += ["[[controls]]", f"name = {quote(control_name(control))}"]
        at = f', joint = {quote(roles[control.role])}, at = "{control.at}"' if control.role else ""
        lines.append(f'auto = {{ quantity = "{control.quantity}"{at} }}')
        if control.role is None or control.at is None:
            description = GAIT[control.quantity]
        else:
            words = re.sub(r"([A-Z])", r" \1", control.role).lower()
            moment = MOMENTS[control.at]
            description = DIRECTIONS[control.quantity].format(f"the {words}", moment)
        if control.role and words.endswith("s"):
            description = description.replace(" it is ", " they are ").replace(" is ", " are ")
        lines += [f"description = {quote(description)}", ""]
    if proposal.event is not None:
        role, moment = proposal.event
        lines += ["[event]", f"joint = {quote(roles[role])}", f'at = "{moment}"', ""]
    return [*lines[:-1], END]


def control_name(control: ProposedControl) -> str:
    """Return the name of a control, such as right_hand_height_end."""
    words = [control.role, control.quantity, control.at]
    return "_".join(re.sub(r"([A-Z])", r"_\1", word).lower() for word in words if word)


def _evidence(proposal: ControlProposal) -> list[str]:
    single = len(proposal.controls) - len(proposal.remaining) + 1
    lines = []
    for at, left in enumerate(proposal.remaining):
        names = ", ".join(control_name(one) for one in proposal.controls[: single + at])
        lines.append(f"# {left:.0%} of the variance of recordings left out remains with {names}")
    return lines


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
    families: Sequence[FoundFamily], data: Path, licence: str, files_read: MotionFiles | None = None
) -> FoundFamilies:
    """Return the families with recipes, in the order found, numbered from 1.

    data: folder of the recordings. files_read: before. A family whose clips cannot
    be read together, or that no control predicts, is refused with the reason.
    """
    offered: list[OfferedFamily] = []
    refused = []
    for family in families:
        if family.reasons:
            refused.append(family)
            continue
        facts = _facts(family, len(offered) + 1, licence)
        draft = replace(facts, licence="not stated yet")
        text = recipe_text(draft, PLACEHOLDER)
        try:
            proposal = propose(text, facts.name, family.rows, data, facts.report.roles, files_read)
        except (MotionError, ValueError) as fault:
            refused.append(replace(family, reasons=(str(fault),)))
            continue
        recipe_content = recipe_text(facts, proposal)
        offered.append(OfferedFamily(len(offered) + 1, family, facts, proposal, recipe_content))
    return FoundFamilies(tuple(offered), tuple(refused))


def _facts(family: FoundFamily, number: int, licence: str) -> RecipeFacts:
    kind, kinds = family.kinds[0], family.kinds
    is_mixed = len(kinds) > 1
    performers = {row.performer for row in family.rows}
    what = "Strides" if family.kind == "strides" else "Similar motions"
    evidence = [clips_text(len(family.rows), len(performers), family.seconds)]
    if family.quality is not None:
        evidence.append(
            f"The clips differ by {family.quality.within:.1%} of all motion; "
            f"{family.quality.shared:.0%} of the family's motion is common to them."
        )
    return RecipeFacts(
        family_name(number),
        f"{what} found in long recordings, family {number}",
        licence,
        found_families.shared_report(kind.report, kinds) if is_mixed else kind.report,
        family.kind == "strides",
        len(performers) > 1,
        tuple(evidence),
        tuple(found_families.skeleton_lines(kinds)) if is_mixed else (),
    )


def summary(
    families: FoundFamilies,
    folder: Path,
    read: ReadRecordings,
    kinds: Sequence[BodyKind],
    count: int,
) -> dict[str, Any]:
    """Return all that was found as JSON values. count: of candidates that were searched."""
    performers = {file: performer for kind in kinds for file, performer in kind.performers.items()}
    return {
        "folder": folder.as_posix(),
        "versions": {"posefield": posefield.__version__},
        "parameters": {
            "candidates": count,
            "largest_cost": family_search.LARGEST_COST,
            "fewest_clips": family_search.FEWEST,
            "most_within": family_search.MOST_WITHIN,
            "least_shared": family_search.LEAST_SHARED,
        },
        "recordings": {
            recording.file: {
                "rate": recording.rate,
                "frames": len(recording),
                "performer": performers[recording.file],
            }
            for recording in read.recordings
        },
        "refused": read.refused,
        "notes": read.notes,
        "families": [
            {
                "number": one.number,
                "status": "proposed",
                **_family_facts(one.family),
                **proposal_facts(one.proposal),
                "roles": one.facts.report.roles,
            }
            for one in families.offered
        ],
        "not_offered": [_family_facts(one) | {"reasons": one.reasons} for one in families.refused],
    }


def proposal_facts(proposal: ControlProposal) -> dict[str, Any]:
    """Return the proposed event and controls as JSON values."""
    return {
        "controls": [control_name(control) for control in proposal.controls],
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


def contents(families: FoundFamilies, facts: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the files of the folder, but for the page, by name."""
    files = {SUMMARY: json_bytes(facts)}
    for one in families.offered:
        files[f"{one.name}.toml"] = one.text.encode()
        files[f"{one.name}.csv"] = found_families.table(one.family.rows)
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
