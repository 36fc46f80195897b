"""Recipe of a found family: proposed settings and controls, with the evidence as comments."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from posefield_train.discover.control_proposals import ControlProposal, ProposedControl
from posefield_train.probe import recipe_draft
from posefield_train.probe.probe_report import ProbeReport

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
            *(f"# {said}" for said in facts.evidence),
            "schema = 1",
            f"name = {quote(facts.name)}",
            f"description = {quote(facts.description)}",
            *licence,
            f"accepted = {str(accepted).lower()}",
            "",
            *recipe_draft.source_lines(facts.report),
            *_clips(facts.name),
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
    found = re.sub(counted, lambda _: f"# {clips}", text, count=1, flags=re.M)
    return re.sub(r"^schema = ", lambda own: f"# {merged}\n{own[0]}", found, count=1, flags=re.M)


def with_accepted(text: str, accepted: bool) -> str:
    """Return a recipe that is accepted or not, and the rest of it as it is."""
    line = re.compile(r"^accepted = (true|false)$", re.MULTILINE)
    return line.sub(f"accepted = {str(accepted).lower()}", text, count=1)


def with_licence(text: str, licence: str) -> str:
    """Return a recipe with a licence if it has none, and the rest of it as it is."""
    line = re.compile(r'^licence = ""$', re.MULTILINE)
    return line.sub(lambda _: f"licence = {recipe_draft.quote(licence)}", text, count=1)


def proposal_lines(proposal: ControlProposal, roles: dict[str, str]) -> list[str]:
    """Return the event and the controls of a recipe, with what they explain as comments."""
    quote = recipe_draft.quote
    lines = [BEGIN, *_evidence(proposal)]
    for control in proposal.controls:
        lines += ["[[controls]]", f"name = {quote(control_name(control))}"]
        at = f', joint = {quote(roles[control.role])}, at = "{control.at}"' if control.role else ""
        lines.append(f'auto = {{ quantity = "{control.quantity}"{at} }}')
        lines += [f"description = {quote(_description(control))}", ""]
    if proposal.event is not None:
        role, moment = proposal.event
        lines += ["[event]", f"joint = {quote(roles[role])}", f'at = "{moment}"', ""]
    return [*lines[:-1], END]


def control_name(control: ProposedControl) -> str:
    """Return the name of a control, such as right_hand_height_end."""
    parts = [control.role, control.quantity, control.at]
    return "_".join(re.sub(r"([A-Z])", r"_\1", part).lower() for part in parts if part)


def _clips(name: str) -> list[str]:
    return [
        "[clips]",
        f'table = "{name}.csv"',
        'file = "file"',
        'performer = "performer"',
        'take = "take"',
        'first_frame = "first_frame"',
        'last_frame = "last_frame"',
        'where = { accepted = { among = ["true"] } }',
        "",
    ]


def _evidence(proposal: ControlProposal) -> list[str]:
    """Return how much of the variance of left-out takes remains with the controls."""
    single = len(proposal.controls) - len(proposal.remaining) + 1
    lines = []
    for at, left in enumerate(proposal.remaining):
        named = ", ".join(control_name(one) for one in proposal.controls[: single + at])
        lines.append(f"# {left:.0%} of the variance of takes left out remains with {named}")
    return lines


def _description(control: ProposedControl) -> str:
    if control.role is None or control.at is None:
        return GAIT[control.quantity]
    words = re.sub(r"([A-Z])", r" \1", control.role).lower()
    return DIRECTIONS[control.quantity].format(f"the {words}", MOMENTS[control.at])
