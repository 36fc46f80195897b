"""Cut clips of HDM05, by name: ASF and AMC files as in HDM05_cut_amc.zip to BVH."""

from pathlib import Path, PurePosixPath

from posefield.common.errors import FileError
from posefield.motion import bvh_writer
from posefield_train.source import acclaim
from recipe_data import data_sets
from recipe_data.data_sets import HDM05, Fetched, FetchedFile

RATE = 120.0
"""Frames a second; the names of the cut clips end in it, the files do not state it."""

METRES_PER_UNIT = 0.056444
"""As in the recipes. Numbers are written in the unit of the files, 1/0.45 inches."""


def convert(source: Path) -> Fetched:
    """Return the clips of the shipped table that lie anywhere below a folder, as BVH.

    A clip whose files have other hashes than those of which the table was measured is converted
    with a remark, unless its motion is the same. Raises FileError for two different files of one
    name, and for a clip with another number of frames than the table's.
    """
    present, hashes = data_sets.motion_files(source), HDM05.hashes()
    files, missing = [], {}
    for row in HDM05.rows(HDM05.table):
        name = PurePosixPath(row["file"]).stem
        names = (f"HDM_{row['performer']}.asf", f"{name}.amc")
        absent = [one for one in names if one.lower() not in present]
        if absent:
            missing[row["file"]] = f"{' and '.join(absent)}, not found below {source}"
            continue
        skeleton, motion = (data_sets.only(present[one.lower()]) for one in names)
        files.append(_converted(row, (skeleton, motion), hashes))
    return Fetched(tuple(files), missing)


def _converted(
    row: dict[str, str], sources: tuple[Path, Path], hashes: dict[str, str]
) -> FetchedFile:
    """Return a clip as BVH; sources: its skeleton and its motion."""
    skeleton = acclaim.read_asf(sources[0])
    motion = acclaim.read_amc(sources[1], skeleton)
    if len(motion.root) != int(row["frames"]):
        expected = f"expected {row['frames']} as in the table of clips"
        raise FileError(sources[1], f"found {len(motion.root)} frames, {expected}")
    clip = acclaim.to_clip(skeleton, motion, metres_per_unit=METRES_PER_UNIT, rate=RATE)
    content = bvh_writer.dumps(clip, metres_per_unit=METRES_PER_UNIT)
    return FetchedFile(row["file"], sources, content, _remark(row, sources, content, hashes))


def _remark(
    row: dict[str, str], sources: tuple[Path, Path], content: bytes, hashes: dict[str, str]
) -> str:
    """Return why the motion may be another than the table's; empty if a hash shows the same."""
    if data_sets.sha256(content) == hashes[row["file"]]:
        return ""
    other = [
        path.name
        for path in sources
        if data_sets.sha256(path.read_bytes()) != hashes.get(path.name, "")
    ]
    if not other:
        return ""
    return f"{' and '.join(other)}: not the content of which the table was measured"
