"""Data sets of the shipped recipes: owners, tables and hashes; and the folder that is made."""

import csv
import hashlib
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import orjson

from posefield import __version__
from posefield.common import atomic_files
from posefield.common.errors import FileError
from posefield_train.source import clip_table, data_folder

MOTION_SUFFIXES = (".asf", ".amc", ".bvh")


@dataclass(frozen=True)
class DataSet:
    """A data set that a recipe reads.

    folder: its name in the data folder, and of the folder with its tables in the package. table:
    the table that the recipe names. page: where its owners publish it. terms: their licence.
    """

    name: str
    folder: str
    table: str
    page: str
    terms: str

    def rows(self, table: str) -> list[dict[str, str]]:
        """Return the rows of a shipped table of this data set."""
        folder = data_folder.RECIPES / self.folder / table
        return [record for _, record in clip_table.open_table(folder).records]

    def hashes(self) -> dict[str, str]:
        """Return the known SHA-256 of files, by their names."""
        return {row["file"]: row["sha256"] for row in self.rows("sha256.csv")}


CMU = DataSet(
    "cmu",
    "cmu_walk",
    "strides.csv",
    "http://mocap.cs.cmu.edu",
    "Free for all uses; the data itself may not be resold, even in converted form. The data used "
    "in this project was obtained from mocap.cs.cmu.edu. The database was created with funding "
    "from NSF EIA-0196217.",
)
HDM05 = DataSet(
    "hdm05",
    "hdm05_reach",
    "clips.csv",
    "https://resources.mpi-inf.mpg.de/HDM05",
    "CC BY-SA 3.0: models that are learnt from it have the same licence. The data used in this "
    "project was obtained from HDM05 (Müller et al., Universität Bonn, CG-2007-2).",
)


@dataclass(frozen=True)
class FetchedFile:
    """A converted motion.

    file: its name as the table has it. sources: files that it was made of. content: BVH. remark:
    a reason to doubt that it is the motion of the table; empty without one.
    """

    file: str
    sources: tuple[Path, ...]
    content: bytes
    remark: str = ""

    def facts(self) -> dict[str, Any]:
        """Return names and hashes as JSON values."""
        return {
            "file": self.file,
            "sha256": sha256(self.content),
            "sources": [
                {"file": path.name, "sha256": sha256(path.read_bytes())} for path in self.sources
            ],
            "remark": self.remark,
        }


@dataclass(frozen=True)
class Fetched:
    """Converted motions of a data set, and what is missing: a file and the reason."""

    files: tuple[FetchedFile, ...]
    missing: dict[str, str]


def sha256(content: bytes) -> str:
    """Return the SHA-256 of a file's content in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def motion_files(source: Path) -> dict[str, list[Path]]:
    """Return the ASF, AMC and BVH files below a folder by their names in lower case.

    Raises FileError if there are none.
    """
    files: dict[str, list[Path]] = {}
    for path in sorted(source.rglob("*")):
        if path.suffix.lower() in MOTION_SUFFIXES and path.is_file():
            files.setdefault(path.name.lower(), []).append(path)
    if not files:
        raise FileError(source, f"found no {', '.join(MOTION_SUFFIXES)} file in this folder")
    return files


def only(paths: Sequence[Path]) -> Path:
    """Return the first of several copies of a file; FileError if their contents differ."""
    first, *rest = paths
    for other in rest:
        if other.read_bytes() != first.read_bytes():
            raise FileError(other, f"differs from {first}, expected one file of this name")
    return first


def write(data_set: DataSet, fetched: Fetched, folder: Path) -> dict[str, Any]:
    """Write the motions, the rows of the table that they serve, and a list with hashes.

    Returns the list, which is written as fetched.json: names and SHA-256 of all files and of what
    they were made of. Raises FileError if a file cannot be written.
    """
    target = folder / data_set.folder
    for one in fetched.files:
        atomic_files.write(one.content, target / one.file)
    names = {one.file for one in fetched.files}
    rows = [row for row in data_set.rows(data_set.table) if row["file"] in names]
    atomic_files.write(_csv(rows), target / data_set.table)
    facts = {
        "data": data_set.name,
        "page": data_set.page,
        "terms": data_set.terms,
        "posefield": __version__,
        "folder": str(target),
        "rows": len(rows),
        "files": [one.facts() for one in fetched.files],
        "missing": fetched.missing,
    }
    atomic_files.write(orjson.dumps(facts, option=orjson.OPT_INDENT_2), target / "fetched.json")
    return facts


def _csv(rows: Iterable[dict[str, str]]) -> bytes:
    text = io.StringIO()
    listed = list(rows)
    writer = csv.DictWriter(text, listed[0].keys(), lineterminator="\n")
    writer.writeheader()
    writer.writerows(listed)
    return text.getvalue().encode()
