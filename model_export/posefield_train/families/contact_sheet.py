"""Page with the families that were found: figures of their clips, and buttons for decisions."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from posefield.common.units import UP, Floats
from posefield_train.discover.recordings import Recording
from posefield_train.families import recipe_folder
from posefield_train.families.found_families import FamilyRow
from posefield_train.families.recipe_folder import FoundFamilies, OfferedFamily

INSTANTS = 6
GAP = 0.35
"""Distance between two figures, leg lengths."""
UNIT = 40.0
"""Length of a leg in the picture."""
VIEW_TURN = np.radians(25.0)
"""Angle of the view from that which shows most of the motion, rad."""
BONES = (
    ("hips", "neck"),
    ("neck", "head"),
    *(
        bone
        for side in ("left", "right")
        for bone in (
            ("hips", f"{side}UpperLeg"),
            (f"{side}UpperLeg", f"{side}LowerLeg"),
            (f"{side}LowerLeg", f"{side}Foot"),
            (f"{side}Foot", f"{side}Toes"),
            ("neck", f"{side}UpperArm"),
            (f"{side}UpperArm", f"{side}LowerArm"),
            (f"{side}LowerArm", f"{side}Hand"),
        )
    ),
)


@dataclass(frozen=True)
class StickStrip:
    """Figures of a clip side by side.

    body, right: paths of SVG, of the trunk with the left limbs, and of the right limbs. width,
    height: of the picture.
    """

    body: str
    right: str
    width: float
    height: float


def draw(recording: Recording, first: int, last: int) -> StickStrip:
    """Return the figures of a part of a recording at INSTANTS times, seen from where most moves."""
    frames = np.linspace(first, last, INSTANTS).round().astype(int)
    bones = [bone for bone in BONES if set(bone) <= recording.places.keys()]
    hips = recording.places["hips"][frames] * (1.0 - UP)
    bone_ends = [[recording.places[role][frames] - hips for role in bone] for bone in bones]
    points = np.array(bone_ends).transpose(2, 0, 1, 3)
    across = points @ _direction(points)
    floor, top = points[..., 1].min(), points[..., 1].max()
    step = across.max() - across.min() + GAP
    x = across - across.min() + 0.5 * GAP + step * np.arange(INSTANTS)[:, None, None]
    flat = UNIT * np.stack([x, top - points[..., 1] + 0.1], axis=-1)
    is_right = np.array([any(role.startswith("right") for role in bone) for bone in bones])
    return StickStrip(
        _path(flat[:, ~is_right]),
        _path(flat[:, is_right]),
        round(float(UNIT * step * INSTANTS), 1),
        round(float(UNIT * (top - floor + 0.2)), 1),
    )


def _direction(points: Floats) -> Floats:
    """Return the horizontal direction (3,) along which the ends of bones move most, turned a bit.

    From exactly there one side of the body would hide the other.
    """
    motion = (points - points.mean(axis=0)).reshape(-1, 3) * (1.0 - UP)
    spread = (points - points.mean(axis=(1, 2), keepdims=True)).reshape(-1, 3) * (1.0 - UP)
    # A body that does not move is seen from where it is widest.
    _, vectors = np.linalg.eigh(motion.T @ motion + 0.01 * spread.T @ spread)
    direction = vectors[:, -1]
    direction = direction if direction[2] + 1e-3 * direction[0] >= 0.0 else -direction
    aside = np.array([direction[2], 0.0, -direction[0]])
    return np.asarray(np.cos(VIEW_TURN) * direction + np.sin(VIEW_TURN) * aside)


def _path(bones: Floats) -> str:
    lines = bones.reshape(-1, 4)
    return "".join(f"M{x:.0f} {y:.0f}L{u:.0f} {v:.0f}" for x, y, u, v in lines)


NO_BREAK = "\N{NO-BREAK SPACE}"
BEST, WORST = 5, 3
"""Clips that are shown: those most like the example, and those least like it; of strides, which are
like none, the first and the last."""
HEADINGS = {
    "motions": ("Most like the example", "Least like the example"),
    "strides": ("First strides", "Last strides"),
}
"""Headings of these clips by the kind of the family."""


def render(
    families: FoundFamilies,
    recordings: Sequence[Recording],
    folder: str,
    refused: Mapping[str, str],
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
    by_file = {recording.file: recording for recording in recordings}
    left = [
        (f"{len(one.rows)} clips of {one.seconds:.1f} s", "; ".join(one.reasons))
        for one in families.refused
    ]
    page = environment.get_template("contact_sheet.html").render(
        families=[_shown(one, by_file) for one in families.offered],
        left=left,
        folder=folder,
        recordings=len(recordings),
        refused=refused,
    )
    return page.encode()


def _shown(one: OfferedFamily, recordings: Mapping[str, Recording]) -> dict[str, Any]:
    """Return a family as the page names its facts."""
    rows = one.family.rows
    best, worst = rows[:BEST], rows[max(BEST, len(rows) - WORST) :]
    example = one.family.example or rows[0]
    return {
        "number": one.number,
        "title": f"{len(rows)} {one.family.kind}",
        "example": draw(recordings[example.file], example.first_frame, example.last_frame),
        "best": [_clip(one.number, row, recordings) for row in best],
        "worst": [_clip(one.number, row, recordings) for row in worst],
        "headings": HEADINGS[one.family.kind],
        "facts": _facts(one),
    }


def _clip(number: int, row: FamilyRow, recordings: Mapping[str, Recording]) -> dict[str, Any]:
    """Return a clip of the page, whose key is that of `posefield review --drop`."""
    recording = recordings[row.file]
    start, end = row.first_frame / recording.rate, row.last_frame / recording.rate
    return {
        "key": f"{number}:{row.file}@{0.5 * (start + end):.2f}",
        "place": f"{row.file}, {start:.1f} to {end:.1f}{NO_BREAK}s",
        "cost": row.cost,
        "strip": draw(recording, row.first_frame, row.last_frame),
    }


def _facts(one: OfferedFamily) -> tuple[tuple[str, str], ...]:
    family, proposal = one.family, one.proposal
    names = ", ".join(recipe_folder.control_name(control) for control in proposal.controls)
    sentence = f"explain {1.0 - proposal.remaining[-1]:.0%} of the variance of recordings left out"
    facts = [
        ("Performers", ", ".join(sorted({row.performer for row in family.rows}))),
        ("Duration", f"{family.seconds:.1f} s in the median"),
        ("What varies", f"{names}, which {sentence}"),
    ]
    if family.quality is not None:
        alike = f"clips differ by {family.quality.within:.1%} of all motion"
        facts.append(("Why", f"{alike}; {family.quality.shared:.0%} of their motion is common"))
    else:
        facts.append(("Why", "from one left foot most forward to the next, and the body travels"))
    if family.left_out:
        sentence = ", ".join(
            f"{count} clips, {why}" for why, count in Counter(family.left_out.values()).items()
        )
        facts.append(("Left out", sentence))
    return tuple(facts)
