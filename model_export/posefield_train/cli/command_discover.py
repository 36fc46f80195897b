"""Commands `posefield discover`, clips in long recordings, and `review`, decisions on them."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from posefield.common import atomic_files
from posefield.common.errors import InvalidField
from posefield.common.units import UpAxis
from posefield.console.options import Json, with_option_groups
from posefield.console.output import as_json
from posefield_train.cli import output_files

if TYPE_CHECKING:
    from posefield_train.discover.found_clips import FoundClip
    from posefield_train.discover.recordings import ReadRecordings
    from posefield_train.families.recipe_folder import FoundFamilies
    from posefield_train.source.motion_readers import MotionFiles


KEPT_POSES = 8_000_000
"""Frames times joints of motion files that are kept for the families, 450 MB: an hour of 31 joints
at 60 frames a second is 6.7 million. More files are read a second time."""

EXAMPLES = [
    "discover recordings -o recipes --licence 'CC BY 4.0, by us'",
    "discover recordings --strides -o recordings/strides.csv",
    "discover recordings --like day1/bd_0.bvh:12.1-14.6 --name grab -o recordings/grab.csv",
]


@dataclass(frozen=True)
class SearchOptions:
    """Motions to find: strides, or those like an example."""

    strides: Annotated[bool, typer.Option("--strides", help="find strides of walks and runs")] = (
        False
    )
    like: Annotated[
        str | None,
        typer.Option(
            help="find motions like this part of a recording, its file below the folder and "
            "seconds; or like the accepted rows of a former table, TABLE.csv",
            metavar="FILE:START-END",
        ),
    ] = None
    name: Annotated[str, typer.Option(help="name of the motions that are like the example")] = (
        "found"
    )
    most: Annotated[
        int, typer.Option(help="largest number of motions like the example", min=1, max=10_000)
    ] = 50


@dataclass(frozen=True)
class StatementOptions:
    """Statements about the files, where their bodies do not tell them."""

    up: Annotated[
        UpAxis | None, typer.Option(help="up axis of all files; default: by each file's body")
    ] = None
    roles: Annotated[
        Path | None,
        typer.Option(
            help="TOML file with a table of roles as in recipes: joints that the names do not tell",
            metavar="FILE",
        ),
    ] = None
    rate: Annotated[
        float | None,
        typer.Option(help="frames a second of files that state none, such as AMC", min=1.0),
    ] = None


@dataclass(frozen=True)
class FamilyOptions:
    """Recipes of families, which are written without --strides and --like."""

    unit: Annotated[
        float | None,
        typer.Option(
            help="metres per unit of all files; default: by the length of the legs", min=1e-6
        ),
    ] = None
    licence: Annotated[
        str, typer.Option(help="licence of the motions with its attribution, for the recipes")
    ] = ""
    candidates: Annotated[
        int,
        typer.Option(help="number of parts of recordings that are searched", min=1, max=100_000),
    ] = 1_000
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="replace the recipes of an earlier search")
    ] = False


@with_option_groups
def discover(
    folder: Annotated[
        Path, typer.Argument(help="folder with motion files, in any subfolders", metavar="FOLDER")
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            help="folder of recipes to write; with --strides or --like a table, CSV, best in the "
            "folder of the recordings",
        ),
    ],
    search: SearchOptions,
    stated: StatementOptions,
    families: FamilyOptions,
    json: Json = False,
) -> None:
    """Find families or clips in long recordings, for recipes.

    Without --strides and --like, each family gets a recipe, which posefield train refuses until
    posefield review or an editor accepts it. In a table, each row has `accepted` false until a
    person changes it, and a recipe takes the accepted rows. Files that cannot be searched are named
    with the reason.
    """
    if search.strides and search.like is not None:
        raise InvalidField("strides", "expected either --strides or --like FILE:START-END")
    if search.strides or search.like is not None:
        if families != FamilyOptions():
            raise InvalidField("strides", "expected no option of recipes for a table of clips")
        _write_table(folder, output, search, stated, json)
    else:
        _write_recipes(folder, output, stated, families, json)


def _write_recipes(
    folder: Path, output: Path, stated: StatementOptions, family_options: FamilyOptions, json: bool
) -> None:
    from posefield.console.progress import ProgressBar
    from posefield_train.discover.recordings import FileStatements
    from posefield_train.families import contact_sheet, found_families, recipe_folder
    from posefield_train.source.motion_readers import MotionFiles

    if output.suffix in (".csv", ".toml", ".json"):
        raise InvalidField("output", f"{output.name!r}, expected a folder of recipes")
    replaced = recipe_folder.expect_free(output, family_options.overwrite)
    files = MotionFiles(KEPT_POSES)
    read = _read(folder, stated, files)
    figures = {recording.file: read.figures[recording.file] for recording in read.recordings}
    statements = FileStatements(family_options.unit, stated.up, _roles(stated), stated.rate)
    with ProgressBar("bodies", len(figures)) as bar:
        kinds = found_families.find_kinds(folder, figures, statements, bar.update)
    with ProgressBar("candidates", family_options.candidates) as bar:
        listed = found_families.find_families(
            read.recordings, kinds, family_options.candidates, bar.update
        )
    families = recipe_folder.offer(listed, folder, family_options.licence, files)
    facts = recipe_folder.summary(families, folder, read, kinds, family_options.candidates)
    page = contact_sheet.render(families, read.recordings, output.as_posix(), read.refused)
    contents = recipe_folder.contents(families, facts) | {recipe_folder.PAGE: page}
    recipe_folder.write(contents, output, replaced)
    if json:
        typer.echo(as_json(facts))
    else:
        _tell_families(families, output, len(read.recordings))


def _tell_families(families: "FoundFamilies", output: Path, recordings: int) -> None:
    from posefield_train.families import recipe_folder

    for one in families.offered:
        controls = ", ".join(map(recipe_folder.control_name, one.proposal.controls))
        typer.echo(
            f"{output / one.name}.toml: {len(one.family.rows)} {one.family.kind}, "
            f"{one.family.seconds:.1f} s; controls {controls}"
        )
    typer.echo(
        f"{output}: {len(families.offered)} families of {recordings} recordings, "
        f"{len(families.refused)} not offered; look at {output / recipe_folder.PAGE}, then accept "
        f"with: posefield review {output} --accept NUMBER"
    )


def _write_table(
    folder: Path, output: Path, search: SearchOptions, stated: StatementOptions, json: bool
) -> None:
    from posefield_train.discover import found_clips

    if output.suffix != ".csv":
        raise InvalidField("output", f"{output.name!r}, expected a name that ends in .csv")
    read = _read(folder, stated)
    clips, facts = _search(read, search)
    atomic_files.write(found_clips.table(clips), output)
    if json:
        summary = {"table": str(output), "clips": len(clips), "recordings": len(read.recordings)}
        typer.echo(as_json({**summary, **facts, "refused": read.refused, "notes": read.notes}))
        return
    kind = "strides" if search.like is None else f"{search.name}, examples first"
    typer.echo(
        f"{output}: {len(clips)} clips ({kind}) of {len(read.recordings)} recordings; set "
        "accepted to true in the rows to train from"
    )


def _search(
    read: "ReadRecordings", search: SearchOptions
) -> "tuple[list[FoundClip], dict[str, int | list[str]]]":
    """Return the clips that are found, and what was left out, which standard error tells too."""
    from posefield_train.discover import found_clips, motion_features

    if search.like is None:
        clips, in_place = found_clips.strides(read.recordings)
        if in_place:
            typer.echo(f"left out: {in_place} swings of the legs that do not travel", err=True)
        return clips, {"in_place": in_place}
    examples = found_clips.parse_examples(read.recordings, search.like)
    clips = found_clips.like(read.recordings, examples, search.name, search.most)
    lacking = motion_features.lacking_roles(read.recordings)
    if lacking:
        note = f"not compared, because some recordings have none: {', '.join(lacking)}"
        typer.echo(note, err=True)
    return clips, {"not_compared": lacking}


def _read(
    folder: Path, stated: StatementOptions, files: "MotionFiles | None" = None
) -> "ReadRecordings":
    """Return the recordings of a folder; standard error names refused files and faults."""
    from posefield.console.progress import ProgressBar
    from posefield_train.discover import recordings
    from posefield_train.source import motion_readers

    with ProgressBar("files", len(motion_readers.find_files(folder))) as bar:
        statements = recordings.FileStatements(None, stated.up, _roles(stated), stated.rate)
        read = recordings.read_recordings(folder, statements, bar.update, files)
    output_files.tell_files("left out", list(read.refused.items()))
    output_files.tell_files(
        "note", [(file, note) for file, notes in read.notes.items() for note in notes]
    )
    return read


def _roles(stated: StatementOptions) -> dict[str, str]:
    from posefield_train.discover import found_clips

    return {} if stated.roles is None else found_clips.read_roles(stated.roles)


REVIEW_EXAMPLES = [
    "review recipes --accept 1,2 --reject 3 --merge 4,5 --drop 2:bd_1.bvh@33.2",
    "review recipes --decisions recipes/decisions.json",
]


@dataclass(frozen=True)
class DecisionOptions:
    """Decisions, by the numbers of families."""

    accept: Annotated[
        str | None, typer.Option(help="families to train from", metavar="NUMBERS")
    ] = None
    reject: Annotated[
        str | None, typer.Option(help="families that are none", metavar="NUMBERS")
    ] = None
    merge: Annotated[
        list[str] | None,
        typer.Option(help="two families, the second into the first; repeatable", metavar="A,B"),
    ] = None
    drop: Annotated[
        list[str] | None,
        typer.Option(
            help="clip of a family to leave out, by a time within it; repeatable",
            metavar="FAMILY:FILE@SECONDS",
        ),
    ] = None


@with_option_groups
def review(
    folder: Annotated[
        Path, typer.Argument(help="folder that posefield discover wrote", metavar="FOLDER")
    ],
    options: DecisionOptions,
    decisions: Annotated[
        Path | None,
        typer.Option(
            help="JSON file with the decisions, which the page index.html saves", metavar="FILE"
        ),
    ] = None,
    data: Annotated[
        Path | None, typer.Option(help="folder of the recordings; default: that of the search")
    ] = None,
    json: Json = False,
) -> None:
    """Accept, reject and merge found families, and drop clips.

    posefield train takes the recipes that are accepted. The same decisions again change nothing.
    """
    from posefield_train.families import review as family_decisions
    from posefield_train.families import review as family_review

    if (decisions is None) == (options == DecisionOptions()):
        raise InvalidField("decisions", "expected either --decisions FILE or other decisions")
    contents = (
        family_decisions.of_texts(
            options.accept, options.reject, options.merge or [], options.drop or []
        )
        if decisions is None
        else family_decisions.read(decisions)
    )
    facts = family_review.apply(folder, contents, data)
    if json:
        typer.echo(as_json(facts))
        return
    for one in facts["families"]:
        into = f" into {one['into']}" if one["status"] == "merged" else ""
        typer.echo(f"family {one['number']}: {one['status']}{into}, {one['clips']} clips")
