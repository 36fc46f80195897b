"""Commands `posefield convert`, a motion file to BVH, and `fetch`, motion data for recipes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from posefield.common import atomic_files
from posefield.common.errors import FileError, InvalidField
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
    from posefield_train.convert.converted_file import Conventions
    from posefield_train.source.motion_file import ReadOptions

    if output.suffix.lower() != ".bvh":
        raise InvalidField("output", f"{output.name!r}, expected a name that ends in .bvh")
    for name, value in (("unit", source.unit), ("rate", source.rate)):
        if value is not None and not 0.0 < value < float("inf"):
            raise InvalidField(name, f"{value}, expected a positive number")
    options = ReadOptions(source.rate, source.animation)
    said = Conventions(source.unit, source.up, options, source.blender)
    found = converted_file.convert(source.file, said)
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


def fetch(
    data: Annotated[Literal["cmu", "hdm05"], typer.Argument(help="data set", metavar="DATA_SET")],
    source: Annotated[
        Path,
        typer.Argument(
            help="folder with the downloaded files, unpacked, in any subfolders: ASF and AMC, for "
            "cmu also BVH",
            metavar="SOURCE_FOLDER",
        ),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="data folder, for --data of posefield train")
    ],
    json: Json = False,
) -> None:
    """Convert downloaded motion data to what a shipped recipe reads.

    It downloads nothing: the owners' pages are http://mocap.cs.cmu.edu (for the recipe cmu_walk:
    subjects 2, 5, 6, 7, 8, 10, 12, 16, 35, 38, 39, 43, 45, 46, 47, 49, 55; five of the walks are of
    unknown subjects) and https://resources.mpi-inf.mpg.de/HDM05 (for hdm05_grab_high and
    hdm05_deposit_floor: the cut clips). The data folder then has BVH files, the table with the
    rows whose files were found, and fetched.json with the SHA-256 of all files.
    """
    from posefield_train.fetch import cmu_trials, data_sets, hdm05_cuts

    own, converter = {
        "cmu": (data_sets.CMU, cmu_trials),
        "hdm05": (data_sets.HDM05, hdm05_cuts),
    }[data]
    found = converter.convert(source)
    for file, reason in found.missing.items():
        typer.echo(f"missing: {file}: {reason}", err=True)
    for one in found.files:
        if one.remark:
            typer.echo(f"warning: {one.file}: {one.remark}", err=True)
    if not found.files:
        raise FileError(source, f"found none of {len(found.missing)} clips; see {own.page}")
    facts = data_sets.write(own, found, output)
    if json:
        typer.echo(as_json(facts))
        return
    total = len(found.files) + len(found.missing)
    typer.echo(
        f"{output / own.folder}: {len(found.files)} of {total} motions, {facts['rows']} rows of "
        f"{own.table}; train with --data {output}"
    )
    typer.echo(own.terms)
