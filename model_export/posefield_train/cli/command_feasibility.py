"""Command `posefield feasibility`: forces and faults of a robot's model over its commands."""

from pathlib import Path
from typing import Annotated

import typer

import posefield
from posefield.common import atomic_files
from posefield.common.errors import InvalidField
from posefield.console.options import Json, ModelPath
from posefield_train.cli import output_files

EXAMPLES = ["feasibility gaits.onnx --robot robot.xml -o gaits.html"]


def feasibility(
    model: ModelPath,
    robot: Annotated[
        Path, typer.Option(help="the robot with its masses and actuators, an MJCF or URDF file")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="page, .html; JSON beside it")],
    per_control: Annotated[
        int, typer.Option(help="values of each control over its captured range", min=2, max=50)
    ] = 5,
    json: Json = False,
) -> None:
    """Measure whether a robot can do what its model answers, all over the commands.

    Limits of joints, torques against the limits of actuators, the zero-moment point against the
    soles, forces that the soles cannot give, sliding and sunk feet, and the seam. Commands that
    break a bound are listed.
    """
    from posefield_train.report import robot_feasibility
    from posefield_train.robots.robot_dynamics import Dynamics

    output_files.expect_html(output)
    opened = posefield.load(model)
    body, dynamics = opened.synthesizer.session.card.robot, Dynamics(robot)
    if body is None:
        raise InvalidField("MODEL", f"{model} is of no robot, expected a recipe with [robot]")
    if dynamics.robot.hinges != body.hinges:
        names = sorted({*body.hinges} ^ {*dynamics.robot.hinges}) or ["the order of all"]
        fault = f"{robot.name} has other joints than the model, expected its {len(body.hinges)}"
        raise InvalidField("--robot", f"{fault}; unlike: {', '.join(names)}")
    result = robot_feasibility.measure(opened, dynamics, per_control)
    atomic_files.write(result.html(), output)
    atomic_files.write(result.json(), output.with_suffix(".json"))
    if json:
        typer.echo(result.json().decode(), nl=False)
        return
    typer.echo(f"{output}: {len(result.rows)} commands, {len(result.broken)} beyond a bound")
