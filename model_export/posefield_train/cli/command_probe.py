"""Commands `posefield probe` and `posefield init`: proposals for a recipe from motion files."""

import statistics
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from posefield.common import atomic_files
from posefield.common.errors import FileError, InvalidField, MotionError
from posefield.console.options import Json
from posefield.console.output import as_json
from posefield_train.cli import output_files

if TYPE_CHECKING:
    from posefield_train.probe.probe_report import ProbeReport

PROBE_EXAMPLES = ["probe motion/*.bvh", "probe kick.bvh --json"]
INIT_EXAMPLES = ["init motion", "init motion --table clips.csv"]


def probe(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="BVH, AMC, GLB, glTF or USD files, one or more", metavar="FILE", show_default=False
        ),
    ],
    json: Json = False,
) -> None:
    """Propose unit, up axis, rate, feet and heading of motion files.

    Each proposal has its evidence and its confidence. The files are read as of one family. Those
    that cannot be read are named with the reason, and the others are reported.
    """
    from posefield_train.probe import probe_report

    report = _probe(files)
    typer.echo(as_json(report.facts()) if json else probe_report.text(report))


def init(
    folder: Annotated[Path, typer.Argument(help="folder with motion files", metavar="FOLDER")],
    table: Annotated[
        str | None,
        typer.Option(
            help="name of a table that the folder has already, in place of a new clips.csv",
            metavar="FILE",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Write a recipe and a table for a folder of motion files.

    Complete recipe.toml where it says TODO, then train it. Controls and an event are proposed for
    clips of a known body that have no table. No file is overwritten.
    """
    from posefield.robots.robot_formats import SUFFIXES
    from posefield_train.probe import recipe_draft
    from posefield_train.source import motion_readers

    if not folder.is_dir():
        raise FileError(folder, "not a folder, expected one with motion files")
    recipe = folder / recipe_draft.RECIPE
    _refuse_existing(recipe)
    table_draft = None if table is None else recipe_draft.read_table(folder / table)
    if table_draft is None:
        _refuse_existing(folder / recipe_draft.TABLE)
        files = [*motion_readers.find_files(folder), *motion_readers.find_refused(folder)]
    else:
        files = recipe_draft.files_of(table_draft, folder)
    if not files:
        robots = sorted(path.name for suffix in SUFFIXES for path in folder.rglob(f"*{suffix}"))
        hint = f"; if {robots[0]} is of a robot, see posefield doctor --table" if robots else ""
        raise InvalidField("FOLDER", f"{folder} has no motion files, expected one or more{hint}")
    report = _probe(files)
    paths = [recipe]
    if table_draft is None:
        paths.insert(0, folder / recipe_draft.TABLE)
        atomic_files.write(recipe_draft.table_text(report, folder).encode(), paths[0])
    proposed = _proposed(report, folder) if table_draft is None else []
    draft = recipe_draft.recipe_text(report, folder.resolve().name, table_draft, proposed)
    atomic_files.write(draft.encode(), recipe)
    _tell(report, paths, "the licence" if proposed else "the licence and the controls", json)


LONG = 12.0
"""Median seconds of files from which on they are rather recordings than clips."""


def _proposed(report: "ProbeReport", folder: Path) -> list[str]:
    """Return the lines of the proposed event and controls; none where nothing can be proposed."""
    from posefield_train.families import recipe_folder
    from posefield_train.families.found_families import FamilyRow

    seconds = statistics.median(file.seconds or 0.0 for file in report.files)
    if seconds > LONG:
        typer.echo(
            f"the files are {seconds:.0f} s long in the median: posefield discover {folder} finds "
            "clips in long recordings, and strides with --strides",
            err=True,
        )
    # Any family can be read by its hips, before there is another control.
    if "hips" not in report.roles:
        return []
    names = [Path(file.file).relative_to(folder).as_posix() for file in report.files]
    rows = [
        FamilyRow(name, 0, file.frames - 1, "", name)
        for name, file in zip(names, report.files, strict=True)
    ]
    facts = recipe_folder.RecipeFacts("draft", "Draft", "not stated yet", report, labelled=False)
    text = recipe_folder.recipe_text(facts, recipe_folder.PLACEHOLDER)
    try:
        proposal = recipe_folder.propose(text, "draft", rows, folder, report.roles)
    except (MotionError, ValueError):
        # Clips that are no family, or that no control predicts: the draft has places for controls.
        return []
    return recipe_folder.proposal_lines(proposal, report.roles)


def _probe(files: list[Path]) -> "ProbeReport":
    from posefield.console.progress import ProgressBar
    from posefield_train.probe import probe_report

    with ProgressBar("files", len(files)) as bar:
        report = probe_report.probe(files, bar.update)
    output_files.tell_files("left out", list(report.refused.items()))
    return report


def _refuse_existing(path: Path) -> None:
    if path.exists():
        hint = ": name it with --table" if path.suffix == ".csv" else ""
        raise FileError(path, f"exists already, and is not overwritten{hint}")


def _tell(report: "ProbeReport", files: list[Path], todo: str, json: bool) -> None:
    from posefield_train.probe import probe_report

    if json:
        typer.echo(as_json({"written": [str(path) for path in files], **report.facts()}))
        return
    typer.echo("\n".join(probe_report.summary(report)))
    typer.echo(
        f"wrote {' and '.join(map(str, files))}: complete {todo} (TODO), "
        f"then: posefield train {files[-1]} -o model.onnx"
    )
