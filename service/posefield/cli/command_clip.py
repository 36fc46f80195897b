"""The `posefield pose` and `posefield clip` commands: one motion of a model."""

from pathlib import Path
from typing import Annotated

import typer

from posefield.common import atomic_files
from posefield.console.arguments import Json, ModelPath, encoder_for, open_model
from posefield.console.output import print_warnings, written_message
from posefield.console.question_options import with_question_options
from posefield.encode.formats import POSE_ENCODERS
from posefield.question.motion_question import FileQuestion, PoseQuestion
from posefield.synthesis import clips, poses


@with_question_options(PoseQuestion, usual={"times": [0.0]})
def pose(model: ModelPath, question: PoseQuestion, json: Json = False) -> None:
    """Print the poses at one or more times as JSON.

    The output is JSON with and without --json.
    """
    answer = poses.synthesize_poses(open_model(model), question)
    print_warnings(answer.trust)
    typer.echo(POSE_ENCODERS["json"].encode(answer).decode())


@with_question_options(FileQuestion)
def clip(
    model: ModelPath,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="output file; its extension selects the format")
    ],
    question: FileQuestion,
    json: Json = False,
) -> None:
    """Write a clip to a file: USD, glTF, BVH or numbers.

    The file's extension is usda, usdc, usdz, glb, bvh, json, npz, arrow or msgpack; bvh carries no
    curves. Blender plays USD files at the scene's frame rate, 24 by default: write them with
    --fps 24, or set the scene's rate.
    """
    found = encoder_for(output)
    convention = found.convention(question.unit, question.up, question.body)
    answer = found.noted(clips.synthesize_clip(open_model(model), question))
    atomic_files.write(found.encode(answer, convention), output)
    print_warnings(answer.trust)
    typer.echo(written_message(output, answer, json))
