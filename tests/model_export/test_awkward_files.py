"""Awkward files as users have them: each is read with a note, or refused in plain words."""

import gzip
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from exported_clips import encoded
from minimal import TOML, small_clip, write_clips

from posefield.motion import quat
from posefield.motion.clip import assemble
from posefield.motion.skeleton import Skeleton
from posefield_train.source.clip_joints import keep_joints

PHASES = (0.0, 0.5, 1.0, 1.5)


def bvh(change: Callable[[str], str] = lambda text: text) -> Callable[[Path], None]:
    """Writer of a.bvh, small and in metres, with its text changed."""

    def write(folder: Path) -> None:
        (folder / "a.bvh").write_text(change(encoded(small_clip(), "bvh").decode()))

    return write


def with_relative_positions(text: str) -> str:
    """The file with position channels of zeros at all joints below the root."""
    head, motion = text.split("MOTION")
    head = head.replace("CHANNELS 3", "CHANNELS 6 Xposition Yposition Zposition")
    lines = motion.strip().splitlines()
    parts = [[line.split()[at : at + 3] for at in range(0, 18, 3)] for line in lines[2:]]
    rows = [" 0 0 0 ".join(map(" ".join, [[*own[0], *own[1]], *own[2:]])) for own in parts]
    return "\n".join([f"{head}MOTION", *lines[:2], *rows]) + "\n"


def frame_time(written: str) -> Callable[[str], str]:
    return lambda text: re.sub("Frame Time: .*", f"Frame Time: {written}", text)


def family(
    change: Callable[[str], str] = lambda text: text, *, files: str = "1", recipe: str = TOML
) -> Callable[[Path], None]:
    """Writer of a family of four clips, the text of some files changed, and its recipe."""

    def write(folder: Path) -> None:
        write_clips(folder, [small_clip(phase) for phase in PHASES])
        for name in files:
            path = folder / f"{name}.bvh"
            path.write_text(change(path.read_text()))
        (folder / "recipe.toml").write_text(recipe)

    return write


def mixed(folder: Path) -> None:
    family()(folder)
    (folder / "3.glb").write_bytes(encoded(small_clip(1.5), "glb"))
    table = folder / "clips.csv"
    table.write_text(table.read_text().replace("3.bvh", "3.glb"))


def without_end_sites(text: str) -> str:
    head, motion = text.split("MOTION")
    parts = head.split("End Site")
    kept = [parts[0], *(part.split("}", 1)[1] for part in parts[1:])]
    return "MOTION".join(["".join(kept), motion])


def quadruped(folder: Path) -> None:
    legs = [f"{side}{end}" for side in ("Left", "Right") for end in ("Front", "Hind")]
    names = ["Root", "Pelvis", *(f"{leg}{part}" for leg in legs for part in ("UpperLeg", "Foot"))]
    parents = [-1, 0, *(parent for at in range(4) for parent in (1, 2 + 2 * at))]
    offsets = np.tile([[0.1, -0.3, 0.2]], (len(names), 1))
    own = Skeleton(tuple(names), tuple(parents), offsets, (), np.zeros((0, 3)))
    rotations = np.tile(quat.IDENTITY, (9, len(names), 1))
    clip = assemble(own, rotations, np.zeros((9, 3)), offsets, 30.0)
    (folder / "a.bvh").write_bytes(encoded(clip, "bvh"))


def with_legs(text: str) -> str:
    """The file with two legs of 0.8 units, without channels."""
    legs = "".join(
        f"JOINT {side}UpLeg {{ OFFSET {x} 0 0 JOINT {side}Leg {{ OFFSET 0 -0.4 0 "
        f"JOINT {side}Foot {{ OFFSET 0 -0.4 0 }} }} }}\n"
        for side, x in (("Left", 0.1), ("Right", -0.1))
    )
    return re.sub(r"}\s*MOTION", f"{legs}}}\nMOTION", text)


def table(text: str) -> Callable[[Path], None]:
    """Writer of a family with another table."""

    def write(folder: Path) -> None:
        family()(folder)
        (folder / "clips.csv").write_text(text)

    return write


def rows(mark: str, heading: str) -> str:
    """A table of the family with decimal commas."""
    return "\n".join([heading, *(f"{at}.bvh{mark}{at},5" for at in range(4))]) + "\n"


def source(line: str) -> str:
    """The recipe with a line more in [source]."""
    return TOML.replace('up = "y"\n', f'up = "y"\n{line}\n')


def siblings_exchanged(folder: Path) -> None:
    """Two children of the spine, Head and LeftArm, in another order in one file."""
    family()(folder)
    path = folder / "1.bvh"
    clip = small_clip(0.5)
    order = [0, 1, 3, 4, 2]
    path.write_bytes(encoded(keep_joints(clip, order), "bvh"))


CONVERT = "convert a.bvh --unit 1 --up y -o o.bvh"
TRAIN = "train recipe.toml -o m.onnx"
PROBE = "probe a.bvh"


@dataclass(frozen=True)
class Case:
    """A command in a folder of files. said: parts of its output, in any order."""

    name: str
    write: Callable[[Path], None]
    command: str
    said: tuple[str, ...] = ()
    code: int = 0


CASES = [
    Case(
        "one file without end sites",
        family(without_end_sites),
        TRAIN,
        ("end sites Head_end, LeftHand_end: left out, since not all 4 clips have them",),
    ),
    Case("BVH and GLB", mixed, TRAIN, ("end sites Head_end, LeftHand_end: left out",)),
    Case("siblings in another order", siblings_exchanged, TRAIN),
    *(
        Case(
            f"21 frames where {stated} are stated",
            bvh(lambda text, stated=stated: text.replace("Frames: 21", f"Frames: {stated}")),
            CONVERT,
            (f"note: states {stated} frames and has 21: those were read",),
        )
        for stated in (20, 22)
    ),
    Case(
        "frame time in milliseconds",
        bvh(frame_time("33.333")),
        PROBE,
        ("30 frames a second (confidence: low)", "33.333 looks like milliseconds"),
    ),
    Case("frame time that is the rate", bvh(frame_time("60")), PROBE, ("60 looks like the rate",)),
    Case(
        "frame time of which nothing is known",
        bvh(frame_time("1.0")),
        PROBE,
        ("unknown (confidence: none)", "a frame every 1 s is implausible"),
    ),
    Case(
        "frame time in milliseconds, trained",
        family(frame_time("33.333"), files="0123"),
        TRAIN,
        ("0.bvh: frame time 33.333 s, 0.03 frames a second", "say source.rate"),
        code=3,
    ),
    Case(
        "positions relative to OFFSETs",
        bvh(with_relative_positions),
        CONVERT,
        ("note: positions of 4 joints are relative to their OFFSETs: added",),
    ),
    *(
        Case(
            f"frame time {written}",
            bvh(frame_time(written)),
            CONVERT,
            (f"21 frames at {rate} a second", f"is taken as {rate} frames a second rather than"),
        )
        for written, rate in (("0.033", 30), ("0.0333", 30), ("0.017", 60), ("0.0417", 24))
    ),
    Case(
        "rate overruled by the recipe",
        family(recipe=source("rate = 120")),
        TRAIN,
        ("4 of 4 files: states 30 frames a second", "overruled: read at 120"),
    ),
    Case(
        "rate overruled by the option",
        bvh(),
        "convert a.bvh --rate 24 --unit 1 --up y -o o.bvh",
        ("21 frames at 24 a second", "states 30 frames a second"),
    ),
    Case(
        "unit overruled by the option",
        lambda folder: (folder / "a.glb").write_bytes(encoded(small_clip(), "glb")),
        "convert a.glb --unit 0.01 -o o.bvh",
        ("states a unit of 1 m, overruled: read as 0.01 m",),
    ),
    *(
        Case(name, table(text), TRAIN, ("clips.csv: 4 decimal commas were read as points",))
        for name, text in (
            ("semicolons", rows(";", "file;v")),
            ("a named separator", rows(";", "sep=;\nfile;v")),
            ("tabs", rows("\t", "file\tv")),
        )
    ),
    Case(
        "decimal commas between commas",
        table("file,v\n0.bvh,0,5\n"),
        TRAIN,
        ("clips.csv:2: found 3 cells, expected the 2 of the heading",),
        code=3,
    ),
    Case(
        "a wrong unit",
        family(recipe=TOML.replace("metres_per_unit = 1.0", "metres_per_unit = 100.0")),
        TRAIN,
        ("condition it better; the bones are 143 m long together: is source.metres_per_unit",),
        code=4,
    ),
    Case(
        "legs of two metres",
        family(with_legs, files="0123", recipe=TOML.replace("= 1.0", "= 2.5", 1)),
        TRAIN,
        ("note: the legs are 2 m long, of an adult about 0.86 m: is source.metres_per_unit",),
    ),
    Case(
        "a rate that is no whole number",
        lambda folder: (folder / "a.glb").write_bytes(
            encoded(replace(small_clip(), rate=37.5), "glb")
        ),
        "probe a.glb",
        ("fps             37.5 frames a second (confidence: certain)",),
    ),
    Case("a quadruped", quadruped, "init .", ("wrote clips.csv and recipe.toml",)),
    Case(
        "styles of no use",
        table(rows(",", "file,style,v")),
        TRAIN,
        ("clips.csv:1: column 'style' has 4 values and no use", "clips.labels"),
        code=3,
    ),
    Case(
        "gzip",
        lambda folder: (folder / "a.bvh").write_bytes(gzip.compress(b"HIERARCHY")),
        CONVERT,
        ("found a file packed by gzip, expected HIERARCHY",),
        code=3,
    ),
    Case(
        "UTF-16",
        lambda folder: (folder / "a.bvh").write_text("HIERARCHY", "utf-16"),
        CONVERT,
        ("found text in UTF-16, expected HIERARCHY",),
        code=3,
    ),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_command_reads_the_file_or_says_why_not(posefield, tmp_path, monkeypatch, case):
    case.write(tmp_path)
    monkeypatch.chdir(tmp_path)
    code, out, err = posefield(*case.command.split())
    said = out + err
    assert code == case.code, said
    assert [part for part in case.said if part not in said] == [], said
    if not code and "-o" in case.command:
        assert (tmp_path / case.command.split()[-1]).stat().st_size
