"""Operation that answers with a crowd of people who follow tracks, in every format of one file.

It has a path of its own: `crowd.npz` and `crowd.arrow` are poses of characters, which these names
meant first, and Accept cannot choose among three formats that are all NPZ.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct
from starlette.responses import Response

from posefield.common import atomic_files, cancellation
from posefield.common.bounded_types import Whole
from posefield.common.errors import InvalidField
from posefield.encode import character, crowd_formats, crowd_size
from posefield.encode.archives import Format
from posefield.encode.crowd_size import CrowdCounts
from posefield.encode.formats import CROWD_FORMATS
from posefield.http import responses
from posefield.http.api.settings import Settings
from posefield.http.batching import CROWD_LIMITER, run_in_thread
from posefield.http.crowd_operations import check_values
from posefield.http.request import ServiceRequest, read_body
from posefield.locomotion import walking_crowd
from posefield.model_file.model_card import ModelCard
from posefield.motion.clip import CrowdClip
from posefield.question import json_decoding
from posefield.question.motion_question import (
    DEFAULT_BODY,
    DEFAULT_VARIETY,
    Body,
    FeetMode,
    LabelValue,
)
from posefield.question.walk_question import Instancing, WalkerTake, WalkQuestion
from posefield.tracks import track, track_crowd
from posefield.tracks.track import Track, TrackSet

TRACK_FORMATS: Mapping[str, Format] = {
    **CROWD_FORMATS,
    **{name: form for name, form in crowd_formats.CROWD_FILES.items() if not form.beside},
}
"""Formats of one file: Gazebo's world has files beside it."""


class TrackBody(Struct, frozen=True, forbid_unknown_fields=True):
    """Track (schema of the contract)."""

    id: Annotated[str, Meta(min_length=1, max_length=200)]
    times: list[float]
    positions: list[tuple[float, float]]
    headings: list[float] | None = None


class TracksBody(Struct, frozen=True, forbid_unknown_fields=True):
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


def read_tracks(body: TracksBody, limit: int) -> TrackSet:
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
    problem_of_all = track.find_file_problem(track.sums(tracks))
    if problem_of_all is not None:
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


def check_size(
    body: TracksBody, tracks: TrackSet, ending: str, card: ModelCard, settings: Settings
) -> None:
    """Raise InvalidField for frames, poses or bytes beyond the limits, before anything is made.

    Each person has all frames of the clock that they share, as in the files.
    """
    walking_crowd.frame_count(1, 1.0, body.fps, body.seed)
    begin = min(walk.times[0] for walk in tracks.tracks)
    seconds = float(max(walk.times[-1] for walk in tracks.tracks) - begin)
    frames, people = int(seconds * body.fps) + 2, len(tracks.tracks)
    points = character.body_size(card.skeleton, body.body or DEFAULT_BODY)
    counts = CrowdCounts(len(card.skeleton), people, people, frames, points, len(card.curves))
    if ending in CROWD_FORMATS:
        size = crowd_size.file_size_bound(counts, ending, body.instancing == "flatten")
    else:
        size = crowd_size.table_size_bound(counts, ending)
    for number, text, limit in (
        (frames, "frames from the first sample to the last", settings.crowd_frames),
        (people * frames, f"poses of {people} in {frames} frames", settings.crowd_poses),
        (size, f"bytes of {people} in {frames} frames as {ending}", settings.output_limit),
    ):
        if number > limit:
            raise InvalidField("tracks", f"{number} {text}, expected at most {limit}")


async def answer_tracks(request: ServiceRequest) -> Response:
    """Answer with people who follow tracks, in the bytes that the command writes."""
    model, service, settings = request.model, request.service, request.service.settings
    ending, card = request.format, request.model.session.card
    content = await read_body(request, settings.crowd_body_limit, service.bodies)

    def work() -> tuple[list[str], Iterator[bytes]]:
        check_values(content, settings.crowd_limit)
        body = json_decoding.decode_question(TracksBody, content)
        tracks = read_tracks(body, settings.crowd_limit)
        check_size(body, tracks, ending, card, settings)
        question = body.question(len(tracks.tracks))
        crowd_formats.ending_of(Path(f"crowd.{ending}"), question)
        crowd = track_crowd.build_crowd(model, model.gait, question, tracks.tracks)
        skipped = track_crowd.left_out({**tracks.skipped, **crowd.facts["skipped"]})
        warnings = track_crowd.shorten([*skipped, *crowd.facts["warnings"]])
        return warnings, _pieces(crowd, ending, question, card.roles)

    warnings, pieces = await run_in_thread(work, limiter=CROWD_LIMITER)
    form = TRACK_FORMATS[ending]
    return responses.stream(pieces, form, model.name, warnings, CROWD_LIMITER, model.identity)


def _pieces(
    crowd: CrowdClip, ending: str, question: WalkQuestion, roles: Mapping[str, str]
) -> Iterator[bytes]:
    """Return an iterator over the bytes of a crowd's file; InvalidField at once, as writers do."""
    if ending in CROWD_FORMATS:
        # usd-core takes 0.12 CPU seconds to import.
        from posefield.encode import crowd_writer

        body = question.body or DEFAULT_BODY
        return crowd_writer.stream(crowd, ending, question.instancing, body)
    # A writer may refuse a model without roles: with the first piece a response would have begun.
    folder = TemporaryDirectory()
    path = Path(folder.name, f"crowd.{ending}")
    try:
        crowd_formats.write(crowd, path, question, roles)
    except BaseException:
        folder.cleanup()
        raise
    return _sent_from(folder, path)


def _sent_from(folder: "TemporaryDirectory[str]", path: Path) -> Iterator[bytes]:
    with folder:
        yield from atomic_files.read_chunks(path)
