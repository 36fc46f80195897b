"""Draft of a recipe and its table, with what is proposed and places for what is not known."""

import json
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path

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
    controls = [*proposed, ""] if proposed else [*_controls(report, table), *_event(report, table)]
    return "\n".join(
        [
            *_head(name),
            *source_lines(report),
            *_clips(table),
            *controls,
            *motion_lines(report),
            *role_lines(report),
            "[size]",
            "rms_budget_cm = 1.0",
            "",
        ]
    )


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


def _head(name: str) -> list[str]:
    return [
        "# Draft by posefield init: complete what is marked TODO, then train it.",
        "schema = 1",
        f"name = {quote(recipe_name(name))}",
        f"description = {quote(f'Motions of {name}')}",
        "# TODO licence of the motions with its attribution; motion files state none.",
        'licence = ""',
        "",
    ]


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


def _clips(table: ClipTable | None) -> list[str]:
    if table is None:
        return [
            "[clips]",
            f"table = {quote(TABLE)}",
            'file = "file"',
            'first_frame = "first_frame"  # from 0',
            'last_frame = "last_frame"    # inclusive',
            "# A column with the performer's name, so that they can be told apart:",
            '# performer = "performer"',
            "# A column with the recording of each clip; clips of one are left out together:",
            '# recording = "recording"',
            "# Columns with the frame of an event, counted from 0 as in the file, in their order:",
            '# landmarks = ["contact_frame"]',
            "",
        ]
    performer = _first_of(table, PERFORMER_COLUMNS)
    lines = ["[clips]", f"table = {quote(Path(table.name).name)}"]
    lines.append(f"file = {quote(_first_of(table, FILE_COLUMNS))}")
    if performer:
        lines.append(f"performer = {quote(performer)}")
    if recording := _first_of(table, RECORDING_COLUMNS):
        lines.append(
            f"recording = {quote(recording)}  # clips of one recording are left out together"
        )
    marks = frame_columns(table)
    lines.append("# Columns that may hold the frame of an event; those that do become landmarks:")
    lines.append(f"# landmarks = {names(marks or ['contact_frame'])}")
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


def _controls(report: ProbeReport, table: ClipTable | None) -> list[str]:
    hand = report.roles.get("rightHand") or report.roles.get("leftFoot") or report.joints[-1]
    lines = [
        "# TODO at least one control: what a clip is an example of. Either measured of the motion:",
        "# [[controls]]",
        f"# name = {quote(control_name(hand) + '_height')}",
        f'# auto = {{ quantity = "height", joint = {quote(hand)}, at = "end" }}',
        f"# description = {quote(f'Height of {hand} at the end')}",
        "# or a column of the table, in its unit:",
    ]
    marks = [] if table is None else frame_columns(table)
    columns = [] if table is None else [n for n in number_columns(table) if n not in marks]
    if columns:
        text = f"Columns of numbers: {', '.join(columns)}."
        lines += textwrap.wrap(text, 96, initial_indent="# ", subsequent_indent="# ")
    lines += [
        "# [[controls]]",
        '# name = "speed"',
        '# column = "COLUMN"',
        '# unit = "m/s"',
        '# description = "Mean speed"',
        "",
    ]
    return lines


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


def _event(report: ProbeReport, table: ClipTable | None) -> list[str]:
    marks = [] if table is None else frame_columns(table)
    at = marks[0] if marks else "end"
    joint = report.roles.get("rightHand", report.joints[-1])
    return [
        '# The joint that the motion is for, and the moment: "start", "end", "highest", "lowest",',
        '# "farthest" from the root, or a column of clips.landmarks',
        "# [event]",
        f"# joint = {quote(joint)}",
        f"# at = {quote(at)}",
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
