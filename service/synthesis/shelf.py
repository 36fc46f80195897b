"""A library that follows its sources: what is new there is opened and checked beside what answers,
and takes its place in one step."""

import logging
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from service.synthesis import library
from service.synthesis.intake import Fault, Intake
from service.synthesis.library import Bounds, Library

log = logging.getLogger(__name__)

SETTLING = 0.5
"""Seconds until what has just changed is looked at again."""


@dataclass(frozen=True)
class Reloads:
    """What has become of looking at the sources: looks, versions that were opened and attempts that
    failed since the start, and what is wrong now.

    changed: when the library last changed, seconds since 1970. last_error: of the last failure,
    whether or not that has been put right.
    """

    looks: int = 0
    opened: int = 0
    failed: int = 0
    faults: tuple[Fault, ...] = ()
    changed: float = 0.0
    last_error: str = ""


class Models(Protocol):
    """Models that may be others at the next look at `library`: take it once a request."""

    @property
    def library(self) -> Library:
        """What there is now."""

    @property
    def reloads(self) -> Reloads:
        """What became of looking for others."""


class Fixed:
    """Models that stay what they are."""

    reloads = Reloads()

    def __init__(self, library: Library) -> None:
        self.library = library


class Shelf:
    """Models of places, of which `library` is what they were when last looked at.

    Whatever cannot be used leaves in place what was there: a file that is broken, a source that
    cannot be reached or holds no model at all. A name that its source no longer has goes, with all
    its versions; a version that it no longer has is an older one.
    """

    def __init__(self, places: Iterable[str | Path], bounds: Bounds) -> None:
        """Open everything that can be; `check` says what could not."""
        self.library = Library({})
        self.reloads = Reloads()
        self._bounds = bounds
        self._intake = Intake(places, most=1 + bounds.older)
        self._take()

    def check(self) -> None:
        """Raise ModelError as `library.load` does, for what could not be opened."""
        self._intake.check()

    def look(self) -> bool:
        """Take what the sources hold now; False where something has just changed and must be looked
        at once more. For one thread at a time."""
        known = {str(fault.error) for fault in self.reloads.faults}
        settled = self._take()
        for fault in self.reloads.faults:
            if str(fault.error) not in known:
                log.warning("%s", fault.error)
        return settled

    def _take(self) -> bool:
        settled = self._intake.look()
        found = library.arranged(self._intake.versions(), self.library, self._bounds)
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
        """Look every so many seconds, or never for none, in a thread, for as long as this lasts."""
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
    # By the clock, so that several processes look at the same moment and agree on what is newest.
    return seconds - time.time() % seconds
