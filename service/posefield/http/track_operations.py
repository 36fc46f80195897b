"""Operation that answers with a crowd of people who follow tracks, in every format of one file.

It has a path of its own: `crowd.npz` and `crowd.arrow` are poses of characters, which these names
meant first, and Accept cannot choose among three formats that are all NPZ.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from starlette.responses import Response

from posefield.common import atomic_files
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
from posefield.question.motion_question import DEFAULT_BODY
from posefield.question.walk_question import WalkQuestion
from posefield.tracks import track_crowd, track_question
from posefield.tracks.track import TrackSet
from posefield.tracks.track_question import TracksQuestion

TRACK_FORMATS: Mapping[str, Format] = {
    **CROWD_FORMATS,
    **{name: form for name, form in crowd_formats.CROWD_FILES.items() if not form.beside},
}
"""Formats of one file: Gazebo's world has files beside it."""


def check_size(
    body: TracksQuestion, tracks: TrackSet, ending: str, card: ModelCard, settings: Settings
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
        body = json_decoding.decode_question(TracksQuestion, content)
        tracks = track_question.read_tracks(body, settings.crowd_limit)
        check_size(body, tracks, ending, card, settings)
        question = body.question(len(tracks.tracks))
        crowd_formats.endings_of([Path(f"crowd.{ending}")], question)
        crowd = track_crowd.of_question(model, question, tracks)
        skipped = track_crowd.left_out(crowd.facts["skipped"])
        warnings = track_crowd.shorten([*skipped, *crowd.facts["warnings"]])
        return warnings, _pieces(crowd, ending, question, card.roles)

    # OSI's libraries know the message by the name.
    name = f"{model.name}_gt_380" if ending == "osi" else model.name
    warnings, pieces = await run_in_thread(work, limiter=CROWD_LIMITER)
    form = TRACK_FORMATS[ending]
    return responses.stream(pieces, form, name, warnings, CROWD_LIMITER, model.identity)


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
