"""Whoever asks, and what they may do."""

from collections.abc import Iterable
from dataclasses import dataclass

from service.synthesis.intake import NAME

READ = "read"
METRICS = "metrics"
_ALL = f"{READ}:*"


@dataclass(frozen=True)
class Principal:
    """Someone who asks: `models` are the names of those they may read, None for all."""

    name: str
    models: frozenset[str] | None
    metrics: bool

    def may_read(self, model: str) -> bool:
        """Whether a model of that name exists for them."""
        return self.models is None or model in self.models

    def may(self, scope: str) -> bool:
        """Whether they may ask for anything at all of a scope, READ or METRICS."""
        return self.metrics if scope == METRICS else self.models is None or bool(self.models)


EVERYONE = Principal("everyone", None, True)
"""Whoever asks a service that knows no keys."""

NOBODY = Principal("nobody", frozenset(), False)
"""Whoever has not said who they are."""


def of(name: str, scopes: Iterable[str]) -> Principal:
    """Principal of scopes `read:*`, `read:MODEL` and `metrics`; others mean nothing here."""
    given = frozenset(scopes)
    models = frozenset(s.removeprefix(f"{READ}:") for s in given if s.startswith(f"{READ}:"))
    return Principal(name, None if _ALL in given else models, METRICS in given)


def is_scope(text: str) -> bool:
    """Whether a word is a scope of this service."""
    kind, _, model = text.partition(":")
    return text in (METRICS, _ALL) or (kind == READ and NAME.fullmatch(model) is not None)
