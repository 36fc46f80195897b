"""The models a service answers for: an immutable whole, which another may take the place of."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, chain, takewhile
from pathlib import Path

from service.motion.errors import UnknownModel
from service.synthesis.intake import Intake
from service.synthesis.synthesizer import Synthesizer


@dataclass(frozen=True)
class Library:
    """The newest model of each name, and the older versions that still answer under their hash,
    those of a name from newer to older."""

    models: dict[str, Synthesizer]
    older: tuple[Synthesizer, ...] = ()

    def find(self, key: str) -> Synthesizer:
        """Newest model of a name, or the one of a name@contenthash; UnknownModel if not here."""
        model = self._by_key.get(key)
        if model is None:
            name = key.partition("@")[0]
            near = self.versions(name) or tuple(self._by_key[key] for key in self.models)
            known = ", ".join(m.identity for m in near)
            raise UnknownModel("model", f"no model {key!r}; there are {known}")
        return model

    def versions(self, name: str) -> tuple[Synthesizer, ...]:
        """All versions of a name that are here, the newest first; none for a name unknown."""
        newest = self.models.get(name)
        return (newest, *(m for m in self.older if m.name == name)) if newest else ()

    def of(self, may_read: Callable[[str], bool]) -> "Library":
        """The models of some names alone."""
        models = {name: model for name, model in self.models.items() if may_read(name)}
        return Library(models, tuple(model for model in self.older if may_read(model.name)))

    @property
    def identities(self) -> tuple[str, ...]:
        """Of the newest, and then of the older ones."""
        return tuple(model.identity for model in chain(self.models.values(), self.older))

    @cached_property
    def _by_key(self) -> dict[str, Synthesizer]:
        every = chain(self.models.values(), self.older)
        return {**self.models, **{model.identity: model for model in every}}


@dataclass(frozen=True)
class Bounds:
    """How many older versions of a name are held, and how many bytes all of them may take."""

    older: int = 2
    memory: int = 64 << 20


def load(places: Iterable[str | Path]) -> Library:
    """Library of .onnx files, of folders of them, and of URLs of object stores: the newest version
    of each name, which is the file's stem or the folder that the versions are in.

    Raises ModelError for a place with no model, a file that cannot be served, a name that cannot
    stand in a URL, and two places of one name.
    """
    intake = Intake(places, most=1)
    intake.look()
    intake.check()
    return Library({name: versions[0] for name, versions in intake.versions().items()})


def arranged(
    declared: Mapping[str, Sequence[Synthesizer]], before: Library, bounds: Bounds
) -> Library:
    """Library of the versions that each name has now, the newest first, and of those that answered
    before, as far as the bounds leave room: what has answered stays longest, and what is furthest
    from the newest goes first."""
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
    return Library(models, tuple(model for (_, model), _ in fits))
