"""The `posefield` command: what ships with the service; the training job adds its own commands.

Exit codes: 0 done; 1 `check` found defects; 2 a question or an argument that cannot be answered;
3 a file that cannot be used; 4 samples from which no model can be made; 5 a process of an export
that died; 128 and a signal's number where that ended an export.
"""

import sys
from collections.abc import Sequence
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import orjson
import typer

from service import __version__, exports, page
from service.encode import ENCODERS, POSE_ENCODERS, Encoder, reasons, suggestions
from service.encode.convention import Unit, Up
from service.export import queries
from service.motion import card as cards
from service.motion import files, measure
from service.motion.answer import ClipAnswer, Reasons, Trust
from service.motion.errors import (
    FileError,
    InvalidField,
    ModelError,
    MotionError,
    TrainingError,
    UnknownFormat,
    WorkerDied,
)
from service.motion.roles import Names
from service.synthesis import clips, library, pace, poses, session, spelling
from service.synthesis.question import ClipQuestion, Policy, PoseQuestion, Root
from service.synthesis.suggest import COUNT, SuggestQuestion
from service.synthesis.suggest import suggest as find_suggestions
from service.synthesis.synthesizer import Synthesizer
from service.synthesis.view import Camera
from service.synthesis.why import NEAREST, WhyQuestion
from service.synthesis.why import why as find_reasons

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)

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

INTERRUPTED = 130
"""What a shell expects of a command that was told to stop."""

# Whose extra a missing module is; everything else that can be missing is training's.
EXTRAS = {
    **dict.fromkeys(("joblib", "numba", "sklearn"), "evaluate"),
    "distributed": "dask",
    "obstore": "store",
    **dict.fromkeys(("jwt", "cryptography"), "jwt"),
}


def main() -> None:
    """Run the command line; faults that have a name end as one line and an exit code."""
    for plugin in entry_points(group="posefield.commands"):
        # The image holds the service alone.
        if find_spec(plugin.module.partition(".")[0]):
            plugin.load()(app)
    try:
        app()
    except ModuleNotFoundError as fault:
        extra = EXTRAS.get(fault.name or "", "train")
        typer.echo(f"posefield: needs {fault.name}: install posefield[{extra}]", err=True)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except MotionError as fault:
        typer.echo(f"posefield: {fault}", err=True)
        sys.exit(_code(fault))


def _code(fault: MotionError) -> int:
    if isinstance(fault, FileError):
        return 3
    if isinstance(fault, TrainingError):
        return 4
    return 5 if isinstance(fault, WorkerDied) else 2


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[bool, typer.Option("--version", help="say the version")] = False,
) -> None:
    if version:
        typer.echo(f"posefield {__version__}")
        raise typer.Exit


@app.command()
def inspect(model: ModelPath, json: Json = False) -> None:
    """Say what a model file is: its controls, its skeleton, its errors, where it comes from, and
    what a pose costs here."""
    opened = session.load(model)
    plain = {
        "identity": f"{model.stem}@{opened.digest}",
        **cards.plain_values(opened.card),
        "seconds_per_pose": pace.seconds_per_pose(opened),
    }
    typer.echo(as_json(plain) if json else _summary(plain))


@app.command()
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
    _tell(answer.trust)
    typer.echo(POSE_ENCODERS["json"].encode(answer).decode())


@app.command()
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
    _tell(answer.trust)
    typer.echo(wrote(output, answer, json))


@app.command()
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
        camera=None if camera is None else lens(camera, fov, height),
        pixels=pixels,
    )
    facts = crowds.write(open_model(model), asked, instancing, output)
    typer.echo(as_json(facts) if json else crowds.said(facts))


def lens(position: str, fov: float, height: float) -> Camera:
    """Camera at a position in words; InvalidField for one that is none."""
    try:
        return Camera(np.array([float(word) for word in position.split(",")]), fov, height)
    except ValueError as fault:
        raise InvalidField("camera", f"{position!r}, expected X,Y,Z in metres") from fault


@app.command()
def why(
    model: ModelPath,
    control: Controls = None,
    extrapolate: Extrapolate = "warn",
    performer: Performer = None,
    nearest: Annotated[int, typer.Option(help="captured clips to list")] = NEAREST,
    json: Json = False,
) -> None:
    """Say what an answer is made of: the captured clips near it, and what each counts for."""
    synthesizer = open_model(model)
    asked = WhyQuestion(numbers(control or []), extrapolate, performer, nearest)
    found = find_reasons(synthesizer, asked)
    _tell(found)
    typer.echo(as_json(reasons.plain(found)) if json else reasons.text(found))


@app.command()
def suggest(
    model: ModelPath,
    count: Annotated[int, typer.Option(help="points to list")] = COUNT,
    performer: Annotated[
        str | None,
        typer.Option(help="whose clips alone count as captured; everybody's if not said"),
    ] = None,
    candidates: Annotated[
        Path | None,
        typer.Option(
            help="CSV, Parquet or JSON Lines of points that can be captured", metavar="FILE"
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Say which clips to capture next: where one more would be worth most, the first first."""
    synthesizer = open_model(model)
    given = queries.points(candidates, synthesizer) if candidates else None
    found = find_suggestions(synthesizer, SuggestQuestion(count, performer, given))
    typer.echo(as_json(suggestions.plain(found)) if json else suggestions.text(found))


app.command()(exports.export)
app.command()(page.page)


@app.command()
def serve(
    places: Annotated[
        list[str],
        typer.Argument(help="model files, folders of them, or URLs of object stores"),
    ],
    host: Annotated[str | None, typer.Option(help="address; POSEFIELD_HOST or 127.0.0.1")] = None,
    port: Annotated[int | None, typer.Option(help="port; POSEFIELD_PORT or 8000")] = None,
) -> None:
    """Answer over HTTP for the models given, until interrupted."""
    from service.web import server, settings

    server.serve(places, settings.read(host=host, port=port))


@app.command()
def key(
    name: Annotated[str, typer.Argument(help="whose key it is, as the log will name it")],
    model: Annotated[
        list[str] | None, typer.Option(help="a model that it may read; all if none is named")
    ] = None,
    metrics: Annotated[bool, typer.Option("--metrics", help="let it read /metrics too")] = False,
    json: Json = False,
) -> None:
    """Make an API key: the line for POSEFIELD_KEYS_FILE on standard output, and, once, the key
    itself on standard error."""
    from service.web.access import keys

    scopes = [f"read:{one}" for one in model or ["*"]] + ["metrics"] * metrics
    secret = keys.make()
    line = keys.line(name, scopes, secret)
    if json:
        typer.echo(as_json({"key": secret, "line": line}))
        return
    typer.echo(line)
    typer.echo(f"the key of {name}, which is kept nowhere: {secret}", err=True)


@app.command()
def check(
    file: Annotated[Path, typer.Argument(help="a usda, usdc, usd or usdz file")],
    json: Json = False,
) -> None:
    """Find what makes a USD character fail in some reader though validators pass it."""
    from service.check import check as find

    findings = find(file)
    if json:
        typer.echo(as_json([vars(finding) for finding in findings]))
    else:
        for finding in findings:
            typer.echo(f"{finding.severity}: {finding.prim}: {finding.message} [{finding.code}]")
        typer.echo(f"{file}: {len(findings)} findings")
    if any(finding.severity == "error" for finding in findings):
        raise typer.Exit(1)


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


def wrote(path: Path, answer: ClipAnswer, json: bool) -> str:
    """What to tell of a clip that was written."""
    frames = len(answer.clip)
    if json:
        return as_json(
            {"file": str(path), "frames": frames, "rate": answer.clip.rate, **answer.trust.facts()}
        )
    return (
        f"{path}: {frames} frames at {answer.clip.rate:g} a second, {answer.trust.duration:.2f} s, "
        f"give or take {100 * answer.trust.sigma:.1f} cm"
    )


def _tell(found: Trust | Reasons) -> None:
    """Say on standard error what was chosen for whoever asked, and what to beware of."""
    if found.inferred:
        chosen = " ".join(f"{name}={found.controls[name]!r}" for name in found.inferred)
        typer.echo(f"inferred: {chosen}, most typical for what was given", err=True)
    for warning in found.warnings:
        typer.echo(f"warning: {warning}", err=True)


def as_json(value: Any) -> str:
    """Plain values as JSON to read."""
    return orjson.dumps(value, option=orjson.OPT_INDENT_2).decode()


def _level(number: int, level: dict[str, Any], seconds: float) -> str:
    return (
        f"  {number}: ranks {level['ranks']} of {level['samples']} clips, {level['numbers']} "
        f"numbers, {level['operations']} multiply-adds a pose, off by {100 * level['rms']:.2f} cm, "
        f"the worst pose by {100 * level['pose']:.1f} cm, here {1e6 * seconds:.2f} µs a pose"
    )


def _control(plain: dict[str, Any], joints: list[str]) -> str:
    """A control in a line: what of it was sampled, and how it is measured where it is."""
    span = f"{plain['minimum']:g} to {plain['maximum']:g} {plain['unit']}"
    own = plain.get("measure")
    how = f" (measured: {measure.words(measure.parse(own), joints)})" if own else ""
    return f"  {plain['name']}: {span}, {plain['description']}{how}"


def _summary(plain: dict[str, Any]) -> str:
    """A model card on one screen."""
    diagnostics = plain["diagnostics"]
    levels = zip(plain["levels"], plain["seconds_per_pose"], strict=True)
    lines = [
        f"{plain['identity']}: {plain['description']}",
        f"{plain['samples']} clips of {len(plain['skeleton']['names'])} joints, "
        f"{plain['durations'][0]:.2f} to {plain['durations'][1]:.2f} s, {plain['root']}"
        f"{', cyclic' if plain['cyclic'] else ''}",
        f"ranks {plain['levels'][0]['ranks']} of {diagnostics['tensor']}: truncation costs "
        f"{100 * diagnostics['truncation_rms_m']:.2f} cm, a clip left out lies "
        f"{100 * diagnostics['leave_one_out_rms_m']:.2f} cm away (root mean square over joints)",
        f"levels of detail, times in batches of {pace.BATCH}:",
        *(_level(number, *level) for number, level in enumerate(levels)),
        "controls:",
        *(_control(control, plain["skeleton"]["names"]) for control in plain["controls"]),
        *([f"performers: {', '.join(plain['performers'])}"] if plain["performers"] else []),
        f"licence: {plain['provenance']['licence']}",
        *(f"note: {note}" for note in diagnostics["notes"]),
    ]
    return "\n".join(lines)
