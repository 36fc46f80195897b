"""Loading of model files from their sources: opens new files once they have settled."""

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
from posefield.inference.trial_process import DEFAULT_LIMITS, TrialLimits
from posefield.model_file import checked_file
from posefield.registry import model_sources
from posefield.registry.listed_models import ModelFile
from posefield.registry.model_sources import Source
from posefield.synthesis.synthesizer import Synthesizer

log = logging.getLogger(__name__)

NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}")


@dataclass(frozen=True)
class LoadFailure:
    """Reason for which a model file, or a source (name is empty), cannot be used."""

    name: str
    version: str
    error: ModelError


def open_model(
    name: str,
    place: str | Path,
    content: bytes,
    limits: TrialLimits = DEFAULT_LIMITS,
) -> Synthesizer:
    """Return the model of a file that has been read.

    Raises ModelError for a file that cannot be served and a name that cannot stand in a URL.
    """
    if not NAME.fullmatch(name):
        raise ModelError(place, f"name {name!r}, expected {NAME.pattern}")
    return Synthesizer(name, session.load_bytes(content, str(place), limits))


class ModelLoader:
    """Usable models of the sources, and faults of the other files.

    A new or changed file is opened when two consecutive looks find the same signature, and a
    missing file's model is removed when two looks miss it: the file may be half copied, or about to
    be replaced. A file that cannot be used leaves the previous model of its place, and is retried
    only after it changes; other files are not affected. The first look opens every file at once.
    faults: by place, as of the last look. opened, failed: counts since the start; a fault that
    stays counts once.
    """

    def __init__(
        self,
        places: Iterable[str | Path],
        most: int,
        limits: TrialLimits = DEFAULT_LIMITS,
    ) -> None:
        """Prepare to look at files, folders and URLs.

        most: largest number of versions of a name that are open, the newest. limits: of each file's
        trial.
        """
        self._limits = limits
        self._sources = {str(place): model_sources.open_source(place) for place in places}
        self._most = most
        self._listed: dict[str, list[ModelFile]] = {}
        self._signatures: dict[str, str] | None = None
        self._read: dict[str, str] = {}
        self._models: dict[str, tuple[ModelFile, Synthesizer]] = {}
        self._released: set[str] = set()
        self._alive: WeakValueDictionary[str, Synthesizer] = WeakValueDictionary()
        self.faults: dict[str, LoadFailure] = {}
        self.opened = self.failed = 0

    def scan(self) -> bool:
        """Update the models from the sources; return False while a file is changing."""
        known, self.faults = self.faults, {}
        wanted = self._files_to_open(known)
        moving = self._changing()
        for versions in wanted:
            for found in versions:
                if found.location not in moving and self._is_due(found, versions):
                    self._open_or_record(found, known)
                elif found.location in known:
                    self.faults[found.location] = known[found.location]
        places = {found.location for versions in wanted for found in versions}
        for place in self._read.keys() - places - moving:
            self._forget(place)
        return not moving

    def _is_due(self, found: ModelFile, versions: list[ModelFile]) -> bool:
        """Return whether to read a file: new, changed, or released and now the newest."""
        if self._read.get(found.location) != found.signature:
            return True
        newest = next(
            (f for f in versions if f.location in self._models.keys() | self._released), found
        )
        return found.location in self._released and newest.location == found.location

    def _forget(self, place: str) -> None:
        self._models.pop(place, None)
        self._released.discard(place)
        del self._read[place]

    def release(self, held: Collection[str]) -> None:
        """Release all models except those with these identities."""
        for place, (_, model) in [*self._models.items()]:
            if model.identity not in held:
                del self._models[place]
                self._released.add(place)

    def versions(self) -> dict[str, list[Synthesizer]]:
        """Return models by name, the newest version of each first."""
        grouped = model_sources.group_by_name(found for found, _ in self._models.values())
        return {
            name: [self._models[f.location][1] for f in found] for name, found in grouped.items()
        }

    def check(self) -> None:
        """Raise the error of the first fault, if there is one."""
        for fault in self.faults.values():
            raise fault.error

    def _files_to_open(self, known: dict[str, LoadFailure]) -> list[list[ModelFile]]:
        """Return the files to keep open: the newest few of each name, the newest first."""
        owners: dict[str, tuple[str, bool]] = {}
        wanted = []
        for place, source in self._sources.items():
            for name, versions in model_sources.group_by_name(
                self._scan(place, source, known)
            ).items():
                # A file NAME.onnx and a folder NAME of versions count as two places.
                owner = owners.setdefault(name, (place, versions[0].version == ""))
                own = [found for found in versions if (place, found.version == "") == owner]
                for found in versions:
                    if found not in own:
                        error = ModelError(found.location, f"a second model named {name!r}")
                        self._record_failure(
                            found.location, LoadFailure(name, found.version, error), known
                        )
                wanted.append(own[: self._most])
        return wanted

    def _scan(self, place: str, source: Source, known: dict[str, LoadFailure]) -> list[ModelFile]:
        """Return the files of a source; those of its last look if this one fails."""
        with self._recording_failures(place, "", "", known):
            self._listed[place] = source.scan()
        return self._listed.get(place, [])

    def _changing(self) -> set[str]:
        """Return the places whose signature differs from the previous look."""
        now = {
            found.location: found.signature for files in self._listed.values() for found in files
        }
        before = now if self._signatures is None else self._signatures
        self._signatures = now
        return {p for p in now.keys() | before.keys() if now.get(p) != before.get(p)}

    def _open_or_record(self, found: ModelFile, known: dict[str, LoadFailure]) -> None:
        """Open a file, or record the fault that prevents it."""
        with self._recording_failures(found.location, found.name, found.version, known):
            content = found.read()
            # A file that could be read but not used is retried only after it changes.
            self._read[found.location] = found.signature
            try:
                self._models[found.location] = found, self._open_model(found, content)
            except OSError as error:
                # The child process failed, not the file: the next look tries again.
                del self._read[found.location]
                reason = f"no process to try it in: {error.strerror}"
                raise ModelError(found.location, reason) from error
            self._released.discard(found.location)

    def _open_model(self, found: ModelFile, content: bytes) -> Synthesizer:
        """Return the model with this content; an open one is reused."""
        identity = f"{found.name}@{checked_file.digest(content)}"
        model = self._alive.get(identity)
        if model is None:
            model = open_model(found.name, found.location, content, self._limits)
            self._alive[identity] = model
            self.opened += 1
        return model

    @contextmanager
    def _recording_failures(
        self, place: str, name: str, version: str, known: dict[str, LoadFailure]
    ) -> Iterator[None]:
        """Record any error as a fault of the place, so that other places are processed."""
        try:
            yield
        except ModelError as error:
            self._record_failure(place, LoadFailure(name, version, error), known)
        except Exception as error:
            if place not in known:
                log.exception("%s: an error that no check foresees", place)
            said = f"cannot be used: {type(error).__name__}: {first_line(error)}"
            self._record_failure(place, LoadFailure(name, version, ModelError(place, said)), known)

    def _record_failure(
        self, place: str, fault: LoadFailure, known: dict[str, LoadFailure]
    ) -> None:
        self.faults[place] = fault
        if place not in known or str(known[place].error) != str(fault.error):
            self.failed += 1
