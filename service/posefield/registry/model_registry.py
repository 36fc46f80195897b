"""Set of the models that a service answers for; immutable, and replaced as a whole."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, chain, takewhile
from pathlib import Path

from posefield.common.errors import UnknownModel
from posefield.common.name_suggestion import did_you_mean
from posefield.registry.model_loading import ModelLoader
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
