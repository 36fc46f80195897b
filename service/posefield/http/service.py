"""State that the handlers of all operations share."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from posefield.http.access.access_policy import Policy
from posefield.http.api.settings import Settings
from posefield.http.concurrency.clip_batching import Desk
from posefield.http.concurrency.pose_batching import Batcher
from posefield.http.decoding.request_body import BodyMemory
from posefield.http.middleware import caching
from posefield.http.pages.static_page import Page
from posefield.http.readiness import Readiness
from posefield.http.telemetry.telemetry import SILENT, Telling
from posefield.registry.model_registry import Library


@dataclass(frozen=True)
class Service:
    """Shared state of all operations.

    contract: version of the contract. pages: by operationId. rules: access policy. origins: for
    CORS. telling: log and traces. code: digest for entity tags. batcher: of pose requests. desk: of
    file requests.
    """

    readiness: Readiness
    settings: Settings
    contract: str
    pages: Mapping[str, Page]
    rules: Policy
    origins: frozenset[bytes] = frozenset()
    telling: Telling = SILENT
    code: bytes = field(default_factory=caching.code)
    batcher: Batcher = field(default_factory=Batcher)
    desk: Desk = field(default_factory=Desk)

    @cached_property
    def bodies(self) -> BodyMemory:
        """Memory limit on the bodies of open requests."""
        return BodyMemory(self.settings.bodies_memory)

    def lifetime(self, model: str) -> bytes:
        """Return the Cache-Control of a response.

        model: key in the path, a name with or without a hash.
        """
        return caching.lifetime(model, self.settings.alias_seconds, self.rules.closed)

    @property
    def library(self) -> Library:
        """Current models; a reload can replace them, so read this once per request."""
        return self.readiness.models.library
