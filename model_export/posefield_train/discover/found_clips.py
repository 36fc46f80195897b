"""Tables of found clips, and the example and the roles that a search is given."""

import csv
import io
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from posefield.common.errors import FileError, InvalidField
from posefield.motion.joint_roles import ROLES
from posefield_train.discover import example_search, motion_features, stride_detection
from posefield_train.discover.example_search import Span
from posefield_train.discover.motion_features import StillTakes
from posefield_train.discover.take_reading import Take
from posefield_train.source import data_folder

EXAMPLE = re.compile(r"(.+):(\d+(?:\.\d+)?)-(\d+(?:\.\d+)?)")
SHORTEST_EXAMPLE = 0.3
"""Duration of the shortest example, s: fewer frames fit anywhere."""
MOST_ROLES_BYTES = 128_000


@dataclass(frozen=True)
class FoundClip:
    """A row of the table.

    file: below the folder. first_frame, last_frame: inclusive. seconds: duration. cost: of a match,
    None for a stride. accepted: whether a person named it.
    """

    file: str
    name: str
    first_frame: int
    last_frame: int
    seconds: float
    cost: float | None = None
    accepted: bool = False


COLUMNS = ("file", "name", "first_frame", "last_frame", "seconds", "cost", "accepted")


def strides(takes: Sequence[Take]) -> tuple[list[FoundClip], int]:
    """Return the strides of all takes, in the takes' order, and how many more do not travel."""
    every = [(take, one) for take in takes for one in stride_detection.find_strides(take)]
    found = [_clip(take, "stride", one.first, one.last) for take, one in every if one.travels]
    return found, len(every) - len(found)


def like(takes: Sequence[Take], text: str, name: str, most: int) -> list[FoundClip]:
    """Return an example, accepted, and the clips that are like it, the best first.

    text: of the example, such as "walks/a.bvh:12.1-14.6", file and seconds. Raises InvalidField for
    an example that is none, and for takes in which nothing moves.
    """
    example = _example(takes, text)
    try:
        corpus = motion_features.build_corpus(takes)
    except StillTakes as fault:
        raise InvalidField("like", str(fault)) from fault
    matches = example_search.find_like(corpus, example, most)
    rows = [(example, 0.0, True), *((one.span, one.cost, False) for one in matches)]
    found = []
    for span, cost, accepted in rows:
        first, last = corpus.frame(span.take, span.start), corpus.frame(span.take, span.end)
        found.append(_clip(takes[span.take], name, first, last, cost, accepted))
    return found


def table(clips: Sequence[FoundClip]) -> bytes:
    """Return the table as CSV."""
    lines = io.StringIO(newline="")
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(COLUMNS)
    for one in clips:
        cost = "" if one.cost is None else f"{one.cost:.4f}"
        frames = (one.first_frame, one.last_frame, f"{one.seconds:.3f}")
        writer.writerow([one.file, one.name, *frames, cost, str(one.accepted).lower()])
    return lines.getvalue().encode()


def _clip(
    take: Take,
    name: str,
    first: int,
    last: int,
    cost: float | None = None,
    accepted: bool = False,
) -> FoundClip:
    return FoundClip(take.file, name, first, last, (last - first) / take.rate, cost, accepted)


def _example(takes: Sequence[Take], text: str) -> Span:
    """Return the part of a take that a text names."""
    parts = EXAMPLE.fullmatch(text)
    if parts is None:
        raise InvalidField("like", f"{text!r}, expected FILE:START-END in seconds")
    start, end = float(parts[2]), float(parts[3])
    for index, take in enumerate(takes):
        if take.file == parts[1]:
            seconds = (len(take) - 1) / take.rate
            if end > seconds or end - start < SHORTEST_EXAMPLE:
                raise InvalidField(
                    "like",
                    f"{start:g} to {end:g} s, expected {SHORTEST_EXAMPLE:g} s or more between 0 "
                    f"and {seconds:.2f} s of {take.file}",
                )
            return Span(index, start, end)
    known = ", ".join(take.file for take in takes[:5])
    raise InvalidField("like", f"file {parts[1]!r}, expected a take of the folder, such as {known}")


def read_roles(path: Path) -> dict[str, str]:
    """Return the table [roles] of a TOML file, such as a recipe, which may be a draft.

    Raises FileError for a file without it, an unknown role, and a joint with two roles.
    """
    content = data_folder.read(path, MOST_ROLES_BYTES, "a TOML file with roles")
    try:
        found = tomllib.loads(content.decode())
    except (ValueError, RecursionError) as fault:
        raise FileError(path, f"not TOML: {fault}") from fault
    roles = found.get("roles")
    if not isinstance(roles, dict) or not all(isinstance(one, str) for one in roles.values()):
        raise FileError(path, "no table [roles] of joints by role")
    unknown = sorted(set(roles) - set(ROLES))
    if unknown:
        raise FileError(path, f"unknown roles {unknown}, expected some of {', '.join(ROLES)}")
    if len(set(roles.values())) < len(roles):
        raise FileError(path, "a joint with two roles, expected one each")
    return roles
