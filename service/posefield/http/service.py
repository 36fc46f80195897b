"""State that the handlers of all operations share."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from posefield.characters.user_character import EMPTY, CharacterFolder
from posefield.http.access.access_control import AccessPolicy
from posefield.http.api.settings import Settings
from posefield.http.concurrency.clip_batching import ClipBatcher
from posefield.http.concurrency.pose_batching import PoseBatcher
from posefield.http.concurrency.readiness import Readiness
from posefield.http.decoding.request_body import BodyMemory
from posefield.http.middleware import caching
from posefield.http.pages.static_page import StaticPage
from posefield.http.telemetry.telemetry import NO_TELEMETRY, Telemetry
from posefield.registry.model_registry import ModelRegistry


@dataclass(frozen=True)
class Service:
    """Shared state of all operations.

    contract: version of the contract. pages: by operationId. rules: access policy. origins: for
    CORS. telling: log and traces. code: digest for entity tags. batcher: of pose requests. desk: of
    file requests. characters: of users.
    """

    readiness: Readiness
    settings: Settings
    contract: str
    pages: Mapping[str, StaticPage]
    access_policy: AccessPolicy
    origins: frozenset[bytes] = frozenset()
    telling: Telemetry = NO_TELEMETRY
    code: bytes = field(default_factory=caching.code_digest)
    pose_batcher: PoseBatcher = field(default_factory=PoseBatcher)
    clip_batcher: ClipBatcher = field(default_factory=ClipBatcher)
    characters: CharacterFolder = EMPTY

    @cached_property
    def bodies(self) -> BodyMemory:
        """Memory limit on the bodies of open requests."""
        return BodyMemory(self.settings.bodies_memory)

    def lifetime(self, model: str) -> bytes:
        """Return the Cache-Control of a response.

        model: key in the path, a name with or without a hash.
        """
        return caching.cache_control(
            model, self.settings.alias_seconds, self.access_policy.requires_credentials
        )

    @property
    def registry(self) -> ModelRegistry:
        """Current models; a reload can replace them, so read this once per request."""
        return self.readiness.models.registry
