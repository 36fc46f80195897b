"""Models that a service answers for: a set, replaced as a whole as its sources change.

New files are opened and checked while the present models answer, then the set is replaced in one
step. The models that ship with the package are served where no other model is named.
"""

import logging
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, chain, takewhile
from pathlib import Path
from typing import Protocol

from posefield.common.errors import ModelError, UnknownModel, did_you_mean
from posefield.inference.trial_process import DEFAULT_LIMITS, TrialLimits
from posefield.registry.model_loading import LoadFailure, ModelLoader
from posefield.synthesis.synthesizer import Synthesizer


@dataclass(frozen=True)
class ModelRegistry:
    """Models of a service by name, and older versions.

    models: the newest model of each name. older: versions that still answer under name@contenthash,
    those of one name from newer to older.
    """

    models: dict[str, Synthesizer]
    older: tuple[Synthesizer, ...] = ()

    def find(self, key: str) -> Synthesizer:
        """Return the newest model of a name, or the model of a name@contenthash.

        Raises UnknownModel, with the available identities, for any other key.
        """
        model = self._by_key.get(key)
        if model is None:
            name = key.partition("@")[0]
            near = self.versions(name) or tuple(self._by_key[key] for key in self.models)
            known = ", ".join(m.identity for m in near)
            hint = "" if name in self.models else did_you_mean(name, self.models)
            raise UnknownModel("model", f"no model {key!r}{hint}; there are {known}")
        return model

    def versions(self, name: str) -> tuple[Synthesizer, ...]:
        """Return all versions of a name, the newest first; empty for an unknown name."""
        newest = self.models.get(name)
        return (newest, *(m for m in self.older if m.name == name)) if newest else ()

    def restricted_to(self, may_read: Callable[[str], bool]) -> "ModelRegistry":
        """Return the library reduced to the names for which `may_read` is true."""
        models = {name: model for name, model in self.models.items() if may_read(name)}
        return ModelRegistry(models, tuple(model for model in self.older if may_read(model.name)))

    @property
    def identities(self) -> tuple[str, ...]:
        """Identities of the newest models, then of the older ones."""
        return tuple(model.identity for model in chain(self.models.values(), self.older))

    @cached_property
    def _by_key(self) -> dict[str, Synthesizer]:
        every = chain(self.models.values(), self.older)
        return {**self.models, **{model.identity: model for model in every}}


@dataclass(frozen=True)
class VersionLimits:
    """Limits on older versions.

    older: versions of a name beside the newest. memory: bytes of all older versions together.
    """

    older: int = 2
    memory: int = 64 << 20


def load(places: Iterable[str | Path]) -> ModelRegistry:
    """Return the library of .onnx files, folders of them and URLs of object stores.

    It has the newest version of each name; the name is the file's stem or the folder of the
    versions. Raises ModelError for a place without a model, a file that cannot be served, a name
    that cannot stand in a URL, and two places with one name.
    """
    intake = ModelLoader(places, most=1)
    intake.scan()
    intake.check()
    return ModelRegistry({name: versions[0] for name, versions in intake.versions().items()})


def merge_versions(
    declared: Mapping[str, Sequence[Synthesizer]], before: ModelRegistry, bounds: VersionLimits
) -> ModelRegistry:
    """Return the library of the versions declared now, and of older ones within the bounds.

    declared: versions by name, the newest first. Versions of `before` rank ahead of those that
    never answered; the versions that rank furthest from the newest are dropped first.
    """
    models: dict[str, Synthesizer] = {}
    ranked: list[tuple[int, Synthesizer]] = []
    for name, versions in declared.items():
        by_rank = versions[0], *before.versions(name), *versions[1:]
        every = {model.identity: model for model in by_rank}
        models[name], *rest = every.values()
        ranked += enumerate(rest[: bounds.older])
    ranked.sort(key=lambda entry: entry[0])
    taken = accumulate(model.session.memory for _, model in ranked)
    fits = takewhile(lambda entry: entry[1] <= bounds.memory, zip(ranked, taken, strict=True))
    return ModelRegistry(models, tuple(model for (_, model), _ in fits))


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
        found = merge_versions(self._loader.versions(), self.registry, self._bounds)
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


SHIPPED_FOLDER = Path(__file__).parents[1] / "shipped"
"""Folder of the shipped model files; in order of their names, so that the walk is the first."""
NOTICE = SHIPPED_FOLDER / "NOTICE"
"""File with the origin and the licence of each shipped model."""


def or_shipped(places: Sequence[str]) -> list[str]:
    """Return the places of models as given; for none, the folder of the shipped models."""
    return list(places) or [str(SHIPPED_FOLDER)]


def file_or_shipped(path: Path) -> Path:
    """Return the path of a model file, or that of the shipped model of this name.

    Raises ModelError for a name without a file: a path without a suffix and a folder.
    """
    if path.exists() or path.suffix or path.name != str(path):
        return path
    names = sorted(file.stem for file in SHIPPED_FOLDER.glob("*.onnx"))
    if path.name in names:
        return SHIPPED_FOLDER / f"{path.name}.onnx"
    known = ", ".join(names) + did_you_mean(path.name, names)
    raise ModelError(path, f"no such file, expected one or a shipped model: {known}")


def with_shipped(places: Sequence[Path]) -> ModelRegistry:
    """Return the shipped models and those of files and folders, which win where names are equal."""
    shipped = load([SHIPPED_FOLDER])
    given = load(places).models if places else {}
    return ModelRegistry({**shipped.models, **given})
