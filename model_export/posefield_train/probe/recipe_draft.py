"""Draft of a recipe and its table, with what is proposed and places for what is not known."""

import json
import re
import textwrap
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from posefield.common.errors import RecipeError
from posefield_train.probe.probe_report import ProbeReport
from posefield_train.source import clip_table
from posefield_train.source.clip_table import ClipTable
from posefield_train.source.facing import LARGEST_ANGLE

TABLE, RECIPE = "clips.csv", "recipe.toml"
FRAME_NAME = re.compile(r"frame(?!s\b)|_frame$|^frame_")
"""Names of columns that tell a frame rather than a number of frames."""
FILE_COLUMNS = ("file", "path", "bvh", "filename")
PERFORMER_COLUMNS = ("performer", "subject", "actor", "who")
RECORDING_COLUMNS = ("recording", "recording", "session")


def table_text(report: ProbeReport, folder: Path) -> str:
    """Return a table with one row for each whole file."""
    rows: list[Sequence[object]] = [("file", "first_frame", "last_frame")]
    for file in report.files:
        rows.append((Path(file.file).relative_to(folder).as_posix(), 0, file.frames - 1))
    return clip_table.csv_text(rows)


def recipe_text(
    report: ProbeReport, name: str, table: ClipTable | None, proposed: Sequence[str] = ()
) -> str:
    """Return a recipe to be completed.

    name: of the folder. table: a table that exists already; None for that of `table_text`.
    proposed: lines of the event and the controls; none for places where to write them.
    """
    environment = Environment(
        loader=PackageLoader("posefield_train.probe"),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=StrictUndefined,
    )
    comment = partial(textwrap.fill, width=96, initial_indent="# ", subsequent_indent="# ")
    environment.filters |= {"quote": quote, "names": names, "comment": comment}
    roles = report.roles
    joint = roles.get("rightHand", report.joints[-1])
    return environment.get_template("recipe.toml").render(
        name=name,
        recipe_name=recipe_name,
        control_name=control_name,
        source="\n".join(source_lines(report)[:-1]),
        columns=table and _columns(table),
        proposed="\n".join(proposed),
        hand=roles.get("rightHand") or roles.get("leftFoot") or joint,
        joint=joint,
        motion="\n".join([*motion_lines(report), *role_lines(report)]),
    )


def _columns(table: ClipTable) -> dict[str, Any]:
    """Return the name of a table, and its columns by what they seem to hold."""
    marks = frame_columns(table)
    return {
        "table": Path(table.name).name,
        "file": _first_of(table, FILE_COLUMNS),
        "performer": _first_of(table, PERFORMER_COLUMNS),
        "recording": _first_of(table, RECORDING_COLUMNS),
        "marks": marks,
        "numbers": [name for name in number_columns(table) if name not in marks],
    }


def recipe_name(name: str) -> str:
    """Return a folder's name as the name of a recipe and its model."""
    plain = re.sub(r"[^a-z0-9_-]+", "_", name.lower()).strip("_-")[:64]
    return plain or "motion"


def read_table(path: Path) -> ClipTable:
    """Return a table that exists; RecipeError if it names no motion files."""
    table = clip_table.open_table(path)
    if not table.records:
        raise RecipeError(path, "no rows below the heading")
    if not _first_of(table, FILE_COLUMNS):
        columns = ", ".join(FILE_COLUMNS)
        raise RecipeError(path, f"no column of the motion files, expected one of {columns}", 1)
    return table


def files_of(table: ClipTable, folder: Path) -> list[Path]:
    """Return the motion files of a table's rows, each once, in the table's order."""
    column = _first_of(table, FILE_COLUMNS)
    return [folder / name for name in dict.fromkeys(record[column] for _, record in table.records)]


def _first_of(table: ClipTable, names: Sequence[str]) -> str:
    there = table.records[0][1]
    return next((name for name in names if name in there), "")


def quote(text: str) -> str:
    """Return a text as a TOML string."""
    return json.dumps(text, ensure_ascii=False)


def names(words: Sequence[str]) -> str:
    """Return texts as a TOML array."""
    return f"[{', '.join(map(quote, words))}]"


def source_lines(report: ProbeReport) -> list[str]:
    """Return the section [source], with the evidence of unit and up axis as comments.

    A rate is written where it is stated, as `proposed["rate"]`, and not by the files.
    """
    unit, up = report.proposed["metres_per_unit"], report.proposed["up"]
    lines = ["[source]"]
    for key, proposal in (("metres_per_unit", unit), ("up", up)):
        lines += [f"# {sentence}" for sentence in proposal.evidence]
        lines.append(f"# confidence: {proposal.confidence}")
        is_known = proposal.value is not None
        lines.append(f"{key} = {json.dumps(proposal.value)}" if is_known else f"# TODO {key} = ")
    rate, stated = report.proposed["fps"], report.proposed.get("rate")
    if stated is not None:
        lines.append(f"rate = {json.dumps(stated.value)}")
    elif rate.confidence in ("low", "none"):
        lines += [f"# {sentence}" for sentence in rate.evidence]
        lines.append("# TODO rate = " if rate.value is None else f"rate = {rate.value:g}")
    return [*lines, ""]


def frame_columns(table: ClipTable) -> list[str]:
    """Return the columns of whole numbers whose names speak of a frame."""
    return [
        name
        for name in number_columns(table)
        if FRAME_NAME.search(name)
        and all(float(record[name]).is_integer() for _, record in table.records)
    ]


def number_columns(table: ClipTable) -> list[str]:
    """Return the columns whose cells are numbers, and not all the same."""
    columns = []
    for name in table.records[0][1]:
        cells = [record[name] for _, record in table.records]
        if all(re.fullmatch(r"[+-]?[0-9.]+([eE][+-]?[0-9]+)?", cell) for cell in cells):
            columns += [name] if len(set(cells)) > 1 else []
    return columns


def control_name(text: str) -> str:
    """Return a text as a name of a control, of at most 30 letters."""
    plain = re.sub(r"[^a-z0-9_]+", "_", text.lower()).strip("_")[:30]
    return plain if re.match("[a-z]", plain) else f"at_{plain}"


def motion_lines(report: ProbeReport, cyclic: bool = False) -> list[str]:
    """Return the section [motion], with the evidence of feet and facing as comments."""
    feet, facing = report.proposed["feet"], report.proposed["facing"]
    return [
        "[motion]",
        "frames = 60",
        "# true if the last pose leads into the first, as in one whole stride:",
        f"cyclic = {json.dumps(cyclic)}",
        'root = "travelling"  # or "in_place"',
        *[f"# {sentence} (confidence: {feet.confidence})" for sentence in feet.evidence],
        f"feet = {names(feet.value)}",
        *[
            f"# facing: {sentence} (confidence: {facing.confidence})"
            for sentence in facing.evidence
        ],
        *(['facing = "hips"'] if abs(facing.value or 0.0) > LARGEST_ANGLE else []),
        "",
    ]


def role_lines(report: ProbeReport) -> list[str]:
    """Return the section [roles]; joints that have to be confirmed are comments."""
    if not report.guesses:
        return ["# No joints were recognised by their names: [roles] tells other tools who is who."]
    lines = [f"{role} = {quote(joint)}" for role, joint in report.roles.items()]
    for role, guess in report.asked.items():
        lines += [
            f"# TODO confirm (confidence {guess.confidence:.2f}: {'; '.join(guess.reasons)})",
            f"# {role} = {quote(guess.joint)}",
        ]
    return ["# By the joints' names; check them, or delete the table.", "[roles]", *lines, ""]
