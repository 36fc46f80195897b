"""`posefield crowd`: many characters who walk."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from service.cli.answers import as_json
from service.cli.arguments import Json, ModelPath, open_model
from service.motion.errors import InvalidField
from service.synthesis.view import Camera


def crowd(
    model: ModelPath,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="usd, usda, usdc, usdz or npz, by its ending")
    ],
    count: Annotated[
        int | None, typer.Option(help="characters, each on a way of its own; 500 if not said")
    ] = None,
    motions: Annotated[
        int | None, typer.Option(help="different motions they share; each its own if not said")
    ] = None,
    paths: Annotated[
        Path | None,
        typer.Option(
            help='JSON instead: [{"waypoints": [[x, z], ...], "speed": v}, ...], m and m/s'
        ),
    ] = None,
    seconds: Annotated[float, typer.Option(help="how long they walk")] = 10.0,
    fps: Annotated[float, typer.Option(help="frames a second")] = 30.0,
    seed: Annotated[int, typer.Option(help="of all that is random")] = 0,
    level: Annotated[
        int | None, typer.Option(help="level of detail: 0 is the finest, and what is not said")
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            help="instead of a level: where one looks from, m; levels are chosen by what shows",
            metavar="X,Y,Z",
        ),
    ] = None,
    fov: Annotated[float, typer.Option(help="vertical field of view, rad")] = 1.0472,
    height: Annotated[float, typer.Option(help="of the image, pixels")] = 1080.0,
    pixels: Annotated[float, typer.Option(help="that a level's error may cover")] = 1.0,
    instancing: Annotated[
        str, typer.Option(help="references, scenegraph or flatten: what characters share in USD")
    ] = "references",
    json: Json = False,
) -> None:
    """Write a crowd that walks, each character on its own way at its own changing speed."""
    from service import crowds
    from service.synthesis.walk import order

    if paths and count is not None:
        raise InvalidField("count", f"{count}, expected none: every path has one character")
    asked = order.Order(
        count=order.COUNT if count is None else count,
        routes=crowds.routes(paths) if paths else (),
        motions=motions,
        seconds=seconds,
        fps=fps,
        seed=seed,
        level=level,
        camera=None if camera is None else _lens(camera, fov, height),
        pixels=pixels,
    )
    facts = crowds.write(open_model(model), asked, instancing, output)
    typer.echo(as_json(facts) if json else crowds.said(facts))


def _lens(position: str, fov: float, height: float) -> Camera:
    """Camera at a position in words; InvalidField for one that is none."""
    try:
        return Camera(np.array([float(word) for word in position.split(",")]), fov, height)
    except ValueError as fault:
        raise InvalidField("camera", f"{position!r}, expected X,Y,Z in metres") from fault
