"""`posefield pose` and `posefield clip`: one motion of a model."""

from pathlib import Path
from typing import Annotated

import typer

from service.cli.answers import tell, wrote
from service.cli.arguments import (
    Controls,
    ExactControls,
    Extrapolate,
    JointNames,
    JointSigma,
    Json,
    LengthUnit,
    LevelOfDetail,
    Loop,
    ModelPath,
    Performer,
    PinFeet,
    RootMotion,
    Targets,
    UpAxis,
    encoder,
    numbers,
    open_model,
)
from service.encode import POSE_ENCODERS
from service.motion import files
from service.synthesis import clips, poses, spelling
from service.synthesis.question import ClipQuestion, PoseQuestion


def pose(
    model: ModelPath,
    control: Controls = None,
    time: Annotated[list[float] | None, typer.Option(help="seconds from the start")] = None,
    extrapolate: Extrapolate = "warn",
    performer: Performer = None,
    level: LevelOfDetail = 0,
    joint_sigma: JointSigma = False,
    exact: ExactControls = None,
    target: Targets = None,
    pin_feet: PinFeet = False,
) -> None:
    """Answer with the pose at one or more times, as JSON."""
    synthesizer = open_model(model)
    controls, times = numbers(control or []), time or [0.0]
    held = spelling.hold(exact, target or (), pin_feet)
    asked = PoseQuestion(controls, times, extrapolate, performer, level, joint_sigma, held)
    answer = poses.pose(synthesizer, asked)
    tell(answer.trust)
    typer.echo(POSE_ENCODERS["json"].encode(answer).decode())


def clip(
    model: ModelPath,
    output: Annotated[Path, typer.Option("--output", "-o", help="file; its ending is the format")],
    control: Controls = None,
    fps: Annotated[float, typer.Option(help="frames a second")] = 30.0,
    start: Annotated[float, typer.Option(help="seconds")] = 0.0,
    end: Annotated[float | None, typer.Option(help="seconds; the whole clip if not said")] = None,
    extrapolate: Extrapolate = "warn",
    performer: Performer = None,
    level: LevelOfDetail = 0,
    names: JointNames = "own",
    root: RootMotion = "travelling",
    loop: Loop = False,
    joint_sigma: JointSigma = False,
    exact: ExactControls = None,
    target: Targets = None,
    pin_feet: PinFeet = False,
    unit: LengthUnit = None,
    up: UpAxis = None,
    json: Json = False,
) -> None:
    """Write a clip as usda, usdc, usdz, glb, bvh, json, npz, arrow or msgpack."""
    found = encoder(output)
    convention = found.convention(unit, up)
    synthesizer = open_model(model)
    controls = numbers(control or [])
    held = spelling.hold(exact, target or (), pin_feet)
    asked = ClipQuestion(
        *(controls, fps, extrapolate, start, end, performer, level, names, root, loop),
        joint_sigma=joint_sigma,
        hold=held,
    )
    answer = clips.clip(synthesizer, asked)
    files.write(found.encode(answer, convention), output)
    tell(answer.trust)
    typer.echo(wrote(output, answer, json))
