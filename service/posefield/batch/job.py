"""Job of an export, all parameters that determine its bytes, and its files with their manifest."""

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from functools import cached_property, lru_cache
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import orjson

from posefield import __version__
from posefield.common.errors import InvalidField
from posefield.common.units import LengthUnit, UpAxis
from posefield.inference import session
from posefield.motion.joint_roles import NamingConvention
from posefield.question.motion_question import BodyKind
from posefield.question.performance_report import PerformanceAnswer
from posefield.question.results import ClipAnswer
from posefield.synthesis.synthesizer import Synthesizer

if TYPE_CHECKING:
    from posefield.characters.user_character import UserCharacter

VERSIONED_PACKAGES = ("numpy", "onnxruntime", "usd-core")
"""Packages whose versions may affect the bytes."""
MANIFEST = "manifest.jsonl"


@dataclass(frozen=True)
class ExportJob:
    """One export, independent of the processes and runs that make it.

    model: name@contenthash. content: SHA-256 of the model file. queries: digest of their source.
    layout: name of the layout. chunk: rows per chunk. unit, up, body: None for those of each
    format. names: default naming convention of the joints. root_bone: whether the clips have one by
    default. character: name, digest and reference of the character of a user; empty for the
    model's.
    """

    model: str
    content: str
    queries: str
    layout: str
    chunk: int
    unit: LengthUnit | None = None
    up: UpAxis | None = None
    names: NamingConvention = "own"
    root_bone: bool = False
    body: BodyKind | None = None
    character: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.chunk < 1:
            raise InvalidField("chunk", f"{self.chunk}, expected 1 or more rows")

    def facts(self) -> dict[str, Any]:
        """Return the fields as plain values, with the versions of the packages used."""
        versions = {name: version(name) for name in VERSIONED_PACKAGES}
        return {
            **asdict(self),
            "character": list(self.character),
            "versions": {"posefield": __version__, **versions},
        }

    @cached_property
    def digest(self) -> str:
        """Digest of the facts, which identifies the job."""
        plain = orjson.dumps(self.facts(), option=orjson.OPT_SORT_KEYS)
        return hashlib.sha256(plain).hexdigest()


@dataclass(frozen=True)
class WorkerInput:
    """Data that a worker needs besides the rows; it can be pickled.

    model: content of the model file, read once; the job has its checksum. target: folder or URL.
    skip: leave invalid rows out instead of ending the export. character: that moves instead of the
    model's own; the job has its digest. about: path and content of further files about the whole
    export, which follow from the job.
    """

    job: ExportJob
    model: bytes = field(compare=False, repr=False)
    target: str
    skip: bool = False
    character: "UserCharacter | None" = field(default=None, compare=False, repr=False)
    about: tuple[tuple[str, bytes], ...] = field(default=(), compare=False, repr=False)


@lru_cache(maxsize=1)
def open_model_of(work: WorkerInput) -> Synthesizer:
    """Return the model of a job, cached so that a process opens it once for many chunks."""
    identity = work.job.model
    return Synthesizer(identity.partition("@")[0], session.open_bytes(work.model, identity))


@dataclass(frozen=True)
class ExportedFile:
    """A file of many: its path, its content and its entry in the manifest."""

    path: str
    content: bytes
    entry: dict[str, Any]


def exported_file(
    name: str, path: str, answer: ClipAnswer | PerformanceAnswer, content: bytes
) -> ExportedFile:
    """Return the file of an answer, with its path, checksum, frames and trust as entry.

    path: relative to the manifest. content: the file's bytes.
    """
    entry: dict[str, Any] = {"name": name, "file": path, "bytes": len(content)}
    entry["sha256"] = hashlib.sha256(content).hexdigest()
    if isinstance(answer, ClipAnswer):
        entry |= {"frames": len(answer.clip), "fps": answer.clip.rate}
    return ExportedFile(path, content, entry | answer.trust.document())


def manifest_line(entry: dict[str, Any]) -> bytes:
    """Return an entry as a line of JSON Lines."""
    return orjson.dumps(entry, option=orjson.OPT_APPEND_NEWLINE)


def archive_members(
    files: Iterable[ExportedFile], manifest: str = MANIFEST
) -> Iterator[tuple[str, bytes]]:
    """Yield path and content of each file, then the manifest; earlier contents are released."""
    # Not a list: each bytes object of orjson occupies a page of memory, whatever its length.
    lines = bytearray()
    for file in files:
        lines += manifest_line(file.entry)
        yield file.path, file.content
        # Not in memory while the next one is made.
        del file
    yield manifest, bytes(lines)
