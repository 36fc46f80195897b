"""The `posefield pose`, `clip` and `crowd` commands: motions of a model."""

from pathlib import Path
from typing import Annotated, Any

import typer
from msgspec import structs

from posefield.common import atomic_files
from posefield.common.errors import InvalidField
from posefield.console.options import (
    CharacterOptions,
    Json,
    ModelPath,
    open_model,
    with_option_groups,
    with_question_options,
)
from posefield.console.output import as_json, print_warnings, written_message
from posefield.encode.formats import POSE_ENCODERS, ClipEncoder, encoder_for
from posefield.question.motion_question import FileQuestion, PoseQuestion
from posefield.question.results import ClipAnswer
from posefield.question.walk_question import WalkQuestion
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer
from posefield.tracks import route_tracks, track_files
from posefield.tracks.track import TrackSet
from posefield.tracks.track_files import HeadingUnit, TrackReading


@with_question_options(PoseQuestion, default_values={"times": [0.0]})
def pose(model: ModelPath, question: PoseQuestion, json: Json = False) -> None:
    """Print the poses at one or more times as JSON.

    The output is JSON with and without --json.
    """
    answer = poses.synthesize_poses(open_model(model), question)
    print_warnings(answer.trust)
    typer.echo(POSE_ENCODERS["json"].encode(answer).decode())


@with_question_options(FileQuestion, without={"character"})
@with_option_groups
def clip(
    model: ModelPath,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="output file; its extension selects the format")
    ],
    question: FileQuestion,
    character: CharacterOptions,
    json: Json = False,
) -> None:
    """Write a clip to a file: USD, glTF, BVH or numbers.

    The file's extension is usda, usdc, usdz, glb, bvh, json, vrma, npz, arrow or msgpack; bvh
    carries no curves. With --character, the character of another file moves: USD files refer to it,
    glTF files animate its nodes, others have its skeleton. Blender plays USD files at the scene's
    frame rate, 24 by default: write them with --fps 24, or set the scene's rate.

    Of a model of a robot a name such as walk.mjlab.npz writes a reference motion, in any format
    that `posefield doctor` writes.
    """
    encoder = encoder_for(output)
    answer, content = _clip_file(open_model(model), encoder, output, question, character)
    atomic_files.write(content, output)
    print_warnings(answer.trust)
    typer.echo(written_message(output, answer, json))


def _clip_file(
    opened: Synthesizer,
    encoder: ClipEncoder,
    output: Path,
    question: FileQuestion,
    character: CharacterOptions,
) -> tuple[ClipAnswer, bytes]:
    """Return a clip and its file, of the model's own or of a user's character."""
    encoder.check(opened.session.card.robot)
    delivery = character.delivery(encoder, question, output)
    if delivery is None:
        convention = encoder.convention(question.unit, question.up, question.body)
        answer = encoder.noted(clips.synthesize_clip(opened, question))
        return answer, encoder.encode(answer, convention)
    card = opened.session.card
    delivery.check(question, card.skeleton, card.roles)
    predicted = clips.synthesize_clip(opened, question)
    answer = encoder.noted(delivery.clip(predicted, question, card.roles))
    return answer, delivery.encode(answer)


DEFAULT_COUNT, DEFAULT_SECONDS = 500, 10.0


def _refuse(why: str, **options: Any) -> None:
    """Raise InvalidField for the first of some options that is given."""
    for name, value in options.items():
        if value is not None and value is not False:
            raise InvalidField(name, f"{value}, expected none {why}")


@with_question_options(WalkQuestion, without={"count", "seconds"})
def crowd(
    model: ModelPath,
    output: Annotated[
        list[Path],
        typer.Option(
            "--output",
            "-o",
            help="output file: usd, usda, usdc, usdz, npz, bones.npz, arrow, osi, carla.npz or sdf;"
            " may be given again with other endings, for the same motions computed once",
        ),
    ],
    question: WalkQuestion,
    count: Annotated[
        int | None,
        typer.Option(help=f"number of characters, each on its own path; default: {DEFAULT_COUNT}"),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(help=f"duration, s; default: {DEFAULT_SECONDS:g}")
    ] = None,
    paths: Annotated[
        Path | None,
        typer.Option(
            help="instead of random paths: JSON list of routes with waypoints (x, z pairs, m) and "
            "speed (m/s)",
            metavar="FILE",
        ),
    ] = None,
    trajectories: Annotated[
        Path | None,
        typer.Option(
            help="instead of random paths: places over time, which people follow for as long as "
            "they last: SUMO FCD or CommonRoad (.xml), JuPedSim (.sqlite, .txt) or a table (.csv) "
            "of time,id,x,y or time,id,x,y,heading, in seconds and metres, x east and y north",
            metavar="FILE",
        ),
    ] = None,
    heading_unit: Annotated[
        HeadingUnit | None,
        typer.Option(help="unit of the headings of a table, from east against the clock"),
    ] = None,
    y_down: Annotated[bool, typer.Option(help="y points down, as in images")] = False,
    skip_bad: Annotated[
        bool, typer.Option(help="leave out, and name, people whose trajectory is unusable")
    ] = False,
    split: Annotated[
        float | None,
        typer.Option(min=0.01, help="seconds without a sample after which people return as ID~2"),
    ] = None,
    people_per_file: Annotated[
        int | None,
        typer.Option(
            help="write trajectories of any length in parts of so many people, to a folder that is "
            "named as the output without its ending; the same command resumes",
            metavar="N",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="number of processes that make parts; default: 1")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="make parts on the workers of this Dask scheduler, which share the folder",
            metavar="tcp://HOST:PORT",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Write a walking crowd to a file.

    Each character walks on its own path at its own varying speed, or follows a trajectory.
    """
    from posefield.batch import process_pool
    from posefield.cli import crowd_files

    process_pool.limit_threads()
    if len(set(output)) < len(output):
        raise InvalidField("output", "the same file twice, expected each once")
    if trajectories:
        _refuse("with trajectories", seconds=seconds, paths=paths)
    else:
        _refuse("without trajectories", heading_unit=heading_unit, y_down=y_down, split=split)
        _refuse("without trajectories", skip_bad=skip_bad, people_per_file=people_per_file)
    if paths or trajectories:
        _refuse("for given paths: each has one character", count=count, motions=question.motions)
    if people_per_file is None:
        _refuse("without people_per_file", workers=workers, scheduler=scheduler)
    reading, tracks = TrackReading(heading_unit, y_down, split), None
    if trajectories and people_per_file is not None:
        job = crowd_files.parts_job(
            model, trajectories, output, people_per_file, question, reading, skip_bad
        )
        manifest = crowd_files.write_parts(job, workers, scheduler)
        typer.echo(as_json(manifest) if json else crowd_files.parts_text(manifest, job.folder))
        return
    if trajectories:
        tracks = track_files.read_tracks(trajectories, reading, skip_bad)
        count = len(tracks.tracks)
    question = structs.replace(
        question,
        count=DEFAULT_COUNT if count is None else count,
        seconds=DEFAULT_SECONDS if seconds is None else seconds,
    )
    opened = open_model(model)
    if paths:
        routes = crowd_files.routes(paths)
        question = structs.replace(question, count=len(routes))
        followed = route_tracks.tracks_of_routes(opened.gait, routes, question.seconds)
        tracks = TrackSet(followed, {})
    facts = crowd_files.write_crowd(opened, question, output, tracks)
    typer.echo(as_json(facts) if json else crowd_files.report_text(facts))
