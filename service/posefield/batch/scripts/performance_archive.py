"""Files of many performances in sequence, as an archive takes them, with the manifest last.

Every script is planned before the first file is made, so that a script that cannot be performed
refuses the whole archive. The motions are not kept: each is made again when its file is requested.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from posefield.batch import manifest
from posefield.characters.delivery import Delivery
from posefield.common import cancellation
from posefield.encode.files.file_convention import Convention
from posefield.encode.performance_files import PerformanceEncoder
from posefield.performance import composition
from posefield.performance.script import Script
from posefield.question.performance_report import PerformanceAnswer

MANIFEST = "manifest.jsonl"


@dataclass(frozen=True)
class ArchivedScript:
    """A planned script.

    file: name of its file, with the extension. convention: unit and up axis of the file. most:
    largest number of frames. warned: whether its plan has a warning.
    """

    name: str
    file: str
    script: Script
    convention: Convention
    most: int
    warned: bool


@dataclass(frozen=True)
class PerformanceOrder:
    """Planned scripts of one format.

    encode: writes their files. delivery: to a character of a user; None for those of the scripts.
    """

    scripts: Sequence[ArchivedScript]
    encode: PerformanceEncoder
    delivery: Delivery | None = None

    def file(self, one: ArchivedScript) -> tuple[PerformanceAnswer, bytes]:
        """Return the performance of a script, and its file."""
        answer = composition.perform(one.script, one.most)
        if self.delivery is None:
            return answer, self.encode(answer, one.convention)
        own = replace(self.delivery, convention=one.convention)
        made = own.performance(answer, one.script.character.roles)
        return made, own.encode(made)

    @property
    def warnings(self) -> list[str]:
        """Warning with the number of scripts that have some; the manifest has those of each."""
        count = sum(own.warned for own in self.scripts)
        every = len(self.scripts)
        return [f"{count} of {every} performances have warnings"] if count else []


def archive_members(order: PerformanceOrder) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each performance's file in the order given, then the manifest.

    A performance is made when its file is requested; of earlier ones only manifest lines remain in
    memory.
    """
    lines = bytearray()
    for own in order.scripts:
        cancellation.check()
        answer, content = order.file(own)
        lines += manifest.line(entry(own.name, own.file, content, answer))
        yield own.file, content
    yield MANIFEST, bytes(lines)


def entry(name: str, file: str, content: bytes, answer: PerformanceAnswer) -> dict[str, Any]:
    """Return the manifest entry of a performance as plain values: path, checksum and report."""
    return {
        "name": name,
        "file": file,
        "bytes": len(content),
        "sha256": hashlib.sha256(content).hexdigest(),
        **answer.trust.document(),
    }
