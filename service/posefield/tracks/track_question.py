"""Question for people who follow tracks, over HTTP and in Python, and the tracks in it."""

from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from posefield.common import cancellation
from posefield.common.bounded_types import Whole
from posefield.common.errors import InvalidField
from posefield.question.motion_question import DEFAULT_VARIETY, Body, FeetMode, LabelValue
from posefield.question.walk_question import Instancing, WalkerTake, WalkQuestion
from posefield.tracks import track
from posefield.tracks.track import Track, TrackSet


class TrackBody(Struct, frozen=True, forbid_unknown_fields=True):
    """Track (schema of the contract)."""

    id: Annotated[str, Meta(min_length=1, max_length=200)]
    times: list[float]
    positions: list[tuple[float, float]]
    headings: list[float] | None = None


class TracksQuestion(Struct, frozen=True, forbid_unknown_fields=True):
    """TracksQuestion (schema of the contract)."""

    tracks: list[TrackBody]
    skip_bad: bool = False
    fps: float = 30.0
    seed: Whole = 0
    labels: dict[str, LabelValue] = {}
    level: Whole | None = None
    feet: FeetMode | None = None
    take: WalkerTake = 0
    variety: float = DEFAULT_VARIETY
    detail: bool = False
    instancing: Instancing = "references"
    body: Body = None

    def question(self, count: int) -> WalkQuestion:
        """Return the question for a crowd of so many people."""
        names = set(self.__struct_fields__) - {"tracks", "skip_bad"}
        return WalkQuestion(count=count, **{name: getattr(self, name) for name in names})


def read_tracks(body: TracksQuestion, limit: int) -> TrackSet:
    """Return the tracks of a body, checked as those of a file are.

    limit: of people. Raises InvalidField, with the pointer to the sample, for the first unusable
    track unless it is left out, for an id that two have, and for too many people or none.
    """
    if not 1 <= len(body.tracks) <= limit:
        raise InvalidField("tracks", f"{len(body.tracks)} people, expected 1 to {limit}")
    tracks, skipped, first = [], {}, dict[str, int]()
    for index, person in enumerate(body.tracks):
        cancellation.check()
        if person.id in first:
            text = f"{person.id!r}, expected another than that of tracks/{first[person.id]}"
            raise InvalidField(f"tracks/{index}/id", text)
        first[person.id] = index
        walk, problem = _read(person, f"tracks/{index}")
        if problem is None:
            tracks.append(walk)
        elif body.skip_bad:
            skipped[person.id] = f"sample {problem.sample}: {problem.message}"
        else:
            pointer = f"tracks/{index}/{problem.column}/{problem.sample}"
            raise InvalidField(pointer, problem.message)
    if not tracks:
        name, why = next(iter(skipped.items()))
        text = f"no usable person among {len(skipped)}, the first {name!r}: {why}"
        raise InvalidField("tracks", text)
    if problem_of_all := track.find_file_problem(track.sums(tracks)):
        raise InvalidField("tracks", problem_of_all)
    return TrackSet(tuple(tracks), skipped)


def _read(person: TrackBody, where: str) -> tuple[Track, track.TrackProblem | None]:
    """Return a track and its problem; InvalidField for columns of different or no length."""
    count, headings = len(person.times), person.headings
    if not count:
        raise InvalidField(f"{where}/times", "no sample, expected two or more")
    for name in ("positions", "headings"):
        column = getattr(person, name)
        if column is not None and len(column) != count:
            text = f"{len(column)} samples, expected {count} as in times"
            raise InvalidField(f"{where}/{name}", text)
    x, y = np.array(person.positions).T
    faced = None if headings is None else track.floor_headings(np.array(headings))
    walk = Track(person.id, np.array(person.times), track.floor_points(x, y), faced)
    return walk, track.find_problem(walk)
