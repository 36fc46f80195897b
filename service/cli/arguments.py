"""What commands take: the arguments that several have, and words made into what they mean."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from service.encode import ENCODERS, Encoder
from service.encode.convention import Unit, Up
from service.motion.errors import InvalidField, ModelError, UnknownFormat
from service.motion.roles import Names
from service.synthesis import library
from service.synthesis.question import Policy, Root
from service.synthesis.synthesizer import Synthesizer

ModelPath = Annotated[Path, typer.Argument(help="a model file", metavar="MODEL")]
Controls = Annotated[
    list[str] | None,
    typer.Option(
        "--control",
        "-c",
        help="NAME=VALUE, once for each control; a model chooses what is left out",
        metavar="NAME=VALUE",
    ),
]
Extrapolate = Annotated[
    Policy, typer.Option(help="controls like which nothing was captured: answer, warn, refuse")
]
Performer = Annotated[
    str | None, typer.Option(help="who moves, by name; somebody never seen if not said")
]
LevelOfDetail = Annotated[int, typer.Option(help="level of detail: 0 is the finest")]
JointNames = Annotated[Names, typer.Option(help="what joints are called")]
RootMotion = Annotated[Root, typer.Option(help="whether the root travels")]
Loop = Annotated[bool, typer.Option("--loop", help="one whole cycle whose last frame is its first")]
JointSigma = Annotated[
    bool, typer.Option("--joint-sigma", help="say how far each joint may err, too")
]
ExactControls = Annotated[
    str | None,
    typer.Option(
        "--exact",
        help="measured controls to be met exactly: auto (those given), none, or names",
        metavar="auto|none|NAME,NAME",
    ),
]
Targets = Annotated[
    list[str] | None,
    typer.Option(
        "--target",
        help="where a joint is to be, m; MOMENT is seconds, start, end, event, highest, lowest "
        "or farthest; may be repeated",
        metavar="JOINT@MOMENT=X,Y,Z",
    ),
]
PinFeet = Annotated[bool, typer.Option("--pin-feet", help="keep feet that stand where they stand")]
LengthUnit = Annotated[
    Unit | None, typer.Option(help="of length in the file; the format's own if not said")
]
UpAxis = Annotated[Up | None, typer.Option(help="in the file; the format's own if not said")]
Json = Annotated[bool, typer.Option("--json", help="answer as JSON on standard output")]


def open_model(path: Path) -> Synthesizer:
    """The one model of a file."""
    if path.is_dir():
        raise ModelError(path, "a folder, expected one .onnx file")
    return next(iter(library.load([path]).models.values()))


def numbers(pairs: Sequence[str]) -> dict[str, float]:
    """Controls of NAME=VALUE words; InvalidField for one that is not, or is given twice."""
    controls: dict[str, float] = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not equals or name in controls:
            raise InvalidField("control", f"{pair!r}, expected NAME=VALUE, each name once")
        try:
            controls[name] = float(value)
        except ValueError as fault:
            raise InvalidField(f"controls/{name}", f"{value!r}, expected a number") from fault
    return controls


def encoder(path: Path) -> Encoder:
    """Encoder of the format that a path ends in."""
    ending = path.suffix.removeprefix(".")
    if ending not in ENCODERS:
        raise UnknownFormat("output", f"{path.name!r} ends in none of {', '.join(ENCODERS)}")
    return ENCODERS[ending]
