"""Command `posefield convert`: a motion file to BVH."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from posefield.common import atomic_files
from posefield.common.errors import InvalidField
from posefield.common.units import UpAxis
from posefield.console.options import Json, with_option_groups
from posefield.console.output import as_json

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
    found = converted_file.convert(source.file, options, source.blender)
    atomic_files.write(found.content, output)
    facts = {
        "file": str(output),
        "frames": len(found.clip),
        "fps": found.clip.rate,
        "joints": len(found.clip.skeleton),
        "notes": list(found.notes),
    }
    if json:
        typer.echo(as_json(facts))
        return
    for note in found.notes:
        typer.echo(f"note: {note}")
    typer.echo(
        f"{output}: {len(found.clip)} frames at {found.clip.rate:g} a second, "
        f"{len(found.clip.skeleton)} joints, in centimetres with y up"
    )
