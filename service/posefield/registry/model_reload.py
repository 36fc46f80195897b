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

from posefield.inference.trial_process import DEFAULT_LIMITS, TrialLimits
from posefield.registry import model_registry
from posefield.registry.model_loading import LoadFailure, ModelLoader
from posefield.registry.model_registry import ModelRegistry, VersionLimits

log = logging.getLogger(__name__)

SETTLE_SECONDS = 0.5
"""Seconds until a changing file is looked at again."""


@dataclass(frozen=True)
class ReloadStatistics:
    """Statistics of looking at the sources.

    looks: number of looks. opened, failed: versions opened and failed attempts since the start.
    faults: present faults. changed: time of the last change of the library, seconds since 1970.
    last_error: message of the last failure, kept after its repair.
    """

    looks: int = 0
    opened: int = 0
    failed: int = 0
    faults: tuple[LoadFailure, ...] = ()
    changed: float = 0.0
    last_error: str = ""


class RegistryProvider(Protocol):
    """Models that may be replaced: read `registry` once per request."""

    @property
    def registry(self) -> ModelRegistry:
        """Current library."""

    @property
    def reloads(self) -> ReloadStatistics:
        """Statistics of looking at the sources."""


class FixedRegistry:
    """Models that are never replaced."""

    reloads = ReloadStatistics()

    def __init__(self, library: ModelRegistry) -> None:
        self.registry = library


class ReloadingRegistry:
    """Models of places; `registry` is their state at the last look.

    A file that cannot be used, and a source that cannot be reached or contains no model, leave the
    models as they were. A name that its source no longer lists is removed with all its versions; a
    version that its source no longer lists becomes an older one.
    """

    def __init__(
        self,
        places: Iterable[str | Path],
        bounds: VersionLimits,
        limits: TrialLimits = DEFAULT_LIMITS,
    ) -> None:
        """Open everything that can be opened within the limits; `check` raises the first fault."""
        self.registry = ModelRegistry({})
        self.reloads = ReloadStatistics()
        self._bounds = bounds
        self._loader = ModelLoader(places, 1 + bounds.older, limits)
        self._logged: set[str] = set()
        self._refresh()

    def check(self) -> None:
        """Raise ModelError for the first place that could not be opened."""
        self._loader.check()

    def scan(self) -> bool:
        """Update the library from the sources, and log each new fault.

        Returns False while a file is changing, so that another look must follow. Not thread-safe.
        """
        settled = self._refresh()
        found = {str(fault.error) for fault in self.reloads.faults}
        for message in sorted(found - self._logged):
            log.warning("%s", message)
        self._logged = found
        return settled

    def _refresh(self) -> bool:
        settled = self._loader.scan()
        found = model_registry.merge_versions(self._loader.versions(), self.registry, self._bounds)
        self._loader.release(found.identities)
        if changed := found.identities != self.registry.identities:
            self.registry = found
        self.reloads = self._reloads(changed)
        return settled

    def _reloads(self, changed: bool) -> ReloadStatistics:
        before, intake = self.reloads, self._loader
        faults = tuple(intake.faults.values())
        return ReloadStatistics(
            before.looks + 1,
            intake.opened,
            intake.failed,
            faults,
            time.time() if changed else before.changed,
            str(faults[-1].error) if faults else before.last_error,
        )

    @contextmanager
    def watch(self, seconds: float) -> Iterator[None]:
        """Look every `seconds` in a thread while the context lasts; never if `seconds` is 0."""
        ended = threading.Event()
        thread = threading.Thread(target=self._scan_repeatedly, args=(seconds, ended), daemon=True)
        if seconds:
            thread.start()
        try:
            yield
        finally:
            ended.set()

    def _scan_repeatedly(self, seconds: float, ended: threading.Event) -> None:
        settled = True
        while not ended.wait(_until_next(seconds) if settled else min(seconds, SETTLE_SECONDS)):
            try:
                settled = self.scan()
            except Exception:
                log.exception("looking for models failed")


def _until_next(seconds: float) -> float:
    # Aligned to the clock, so that several processes look at the same moment and agree on the
    # newest.
    return seconds - time.time() % seconds
