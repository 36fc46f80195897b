"""Decisions on found families: which are accepted, rejected or merged, and which clips dropped."""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from posefield.common.errors import FileError, InvalidField
from posefield_train.source import data_folder

DROP = re.compile(r"(\d+):(.+)@(\d+(?:\.\d+)?)")
MOST_BYTES = 1_000_000


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
    if odd := next((text for text, own in zip(merge, pairs, strict=True) if len(own) != 2), None):
        raise InvalidField("merge", f"{odd!r}, expected two numbers of families, such as 4,5")
    return _checked(
        Decisions(
            _numbers("accept", accept) if accept else (),
            _numbers("reject", reject) if reject else (),
            tuple((own[0], own[1]) for own in pairs),
            tuple(_dropped(text) for text in drop),
        )
    )


def read(path: Path) -> Decisions:
    """Return the decisions of a JSON file, which the page saves; FileError for another file."""
    try:
        found = json.loads(data_folder.read(path, MOST_BYTES, "decisions"))
    except (ValueError, RecursionError) as fault:
        raise FileError(path, f"not JSON: {fault}") from fault
    if not isinstance(found, dict) or not set(found) <= {"accept", "reject", "merge", "drop"}:
        raise FileError(path, "expected an object of accept, reject, merge and drop")
    lists = {key: found.get(key, []) for key in ("accept", "reject", "merge", "drop")}
    if not all(isinstance(own, list) for own in lists.values()):
        raise FileError(path, "expected a list for each decision")
    return of_texts(
        ",".join(map(str, lists["accept"])),
        ",".join(map(str, lists["reject"])),
        [_pair_text(pair) for pair in lists["merge"]],
        [str(clip) for clip in lists["drop"]],
    )


def _pair_text(pair: Any) -> str:
    return ",".join(map(str, pair)) if isinstance(pair, list) else str(pair)


def _numbers(field: str, text: str) -> tuple[int, ...]:
    if not re.fullmatch(r"\d{1,6}(\s*,\s*\d{1,6})*", text):
        raise InvalidField(field, f"{text!r}, expected numbers of families, such as 1,2")
    return tuple(dict.fromkeys(int(word) for word in text.split(",")))


def _dropped(text: str) -> DroppedClip:
    parts = DROP.fullmatch(text)
    if parts is None:
        said = "expected FAMILY:FILE@SECONDS, such as 2:bd_1.bvh@33.2"
        raise InvalidField("drop", f"{text!r}, {said}")
    return DroppedClip(int(parts[1]), parts[2], float(parts[3]))


def _checked(found: Decisions) -> Decisions:
    """Return decisions that do not contradict each other."""
    both = sorted(set(found.accept) & set(found.reject))
    if both:
        raise InvalidField("reject", f"{both[0]} is accepted too, expected one of both")
    seconds = [second for _, second in found.merge]
    for first, second in found.merge:
        if first == second or first in seconds or seconds.count(second) > 1:
            raise InvalidField("merge", f"{first},{second}: expected each family merged once")
        if second in found.accept or second in found.reject:
            said = f"{second} goes into {first}, expected no other decision on it"
            raise InvalidField("merge", said)
    return found
