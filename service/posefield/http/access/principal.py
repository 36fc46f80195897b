"""Principals: authenticated clients and their permissions."""

from collections.abc import Iterable
from dataclasses import dataclass

from posefield.registry.model_loading import NAME

READ = "read"
METRICS = "metrics"
_ALL = f"{READ}:*"


class InvalidCredentials(Exception):
    """Error of invalid credentials; the message gives the reason and quotes no credentials."""


@dataclass(frozen=True)
class Principal:
    """A client and its permissions.

    name: in logs. models: names of the models it may read, None for all. metrics: it may read the
    metrics.
    """

    name: str
    models: frozenset[str] | None
    metrics: bool

    def may_read(self, model: str) -> bool:
        """Return True if the principal may read the model of that name."""
        return self.models is None or model in self.models

    def may(self, scope: str) -> bool:
        """Return True if the principal has the scope, READ (for at least one model) or METRICS."""
        return self.metrics if scope == METRICS else self.models is None or bool(self.models)


EVERYONE = Principal("everyone", None, True)
"""Principal of every request to a service without keys and tokens."""

NO_ACCESS = Principal("nobody", frozenset(), False)
"""Principal of a request without credentials."""


def from_scopes(name: str, scopes: Iterable[str]) -> Principal:
    """Return the principal of scopes `read:*`, `read:MODEL` and `metrics`; ignore others."""
    given = frozenset(scopes)
    models = frozenset(s.removeprefix(f"{READ}:") for s in given if s.startswith(f"{READ}:"))
    return Principal(name, None if _ALL in given else models, METRICS in given)


def is_scope(text: str) -> bool:
    """Return True for a valid scope of this service."""
    kind, _, model = text.partition(":")
    return text in (METRICS, _ALL) or (kind == READ and NAME.fullmatch(model) is not None)
