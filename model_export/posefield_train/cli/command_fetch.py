"""Command `posefield fetch`: motion data as their owners publish it, for the shipped recipes."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from posefield.common.errors import FileError
from posefield.console.arguments import Json
from posefield.console.output import as_json


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
