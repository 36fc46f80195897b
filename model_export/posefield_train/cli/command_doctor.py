"""Command `posefield doctor`: what is wrong with reference motions of robots, and other formats."""

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from posefield.common import atomic_files
from posefield.common.errors import FileError, InvalidField, MotionFileError, did_you_mean
from posefield.console.options import Json
from posefield.console.output import as_json
from posefield.robots.file_conventions import QuaternionOrder
from posefield.robots.robot import Order
from posefield_train.cli import output_files

if TYPE_CHECKING:
    from posefield.robots.robot import Robot
    from posefield.robots.robot_formats import RobotFormat
    from posefield.robots.robot_motion import RobotMotion
    from posefield_train.robots.doctor import Diagnosis

EXAMPLES = [
    "doctor dance.csv --robot g1.xml --rate 30",
    "doctor gaits/*.json --robot bdx.xml --picture gaits.png",
    "doctor walk.csv --robot g1.xml --rate 50 --to mjlab.npz -o converted",
]


def doctor(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="CSV, NPZ, PKL, JSON or TXT files of one robot, one or more",
            metavar="FILE",
            show_default=False,
        ),
    ],
    robot: Annotated[
        Path | None,
        typer.Option(help="the robot, an MJCF or URDF file: limits, feet and orders are checked"),
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(
            help="frames a second of files that state none; it overrules the others",
            metavar="FPS",
            min=0.1,
        ),
    ] = None,
    quaternions: Annotated[
        QuaternionOrder | None,
        typer.Option(help="order of the base's quaternions, where the numbers do not tell"),
    ] = None,
    order: Annotated[
        Order | None,
        typer.Option(help="order of joints without names, where the bodies do not tell"),
    ] = None,
    degrees: Annotated[bool, typer.Option(help="the files give angles in degrees")] = False,
    to: Annotated[
        str | None,
        typer.Option("--to", help="format to convert to, such as mjlab.npz", metavar="FORMAT"),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="folder for converted files")
    ] = None,
    table: Annotated[
        Path | None,
        typer.Option(
            help="CSV file for a recipe: each file that repeats, with the frames of a cycle",
            metavar="FILE",
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="file for a picture, .png or .svg", metavar="FILE")
    ] = None,
    json: Json = False,
) -> None:
    """Say what is wrong with reference motions of a robot, and convert them.

    Format, rate, order of joints and quaternions are told with how they were known. Faults are told
    with joint or foot, frame and size: limits, sunk, floating and sliding feet, jumps, the seam of
    a loop, and motions that are unlike the others. Of motions that repeat a cycle is told, all in
    one phase. Files that cannot be read are named with the reason; none is then converted, no table
    is written, and the exit status is 1.
    """
    from posefield.robots import robot_formats
    from posefield.robots.file_conventions import Conventions
    from posefield_train.robots import doctor as motion_doctor
    from posefield_train.robots import doctor_report, robot_file
    from posefield_train.source import motion_readers

    target = _target(to, output, robot)
    if picture and picture.suffix not in (".png", ".svg"):
        raise InvalidField("--picture", f"found {picture.name!r}, expected a .png or .svg file")
    if table and (table.exists() or not robot):
        raise InvalidField("--table", f"{table} exists already" if robot else "needs --robot")
    body = robot_file.read(robot) if robot else None
    conventions = Conventions(body, rate, quaternions, order, degrees)
    motions: list[RobotMotion] = []
    refused = []
    for file in files:
        try:
            if file.is_dir():
                raise MotionFileError(str(file), f"is a folder, expected files: {file}/*")
            motion = robot_formats.read(file, conventions)
            motion_doctor.expect_same_robot(motion, motions[0] if motions else motion)
            motions.append(motion)
        except MotionFileError as fault:
            refused.append((str(file), motion_readers.reason(fault, file)))
    diagnoses = _diagnose(motions, body)
    if target and output and body and not refused:
        _convert(diagnoses, target, body, output)
    if table and not refused:
        _write_table(diagnoses, table)
    if picture and diagnoses:
        content = doctor_report.picture(diagnoses, body, picture.suffix[1:])
        atomic_files.write(content, picture)
    if json:
        typer.echo(
            as_json(
                {
                    "motions": [diagnosis.facts() for diagnosis in diagnoses],
                    "refused": [{"file": name, "reason": reason} for name, reason in refused],
                }
            )
        )
    elif diagnoses:
        typer.echo(doctor_report.text(diagnoses))
    output_files.tell_files("refused", refused)
    if refused:
        raise typer.Exit(1)


def _target(to: str | None, output: Path | None, robot: Path | None) -> "RobotFormat | None":
    from posefield.robots.robot_formats import WRITTEN

    if to is None:
        return None
    if to not in WRITTEN:
        hint = did_you_mean(to, WRITTEN)
        raise InvalidField("--to", f"found {to!r}{hint}, expected one of {', '.join(WRITTEN)}")
    if output is None or robot is None:
        missing = "--output" if output is None else "--robot"
        raise InvalidField("--to", f"needs {missing}")
    return WRITTEN[to]


def _diagnose(motions: "list[RobotMotion]", body: "Robot | None") -> "list[Diagnosis]":
    from posefield_train.robots import cycle_search, doctor

    unlike, diagnoses = doctor.outliers(motions, body), []
    for index, cycle in enumerate(cycle_search.find(motions, body)):
        diagnosis = doctor.diagnose(motions[index], body)
        findings = (*diagnosis.findings, *([unlike[index]] if index in unlike else []))
        diagnoses.append(replace(diagnosis, findings=findings, cycle=cycle))
    return diagnoses


def _write_table(diagnoses: "list[Diagnosis]", path: Path) -> None:
    from posefield_train.source import clip_table

    rows: list[tuple[object, ...]] = [("file", "first_frame", "last_frame")]
    for diagnosis in diagnoses:
        file = Path(os.path.relpath(diagnosis.motion.source, path.parent)).as_posix()
        if diagnosis.cycle:
            rows.append((file, diagnosis.cycle.first, diagnosis.cycle.last))
        else:
            typer.echo(f"left out of {path.name}: {file}: does not repeat", err=True)
    atomic_files.write(clip_table.csv_text(rows).encode(), path)


def _convert(
    diagnoses: "list[Diagnosis]", target: "RobotFormat", body: "Robot", folder: Path
) -> None:
    """Write the motions in another format, all or none of names that are free."""
    assert target.write is not None
    stems = [Path(diagnosis.motion.source).stem for diagnosis in diagnoses]
    paths = [folder / (stem + target.suffix) for stem in stems]
    for path in paths:
        if path.exists() or paths.count(path) > 1:
            fault = "exists already" if path.exists() else "would be written twice"
            raise FileError(path, f"{fault}, and is not overwritten")
    folder.mkdir(parents=True, exist_ok=True)
    for path, diagnosis in zip(paths, diagnoses, strict=True):
        atomic_files.write(target.write(diagnosis.motion, body), path)
