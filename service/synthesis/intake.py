"""Model files taken in from their sources, look by look: opened once settled, once a content."""

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from weakref import WeakValueDictionary

from service.motion.errors import ModelError
from service.synthesis import session, sources
from service.synthesis.sources import Found, Source
from service.synthesis.synthesizer import Synthesizer

NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}")


@dataclass(frozen=True)
class Fault:
    """Why a model, or a whole source where there is no name, is not what lies there now."""

    name: str
    version: str
    error: ModelError


def opened(name: str, place: str | Path, content: bytes) -> Synthesizer:
    """Model of a file that has been read; ModelError for a file that cannot be served, and for a
    name that cannot stand in a URL."""
    if not NAME.fullmatch(name):
        raise ModelError(place, f"name {name!r}, expected {NAME.pattern}")
    return Synthesizer(name, session.open_bytes(content, str(place)))


class Intake:
    """Models that the sources hold, as far as they can be used.

    A file that is new or has changed is read when two looks in a row find it the same, and gone
    when two find it missing: it may be half copied, or about to be replaced. Where it cannot be
    used, what its place held before stays. The first look takes everything as it is.
    faults: what is wrong now, by place. opened, failed: how often so far, a fault that stays once.
    """

    def __init__(self, places: Iterable[str | Path], most: int) -> None:
        """most: how many versions of a name are opened, the newest."""
        self._sources = {str(place): sources.source(place) for place in places}
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
        """Take in what the sources hold now; False where something has just changed."""
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
        """Whether to read a file: it is new, or was released and is the newest now."""
        if self._read.get(found.place) != found.signature:
            return True
        newest = next((f for f in versions if f.place in self._held.keys() | self._released), found)
        return found.place in self._released and newest.place == found.place

    def _forget(self, place: str) -> None:
        self._held.pop(place, None)
        self._released.discard(place)
        del self._read[place]

    def release(self, held: Collection[str]) -> None:
        """Hold no other models than of these identities."""
        for place, (_, model) in [*self._held.items()]:
            if model.identity not in held:
                del self._held[place]
                self._released.add(place)

    def versions(self) -> dict[str, list[Synthesizer]]:
        """Models by name, the newest version of each first."""
        grouped = sources.by_name(found for found, _ in self._held.values())
        return {name: [self._held[f.place][1] for f in found] for name, found in grouped.items()}

    def check(self) -> None:
        """Raise the first of the faults, if there is any."""
        for fault in self.faults.values():
            raise fault.error

    def _wanted(self, known: dict[str, Fault]) -> list[list[Found]]:
        """The files to be held: of each name the newest few, the newest first."""
        owners: dict[str, tuple[str, bool]] = {}
        wanted = []
        for place, source in self._sources.items():
            for name, versions in sources.by_name(self._look(place, source, known)).items():
                # A file NAME.onnx and a folder NAME of versions are two places, too.
                owner = owners.setdefault(name, (place, versions[0].version == ""))
                own = [found for found in versions if (place, found.version == "") == owner]
                for found in versions:
                    if found not in own:
                        error = ModelError(found.place, f"a second model named {name!r}")
                        self._fail(found.place, Fault(name, found.version, error), known)
                wanted.append(own[: self._most])
        return wanted

    def _look(self, place: str, source: Source, known: dict[str, Fault]) -> list[Found]:
        """What a source holds; what it held, where it cannot say."""
        try:
            self._listed[place] = source.look()
        except ModelError as error:
            self._fail(place, Fault("", "", error), known)
        return self._listed.get(place, [])

    def _moving(self) -> set[str]:
        """Places that this look finds otherwise than the one before."""
        now = {found.place: found.signature for files in self._listed.values() for found in files}
        before = now if self._signatures is None else self._signatures
        self._signatures = now
        return {p for p in now.keys() | before.keys() if now.get(p) != before.get(p)}

    def _take(self, found: Found, known: dict[str, Fault]) -> None:
        try:
            content = found.read()
            # What could be read and not be used is not tried again before it changes.
            self._read[found.place] = found.signature
            self._held[found.place] = found, self._opened(found, content)
            self._released.discard(found.place)
        except ModelError as error:
            self._fail(found.place, Fault(found.name, found.version, error), known)

    def _opened(self, found: Found, content: bytes) -> Synthesizer:
        """Model of a content, the one that is open if there is one."""
        identity = f"{found.name}@{session.digest(content)}"
        model = self._alive.get(identity)
        if model is None:
            model = self._alive[identity] = opened(found.name, found.place, content)
            self.opened += 1
        return model

    def _fail(self, place: str, fault: Fault, known: dict[str, Fault]) -> None:
        self.faults[place] = fault
        if place not in known or str(known[place].error) != str(fault.error):
            self.failed += 1
