"""Model library that follows its sources.

New files are opened and checked while the present models answer, then the library is replaced in
one step.
"""

import logging
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from posefield.inference.trial_process import LIMITS, Limits
from posefield.registry import model_registry
from posefield.registry.model_loading import Fault, Intake
from posefield.registry.model_registry import Bounds, Library

log = logging.getLogger(__name__)

SETTLING = 0.5
"""Seconds until a changing file is looked at again."""


@dataclass(frozen=True)
class Reloads:
    """Statistics of looking at the sources.

    looks: number of looks. opened, failed: versions opened and failed attempts since the start.
    faults: present faults. changed: time of the last change of the library, seconds since 1970.
    last_error: message of the last failure, kept after its repair.
    """

    looks: int = 0
    opened: int = 0
    failed: int = 0
    faults: tuple[Fault, ...] = ()
    changed: float = 0.0
    last_error: str = ""


class Models(Protocol):
    """Models that may be replaced: read `library` once per request."""

    @property
    def library(self) -> Library:
        """Current library."""

    @property
    def reloads(self) -> Reloads:
        """Statistics of looking at the sources."""


class Fixed:
    """Models that are never replaced."""

    reloads = Reloads()

    def __init__(self, library: Library) -> None:
        self.library = library


class Shelf:
    """Models of places; `library` is their state at the last look.

    A file that cannot be used, and a source that cannot be reached or contains no model, leave the
    models as they were. A name that its source no longer lists is removed with all its versions; a
    version that its source no longer lists becomes an older one.
    """

    def __init__(
        self, places: Iterable[str | Path], bounds: Bounds, limits: Limits = LIMITS
    ) -> None:
        """Open everything that can be opened within the limits; `check` raises the first fault."""
        self.library = Library({})
        self.reloads = Reloads()
        self._bounds = bounds
        self._intake = Intake(places, 1 + bounds.older, limits)
        self._logged: set[str] = set()
        self._take()

    def check(self) -> None:
        """Raise ModelError for the first place that could not be opened."""
        self._intake.check()

    def look(self) -> bool:
        """Update the library from the sources, and log each new fault.

        Returns False while a file is changing, so that another look must follow. Not thread-safe.
        """
        settled = self._take()
        found = {str(fault.error) for fault in self.reloads.faults}
        for message in sorted(found - self._logged):
            log.warning("%s", message)
        self._logged = found
        return settled

    def _take(self) -> bool:
        settled = self._intake.look()
        found = model_registry.arranged(self._intake.versions(), self.library, self._bounds)
        self._intake.release(found.identities)
        if changed := found.identities != self.library.identities:
            self.library = found
        self.reloads = self._reloads(changed)
        return settled

    def _reloads(self, changed: bool) -> Reloads:
        before, intake = self.reloads, self._intake
        faults = tuple(intake.faults.values())
        return Reloads(
            before.looks + 1,
            intake.opened,
            intake.failed,
            faults,
            time.time() if changed else before.changed,
            str(faults[-1].error) if faults else before.last_error,
        )

    @contextmanager
    def watched(self, seconds: float) -> Iterator[None]:
        """Look every `seconds` in a thread while the context lasts; never if `seconds` is 0."""
        ended = threading.Event()
        thread = threading.Thread(target=self._watch, args=(seconds, ended), daemon=True)
        if seconds:
            thread.start()
        try:
            yield
        finally:
            ended.set()

    def _watch(self, seconds: float, ended: threading.Event) -> None:
        settled = True
        while not ended.wait(_until_next(seconds) if settled else min(seconds, SETTLING)):
            try:
                settled = self.look()
            except Exception:
                log.exception("looking for models failed")


def _until_next(seconds: float) -> float:
    # Aligned to the clock, so that several processes look at the same moment and agree on the
    # newest.
    return seconds - time.time() % seconds
