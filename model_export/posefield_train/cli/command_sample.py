"""Commands `posefield convert` and `posefield sample`: files of converted and procedural motion."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from posefield.common import atomic_files
from posefield.common.errors import InvalidField, did_you_mean
from posefield.common.units import UpAxis
from posefield.console.options import Json, encoder_for, parse_controls, with_option_groups
from posefield.console.output import as_json, written_message
from posefield.question.results import ClipAnswer, Trust

if TYPE_CHECKING:
    from posefield_train.sample.sample_files import SampleTrial


CONVERT_EXAMPLES = [
    "convert kick.fbx -o kick.bvh",
    'convert pack.glb --animation "kick left" -o kick_left.bvh',
]


@dataclass(frozen=True)
class SourceArguments:
    """The file, and its conventions where it does not state them."""

    file: Annotated[
        Path,
        typer.Argument(
            help="FBX, GLB, glTF, USD, AMC or BVH file", metavar="FILE", show_default=False
        ),
    ]
    animation: Annotated[
        str | None,
        typer.Option(help="animation of a file that holds several, by name or USD path"),
    ] = None
    skeleton: Annotated[
        str | None,
        typer.Option(help="skeleton of a file that moves several, by name, path or a joint"),
    ] = None
    unit: Annotated[
        float | None,
        typer.Option(
            help="length of the file's unit in metres; it overrules that of the file",
            metavar="METRES",
        ),
    ] = None
    up: Annotated[
        UpAxis | None, typer.Option(help="up axis of the file; it overrules that of the file")
    ] = None
    rate: Annotated[
        float | None,
        typer.Option(
            help="frames a second: of AMC and BVH files, and to sample the curves of others",
            metavar="FPS",
        ),
    ] = None
    blender: Annotated[
        Path | None,
        typer.Option(
            help="Blender, or a Python with the module bpy, for FBX files; default: blender on the "
            "PATH"
        ),
    ] = None


@with_option_groups
def convert(
    source: SourceArguments,
    output: Annotated[Path, typer.Option("--output", "-o", help="output .bvh file")],
    json: Json = False,
) -> None:
    """Convert a motion file to BVH, in centimetres with y up.

    FBX files are read by an installed Blender, 4.2 or later.
    """
    from posefield_train.convert import converted_file
    from posefield_train.source.motion_file import ReadOptions

    if output.suffix.lower() != ".bvh":
        raise InvalidField("output", f"{output.name!r}, expected a name that ends in .bvh")
    for name, value in (("unit", source.unit), ("rate", source.rate)):
        if value is not None and not 0.0 < value < float("inf"):
            raise InvalidField(name, f"{value}, expected a positive number")
    options = ReadOptions(source.rate, source.animation, source.skeleton, source.unit, source.up)
    converted = converted_file.convert(source.file, options, source.blender)
    atomic_files.write(converted.content, output)
    facts = {
        "file": str(output),
        "frames": len(converted.clip),
        "fps": converted.clip.rate,
        "joints": len(converted.clip.skeleton),
        "notes": list(converted.notes),
    }
    if json:
        typer.echo(as_json(facts))
        return
    for note in converted.notes:
        typer.echo(f"note: {note}")
    typer.echo(
        f"{output}: {len(converted.clip)} frames at {converted.clip.rate:g} a second, "
        f"{len(converted.clip.skeleton)} joints, in centimetres with y up"
    )


MOST_CLIPS = 20_000
"""Largest number of clips of one family: as many files as a folder is used with."""
FAMILY = "reaching"


@dataclass(frozen=True)
class NoiseFreeMotion:
    """Noise-free motion in place of a family: whether, at which controls and which frame rate."""

    truth: Annotated[
        bool,
        typer.Option(
            "--truth",
            help="write the noise-free motion of reaching at the controls of --control",
        ),
    ] = False
    control: Annotated[
        list[str] | None,
        typer.Option(
            "--control",
            "-c",
            help="with --truth: value of a control; all are needed; may be repeated",
            metavar="NAME=VALUE",
        ),
    ] = None
    fps: Annotated[float, typer.Option(help="frame rate with --truth, frames a second")] = 120.0


@dataclass(frozen=True)
class FamilySize:
    """Size of the family: number of clips, and seed of their noise."""

    clips: Annotated[
        int | None,
        typer.Option(help="number of clips; default: 92", min=1, max=MOST_CLIPS),
    ] = None
    seed: Annotated[
        int | None,
        typer.Option(help="random seed of the noise; default: 2006", min=0),
    ] = None


@with_option_groups
def sample(
    family: Annotated[str, typer.Argument(help="name of the family: reaching", metavar="FAMILY")],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="output folder; with --truth, output file")
    ],
    true: NoiseFreeMotion,
    size: FamilySize,
    json: Json = False,
) -> None:
    """Write the procedural family of motions, or its noise-free motion.

    reaching: people who reach, in any number of clips; its noise-free motion exists at any control
    point.
    """
    from posefield_train.sample import noise_free

    if family != FAMILY:
        suggestion = did_you_mean(family, [FAMILY])
        raise InvalidField("family", f"{family!r}{suggestion}, expected {FAMILY}")
    size_options = [
        option.name for option in fields(size) if getattr(size, option.name) is not None
    ]
    if true.truth and size_options:
        raise InvalidField(size_options[0], "found with --truth, expected for a family of clips")
    if not true.truth:
        path = _write_reaching(output, size)
        typer.echo(
            as_json({"recipe": str(path)}) if json else f"{path}: train it with posefield train"
        )
        return
    encode = encoder_for(output).encode
    controls = parse_controls(true.control or [])
    clip = noise_free.truth_clip(controls, true.fps)
    answer = ClipAnswer(
        clip, Trust("reaching@truth", controls, None, 0, clip.duration, 0.0, True, ())
    )
    atomic_files.write(encode(answer), output)
    typer.echo(written_message(output, answer, json))


def _write_reaching(output: Path, size: FamilySize) -> Path:
    """Write the procedural family with a progress bar, and return the path of its recipe."""
    from posefield.console.progress import ProgressBar
    from posefield_train.sample import sample_files

    count = sample_files.COUNT if size.clips is None else size.clips
    seed = sample_files.SEED if size.seed is None else size.seed
    with ProgressBar("motions", count) as bar:

        def watched() -> "Iterator[SampleTrial]":
            for trial in sample_files.samples(count, seed):
                bar.advance(1)
                yield trial

        return sample_files.write_family(output, watched())
