"""Page with the families that were found: figures of their clips, and buttons for decisions."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined

from posefield_train.discover.take_reading import Take
from posefield_train.families import clip_sticks, family_recipe
from posefield_train.families.clip_sticks import StickStrip
from posefield_train.families.family_table import FamilyRow
from posefield_train.families.recipe_folder import FoundFamilies, OfferedFamily

NO_BREAK = "\N{NO-BREAK SPACE}"
BEST, WORST = 5, 3
"""Clips that are shown: those most like the example, and those least like it; of strides, which are
like none, the first and the last."""
HEADINGS = {
    "motions": ("Most like the example", "Least like the example"),
    "strides": ("First strides", "Last strides"),
}
"""Headings of these clips by the kind of the family."""


@dataclass(frozen=True)
class ShownClip:
    """A clip of the page. key: as posefield review --drop names it. place: file and time, s."""

    key: str
    place: str
    cost: float | None
    strip: StickStrip


@dataclass(frozen=True)
class ShownFamily:
    """A row of the page. headings: of best and worst clips. facts: names and values in text."""

    number: int
    title: str
    example: StickStrip
    best: tuple[ShownClip, ...]
    worst: tuple[ShownClip, ...]
    headings: tuple[str, str]
    facts: tuple[tuple[str, str], ...]


def render(
    found: FoundFamilies, takes: Sequence[Take], folder: str, refused: Mapping[str, str]
) -> bytes:
    """Return the page as one file of HTML; all text is escaped.

    folder: of the recipes, as commands name it. refused: reason by file that was not searched.
    """
    environment = Environment(
        loader=PackageLoader("posefield_train.families"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    by_file = {take.file: take for take in takes}
    left = [
        (f"{len(one.rows)} clips of {one.seconds:.1f} s", "; ".join(one.reasons))
        for one in found.refused
    ]
    page = environment.get_template("contact_sheet.html").render(
        families=[_shown(one, by_file) for one in found.offered],
        left=left,
        folder=folder,
        takes=len(takes),
        refused=refused,
    )
    return page.encode()


def _shown(one: OfferedFamily, takes: Mapping[str, Take]) -> ShownFamily:
    rows = one.family.rows
    best, worst = rows[:BEST], rows[max(BEST, len(rows) - WORST) :]
    example = one.family.example or rows[0]
    return ShownFamily(
        one.number,
        f"{len(rows)} {one.family.kind}",
        clip_sticks.draw(takes[example.file], example.first_frame, example.last_frame),
        tuple(_clip(one.number, row, takes) for row in best),
        tuple(_clip(one.number, row, takes) for row in worst),
        HEADINGS[one.family.kind],
        _facts(one),
    )


def _clip(number: int, row: FamilyRow, takes: Mapping[str, Take]) -> ShownClip:
    take = takes[row.file]
    start, end = row.first_frame / take.rate, row.last_frame / take.rate
    return ShownClip(
        f"{number}:{row.file}@{0.5 * (start + end):.2f}",
        f"{row.file}, {start:.1f} to {end:.1f}{NO_BREAK}s",
        row.cost,
        clip_sticks.draw(take, row.first_frame, row.last_frame),
    )


def _facts(one: OfferedFamily) -> tuple[tuple[str, str], ...]:
    family, proposal = one.family, one.proposal
    names = ", ".join(family_recipe.control_name(own) for own in proposal.controls)
    said = f"explain {1.0 - proposal.remaining[-1]:.0%} of the variance of takes left out"
    facts = [
        ("Performers", ", ".join(sorted({row.performer for row in family.rows}))),
        ("Duration", f"{family.seconds:.1f} s in the median"),
        ("What varies", f"{names}, which {said}"),
    ]
    if family.quality is not None:
        alike = f"clips differ by {family.quality.within:.1%} of all motion"
        facts.append(("Why", f"{alike}; {family.quality.shared:.0%} of their motion is common"))
    else:
        facts.append(("Why", "from one left foot most forward to the next, and the body travels"))
    if family.left_out:
        said = ", ".join(
            f"{count} clips, {why}" for why, count in Counter(family.left_out.values()).items()
        )
        facts.append(("Left out", said))
    return tuple(facts)
