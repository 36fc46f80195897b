"""Intake of model files from their sources: opens new files once they have settled."""

import logging
import re
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from weakref import WeakValueDictionary

from posefield.common.errors import ModelError
from posefield.inference import session
from posefield.inference.onnx_runtime import first_line
from posefield.inference.trial_process import LIMITS, Limits
from posefield.model_file import checked_file
from posefield.registry import model_sources
from posefield.registry.listed_models import Found
from posefield.registry.model_sources import Source
from posefield.synthesis.synthesizer import Synthesizer

log = logging.getLogger(__name__)

NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}")


@dataclass(frozen=True)
class Fault:
    """Reason for which a model file, or a source (name is empty), cannot be used."""

    name: str
    version: str
    error: ModelError


def opened(name: str, place: str | Path, content: bytes, limits: Limits = LIMITS) -> Synthesizer:
    """Return the model of a file that has been read.

    Raises ModelError for a file that cannot be served and a name that cannot stand in a URL.
    """
    if not NAME.fullmatch(name):
        raise ModelError(place, f"name {name!r}, expected {NAME.pattern}")
    return Synthesizer(name, session.load_bytes(content, str(place), limits))


class Intake:
    """Usable models of the sources, and faults of the other files.

    A new or changed file is opened when two consecutive looks find the same signature, and a
    missing file's model is removed when two looks miss it: the file may be half copied, or about to
    be replaced. A file that cannot be used leaves the previous model of its place, and is retried
    only after it changes; other files are not affected. The first look opens every file at once.
    faults: by place, as of the last look. opened, failed: counts since the start; a fault that
    stays counts once.
    """

    def __init__(self, places: Iterable[str | Path], most: int, limits: Limits = LIMITS) -> None:
        """Prepare to look at files, folders and URLs.

        most: largest number of versions of a name that are open, the newest. limits: of each file's
        trial.
        """
        self._limits = limits
        self._sources = {str(place): model_sources.source(place) for place in places}
        self._most = most
        self._listed: dict[str, list[Found]] = {}
        self._signatures: dict[str, str] | None = None
        self._read: dict[str, str] = {}
        self._held: dict[str, tuple[Found, Synthesizer]] = {}
        self._released: set[str] = set()
        self._alive: WeakValueDictionary[str, Synthesizer] = WeakValueDictionary()
        self.faults: dict[str, Fault] = {}
        self.opened = self.failed = 0

    def look(self) -> bool:
        """Update the models from the sources; return False while a file is changing."""
        known, self.faults = self.faults, {}
        wanted = self._wanted(known)
        moving = self._moving()
        for versions in wanted:
            for found in versions:
                if found.place not in moving and self._is_due(found, versions):
                    self._take(found, known)
                elif found.place in known:
                    self.faults[found.place] = known[found.place]
        places = {found.place for versions in wanted for found in versions}
        for place in self._read.keys() - places - moving:
            self._forget(place)
        return not moving

    def _is_due(self, found: Found, versions: list[Found]) -> bool:
        """Return whether to read a file: new, changed, or released and now the newest."""
        if self._read.get(found.place) != found.signature:
            return True
        newest = next((f for f in versions if f.place in self._held.keys() | self._released), found)
        return found.place in self._released and newest.place == found.place

    def _forget(self, place: str) -> None:
        self._held.pop(place, None)
        self._released.discard(place)
        del self._read[place]

    def release(self, held: Collection[str]) -> None:
        """Release all models except those with these identities."""
        for place, (_, model) in [*self._held.items()]:
            if model.identity not in held:
                del self._held[place]
                self._released.add(place)

    def versions(self) -> dict[str, list[Synthesizer]]:
        """Return models by name, the newest version of each first."""
        grouped = model_sources.by_name(found for found, _ in self._held.values())
        return {name: [self._held[f.place][1] for f in found] for name, found in grouped.items()}

    def check(self) -> None:
        """Raise the error of the first fault, if there is one."""
        for fault in self.faults.values():
            raise fault.error

    def _wanted(self, known: dict[str, Fault]) -> list[list[Found]]:
        """Return the files to keep open: the newest few of each name, the newest first."""
        owners: dict[str, tuple[str, bool]] = {}
        wanted = []
        for place, source in self._sources.items():
            for name, versions in model_sources.by_name(self._look(place, source, known)).items():
                # A file NAME.onnx and a folder NAME of versions count as two places.
                owner = owners.setdefault(name, (place, versions[0].version == ""))
                own = [found for found in versions if (place, found.version == "") == owner]
                for found in versions:
                    if found not in own:
                        error = ModelError(found.place, f"a second model named {name!r}")
                        self._fail(found.place, Fault(name, found.version, error), known)
                wanted.append(own[: self._most])
        return wanted

    def _look(self, place: str, source: Source, known: dict[str, Fault]) -> list[Found]:
        """Return the files of a source; those of its last look if this one fails."""
        with self._failing(place, "", "", known):
            self._listed[place] = source.look()
        return self._listed.get(place, [])

    def _moving(self) -> set[str]:
        """Return the places whose signature differs from the previous look."""
        now = {found.place: found.signature for files in self._listed.values() for found in files}
        before = now if self._signatures is None else self._signatures
        self._signatures = now
        return {p for p in now.keys() | before.keys() if now.get(p) != before.get(p)}

    def _take(self, found: Found, known: dict[str, Fault]) -> None:
        """Open a file, or record the fault that prevents it."""
        with self._failing(found.place, found.name, found.version, known):
            content = found.read()
            # A file that could be read but not used is retried only after it changes.
            self._read[found.place] = found.signature
            try:
                self._held[found.place] = found, self._opened(found, content)
            except OSError as error:
                # The child process failed, not the file: the next look tries again.
                del self._read[found.place]
                reason = f"no process to try it in: {error.strerror}"
                raise ModelError(found.place, reason) from error
            self._released.discard(found.place)

    def _opened(self, found: Found, content: bytes) -> Synthesizer:
        """Return the model with this content; an open one is reused."""
        identity = f"{found.name}@{checked_file.digest(content)}"
        model = self._alive.get(identity)
        if model is None:
            model = opened(found.name, found.place, content, self._limits)
            self._alive[identity] = model
            self.opened += 1
        return model

    @contextmanager
    def _failing(
        self, place: str, name: str, version: str, known: dict[str, Fault]
    ) -> Iterator[None]:
        """Record any error as a fault of the place, so that other places are processed."""
        try:
            yield
        except ModelError as error:
            self._fail(place, Fault(name, version, error), known)
        except Exception as error:
            if place not in known:
                log.exception("%s: an error that no check foresees", place)
            said = f"cannot be used: {type(error).__name__}: {first_line(error)}"
            self._fail(place, Fault(name, version, ModelError(place, said)), known)

    def _fail(self, place: str, fault: Fault, known: dict[str, Fault]) -> None:
        self.faults[place] = fault
        if place not in known or str(known[place].error) != str(fault.error):
            self.failed += 1
