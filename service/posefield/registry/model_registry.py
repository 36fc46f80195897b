"""Models that a service answers for: a registry, replaced as a whole as its sources change.

New files are opened and checked while the present models answer, then the registry is replaced in
one step. The models that ship with the package are served where no other model is named.
"""

import logging
import re
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from itertools import accumulate, chain, takewhile
from pathlib import Path
from typing import Protocol
from urllib.parse import urlsplit
from weakref import WeakValueDictionary

from posefield.common.errors import ModelError, UnknownModel, did_you_mean
from posefield.inference import session
from posefield.inference.onnx_runtime import first_line
from posefield.inference.trial_process import DEFAULT_LIMITS, TrialLimits
from posefield.model_file import checked_file
from posefield.registry import model_sources
from posefield.registry.model_sources import URL, ModelFile, Source
from posefield.synthesis.synthesizer import Synthesizer

log = logging.getLogger(__name__)

NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}")
SETTLE_SECONDS = 0.5
"""Seconds until a changing file is looked at again."""
SHIPPED_FOLDER = Path(__file__).parents[1] / "shipped"
"""Folder of the shipped model files; in order of their names, so that the walk is the first."""
NOTICE = SHIPPED_FOLDER / "NOTICE"
"""File with the origin and the licence of each shipped model."""


@dataclass(frozen=True)
class ModelRegistry:
    """Models of a service by name, and older versions.

    models: the newest model of each name. older: versions that still answer under name@contenthash,
    those of one name from newer to older.
    """

    models: Mapping[str, Synthesizer]
    older: tuple[Synthesizer, ...] = ()

    def find(self, key: str) -> Synthesizer:
        """Return the newest model of a name, or the model of a name@contenthash.

        Raises UnknownModel, with the available identities, for any other key.
        """
        newest = self.models.get(key)
        if newest is not None:
            return newest
        name = key.partition("@")[0]
        versions = self.versions(name)
        for model in versions:
            if model.identity == key:
                return model
        identities = ", ".join(model.identity for model in versions or self.models.values())
        hint = "" if versions else did_you_mean(name, self.models)
        raise UnknownModel("model", f"no model {key!r}{hint}; there are {identities}")

    def versions(self, name: str) -> tuple[Synthesizer, ...]:
        """Return all versions of a name, the newest first; empty for an unknown name."""
        newest = self.models.get(name)
        return (newest, *(m for m in self.older if m.name == name)) if newest else ()

    def restricted_to(self, may_read: Callable[[str], bool]) -> "ModelRegistry":
        """Return the registry reduced to the names for which `may_read` is true."""
        models = {name: model for name, model in self.models.items() if may_read(name)}
        return ModelRegistry(models, tuple(model for model in self.older if may_read(model.name)))

    @property
    def identities(self) -> tuple[str, ...]:
        """Identities of the newest models, then of the older ones."""
        return tuple(model.identity for model in chain(self.models.values(), self.older))


@dataclass(frozen=True)
class VersionLimits:
    """Limits on older versions.

    older: versions of a name beside the newest. memory: bytes of all older versions together.
    """

    older: int = 2
    memory: int = 64 << 20


@dataclass(frozen=True)
class LoadFailure:
    """Reason for which a model file, or a source (name is empty), cannot be used."""

    name: str
    version: str
    error: ModelError


def open_model(
    name: str,
    location: str | Path,
    content: bytes,
    limits: TrialLimits = DEFAULT_LIMITS,
) -> Synthesizer:
    """Return the model of a file that has been read.

    Raises ModelError for a file that cannot be served and a name that cannot stand in a URL.
    """
    if not NAME.fullmatch(name):
        raise ModelError(location, f"name {name!r}, expected {NAME.pattern}")
    return Synthesizer(name, session.load_bytes(content, str(location), limits))


def open_source(location: str | Path) -> Source:
    """Return the source of a path, a file:/// URL or, through obstore, an object store's URL."""
    text = str(location)
    if URL.match(text) and urlsplit(text).scheme != "file":
        # Imported here because obstore is an optional extra.
        from posefield.registry.object_store import ObjectStoreSource

        return ObjectStoreSource(text)
    return model_sources.path_source(location)


class ModelLoader:
    """Usable models of the sources, and faults of the other files.

    A new or changed file is opened when two consecutive looks find the same signature, and a
    missing file's model is removed when two looks miss it: the file may be half copied, or about to
    be replaced. A file that cannot be used leaves the previous model of its location, and is
    retried only after it changes; other files are not affected. The first look opens every file at
    once. faults: by location, as of the last look. opened, failed: counts since the start; a fault
    that stays counts once.
    """

    def __init__(
        self,
        locations: Iterable[str | Path],
        versions: int,
        limits: TrialLimits = DEFAULT_LIMITS,
    ) -> None:
        """Prepare to look at files, folders and URLs.

        versions: largest number of versions of a name that are open, the newest. limits: of each
        file's trial.
        """
        self._limits = limits
        self._sources = {str(location): open_source(location) for location in locations}
        self._newest = versions
        self._listed: dict[str, list[ModelFile]] = {}
        self._signatures: dict[str, str] | None = None
        self._read: dict[str, str] = {}
        self._models: dict[str, tuple[ModelFile, Synthesizer]] = {}
        self._released: set[str] = set()
        self._alive: WeakValueDictionary[str, Synthesizer] = WeakValueDictionary()
        self._previous: dict[str, LoadFailure] = {}
        self.faults: dict[str, LoadFailure] = {}
        self.opened = self.failed = 0

    def scan(self) -> bool:
        """Update the models from the sources; return False while a file is changing."""
        self._previous, self.faults = self.faults, {}
        names = self._files_to_open()
        changing = self._changing()
        for versions in names:
            for file in versions:
                if file.location not in changing and self._is_due(file, versions):
                    self._open_or_record(file)
                elif file.location in self._previous:
                    self.faults[file.location] = self._previous[file.location]
        present = {file.location for versions in names for file in versions}
        for location in self._read.keys() - present - changing:
            self._models.pop(location, None)
            self._released.discard(location)
            del self._read[location]
        return not changing

    def release(self, identities: Collection[str]) -> None:
        """Release all models except those with these identities."""
        for location, (_, model) in [*self._models.items()]:
            if model.identity not in identities:
                del self._models[location]
                self._released.add(location)

    def versions(self) -> dict[str, list[Synthesizer]]:
        """Return models by name, the newest version of each first."""
        grouped = model_sources.group_by_name(file for file, _ in self._models.values())
        return {
            name: [self._models[file.location][1] for file in files]
            for name, files in grouped.items()
        }

    def check(self) -> None:
        """Raise the error of the first fault, if there is one."""
        for fault in self.faults.values():
            raise fault.error

    def _is_due(self, file: ModelFile, versions: list[ModelFile]) -> bool:
        """Return whether to read a file: new, changed, or released and now the newest."""
        if self._read.get(file.location) != file.signature:
            return True
        opened = self._models.keys() | self._released
        newest = next((other for other in versions if other.location in opened), file)
        return file.location in self._released and newest.location == file.location

    def _files_to_open(self) -> list[list[ModelFile]]:
        """Return the files to keep open: the newest few of each name, the newest first."""
        owners: dict[str, tuple[str, bool]] = {}
        names = []
        for location, source in self._sources.items():
            with self._recording_failures(location, "", ""):
                self._listed[location] = source()
            # Those of the last look if this one failed.
            files = self._listed.get(location, [])
            for name, versions in model_sources.group_by_name(files).items():
                # A file NAME.onnx and a folder NAME of versions count as two locations.
                owner = owners.setdefault(name, (location, versions[0].version == ""))
                owned = [file for file in versions if (location, file.version == "") == owner]
                for file in versions:
                    if file not in owned:
                        error = ModelError(file.location, f"a second model named {name!r}")
                        self._record_failure(file.location, LoadFailure(name, file.version, error))
                names.append(owned[: self._newest])
        return names

    def _changing(self) -> set[str]:
        """Return the locations whose signature differs from the previous look."""
        now = {file.location: file.signature for files in self._listed.values() for file in files}
        before = now if self._signatures is None else self._signatures
        self._signatures = now
        return {path for path in now.keys() | before.keys() if now.get(path) != before.get(path)}

    def _open_or_record(self, file: ModelFile) -> None:
        """Open a file, or record the fault that prevents it."""
        with self._recording_failures(file.location, file.name, file.version):
            content = file.read()
            # A file that could be read but not used is retried only after it changes.
            self._read[file.location] = file.signature
            try:
                self._models[file.location] = file, self._open_model(file, content)
            except OSError as error:
                # The child process failed, not the file: the next look tries again.
                del self._read[file.location]
                reason = f"no process to try it in: {error.strerror}"
                raise ModelError(file.location, reason) from error
            self._released.discard(file.location)

    def _open_model(self, file: ModelFile, content: bytes) -> Synthesizer:
        """Return the model with this content; an open one is reused."""
        identity = f"{file.name}@{checked_file.digest(content)}"
        model = self._alive.get(identity)
        if model is None:
            model = open_model(file.name, file.location, content, self._limits)
            self._alive[identity] = model
            self.opened += 1
        return model

    @contextmanager
    def _recording_failures(self, location: str, name: str, version: str) -> Iterator[None]:
        """Record any error as a fault of the location, so that other locations are processed."""
        try:
            yield
        except ModelError as error:
            self._record_failure(location, LoadFailure(name, version, error))
        except Exception as error:
            if location not in self._previous:
                log.exception("%s: an error that no check foresees", location)
            message = f"cannot be used: {type(error).__name__}: {first_line(error)}"
            failure = LoadFailure(name, version, ModelError(location, message))
            self._record_failure(location, failure)

    def _record_failure(self, location: str, failure: LoadFailure) -> None:
        self.faults[location] = failure
        before = self._previous.get(location)
        if before is None or str(before.error) != str(failure.error):
            self.failed += 1


def load(locations: Iterable[str | Path]) -> ModelRegistry:
    """Return the registry of .onnx files, folders of them and URLs of object stores.

    It has the newest version of each name; the name is the file's stem or the folder of the
    versions. Raises ModelError for a location without a model, a file that cannot be served, a name
    that cannot stand in a URL, and two locations with one name.
    """
    loader = ModelLoader(locations, versions=1)
    loader.scan()
    loader.check()
    return ModelRegistry({name: versions[0] for name, versions in loader.versions().items()})


def merge_versions(
    declared: Mapping[str, Sequence[Synthesizer]], before: ModelRegistry, bounds: VersionLimits
) -> ModelRegistry:
    """Return the registry of the versions declared now, and of older ones within the bounds.

    declared: versions by name, the newest first. Versions of `before` rank ahead of those that
    never answered; the versions that rank furthest from the newest are dropped first.
    """
    models: dict[str, Synthesizer] = {}
    ranked: list[tuple[int, Synthesizer]] = []
    for name, versions in declared.items():
        by_rank = versions[0], *before.versions(name), *versions[1:]
        models[name], *rest = {model.identity: model for model in by_rank}.values()
        ranked += enumerate(rest[: bounds.older])
    ranked.sort(key=lambda entry: entry[0])
    memory = accumulate(model.session.memory for _, model in ranked)
    fitting = takewhile(lambda entry: entry[1] <= bounds.memory, zip(ranked, memory, strict=True))
    return ModelRegistry(models, tuple(model for (_, model), _ in fitting))


@dataclass(frozen=True)
class ReloadStatistics:
    """Statistics of looking at the sources.

    looks: number of looks. opened, failed: versions opened and failed attempts since the start.
    faults: present faults. changed: time of the last change of the registry, seconds since 1970.
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
        """Current registry."""

    @property
    def reloads(self) -> ReloadStatistics:
        """Statistics of looking at the sources."""


class FixedRegistry:
    """Models that are never replaced."""

    reloads = ReloadStatistics()

    def __init__(self, registry: ModelRegistry) -> None:
        self.registry = registry


class ReloadingRegistry:
    """Models of locations; `registry` is their state at the last look.

    A file that cannot be used, and a source that cannot be reached or contains no model, leave the
    models as they were. A name that its source no longer lists is removed with all its versions; a
    version that its source no longer lists becomes an older one.
    """

    def __init__(
        self,
        locations: Iterable[str | Path],
        bounds: VersionLimits,
        limits: TrialLimits = DEFAULT_LIMITS,
    ) -> None:
        """Open everything that can be opened within the limits; `check` raises the first fault."""
        self.registry = ModelRegistry({})
        self.reloads = ReloadStatistics()
        self._bounds = bounds
        self._loader = ModelLoader(locations, 1 + bounds.older, limits)
        self._logged: set[str] = set()
        self._refresh()

    def check(self) -> None:
        """Raise ModelError for the first location that could not be opened."""
        self._loader.check()

    def scan(self) -> bool:
        """Update the library from the sources, and log each new fault.

        Returns False while a file is changing, so that another look must follow. Not thread-safe.
        """
        settled = self._refresh()
        messages = {str(fault.error) for fault in self.reloads.faults}
        for message in sorted(messages - self._logged):
            log.warning("%s", message)
        self._logged = messages
        return settled

    def _refresh(self) -> bool:
        before, loader = self.reloads, self._loader
        settled = loader.scan()
        registry = merge_versions(loader.versions(), self.registry, self._bounds)
        loader.release(registry.identities)
        if changed := registry.identities != self.registry.identities:
            self.registry = registry
        faults = tuple(loader.faults.values())
        self.reloads = ReloadStatistics(
            before.looks + 1,
            loader.opened,
            loader.failed,
            faults,
            time.time() if changed else before.changed,
            str(faults[-1].error) if faults else before.last_error,
        )
        return settled

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
        # Aligned to the clock, so that several processes look at the same moment and agree on the
        # newest.
        while not ended.wait(
            seconds - time.time() % seconds if settled else min(seconds, SETTLE_SECONDS)
        ):
            try:
                settled = self.scan()
            except Exception:
                log.exception("looking for models failed")


def or_shipped(locations: Sequence[str]) -> list[str]:
    """Return the locations of models as given; for none, the folder of the shipped models."""
    return list(locations) or [str(SHIPPED_FOLDER)]


def file_or_shipped(path: Path) -> Path:
    """Return the path of a model file, or that of the shipped model of this name.

    Raises ModelError for a name without a file: a path without a suffix and a folder.
    """
    if path.exists() or path.suffix or path.name != str(path):
        return path
    names = sorted(file.stem for file in SHIPPED_FOLDER.glob("*.onnx"))
    if path.name in names:
        return SHIPPED_FOLDER / f"{path.name}.onnx"
    expected = ", ".join(names) + did_you_mean(path.name, names)
    raise ModelError(path, f"no such file, expected one or a shipped model: {expected}")


@cache
def shipped_model(name: str) -> Synthesizer:
    """Return a shipped model, which a process opens once; KeyError for an unknown name."""
    file = SHIPPED_FOLDER / f"{name}.onnx"
    if not NAME.fullmatch(name) or not file.exists():
        raise KeyError(name)
    return load([file]).models[name]


class ShippedModels(Mapping[str, Synthesizer]):
    """The shipped models, each opened when it is first asked for, and others beside them."""

    def __init__(self, others: Mapping[str, Synthesizer]) -> None:
        """others: by name; they win where names are equal."""
        self._others = others

    def __getitem__(self, name: str) -> Synthesizer:
        return self._others[name] if name in self._others else shipped_model(name)

    def __iter__(self) -> Iterator[str]:
        shipped = (file.stem for file in sorted(SHIPPED_FOLDER.glob("*.onnx")))
        return iter(dict.fromkeys(chain(shipped, self._others)))

    def __len__(self) -> int:
        return sum(1 for _ in self)


def with_shipped(paths: Sequence[Path]) -> ModelRegistry:
    """Return the shipped models and those of files and folders, which win where names are equal."""
    return ModelRegistry(ShippedModels(load(paths).models if paths else {}))
