"""What an export is: everything that its bytes hang on, so that two runs of one job agree."""

import hashlib
from dataclasses import asdict, dataclass
from functools import cached_property, lru_cache
from importlib.metadata import version
from typing import Any

import orjson

from service import __version__
from service.encode.convention import Unit, Up
from service.motion.errors import InvalidField
from service.motion.roles import Names
from service.synthesis import session
from service.synthesis.question import NAMES
from service.synthesis.synthesizer import Synthesizer

MAKERS = ("numpy", "onnxruntime", "usd-core")
"""Whose versions the bytes may hang on."""


@dataclass(frozen=True)
class Job:
    """One export, whoever does it and in however many goes.

    model: name@contenthash. content: SHA-256 of the model file. queries: digest of their source.
    chunk: rows that are done together. unit, up: none for what readers of each format expect.
    names: what joints are called where a row does not say.
    """

    model: str
    content: str
    queries: str
    layout: str
    chunk: int
    unit: Unit | None = None
    up: Up | None = None
    names: Names = NAMES

    def __post_init__(self) -> None:
        if self.chunk < 1:
            raise InvalidField("chunk", f"{self.chunk}, expected 1 or more rows")

    def facts(self) -> dict[str, Any]:
        """The same as plain values, with the versions of what makes the files."""
        versions = {"posefield": __version__, **{maker: version(maker) for maker in MAKERS}}
        return {**asdict(self), "versions": versions}

    @cached_property
    def digest(self) -> str:
        """Name of the job: the same for the same facts only."""
        plain = orjson.dumps(self.facts(), option=orjson.OPT_SORT_KEYS)
        return hashlib.sha256(plain).hexdigest()


@dataclass(frozen=True)
class Work:
    """All that one who does a part of a job must be given, but for the rows; it can be pickled.

    model: content of the model file, read once. target: folder or URL. skip: whether rows at fault
    are left out instead of ending the export.
    """

    job: Job
    model: bytes
    target: str
    skip: bool = False


def opened(work: Work) -> Synthesizer:
    """The model of a job; a process opens it once for many chunks."""
    return _opened(work.job.model, work.model)


@lru_cache(maxsize=1)
def _opened(identity: str, content: bytes) -> Synthesizer:
    return Synthesizer(identity.partition("@")[0], session.open_bytes(content, identity))
