"""Readiness: the models give the same output as when opened, and the process is not draining.

A new model file that cannot be used is reported and does not affect readiness: the previous version
stays in service.
"""

import time
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

from posefield.http.api import problems
from posefield.http.api.problems import RequestError
from posefield.registry.model_registry import (
    LoadFailure,
    ModelRegistry,
    RegistryProvider,
)
from posefield.synthesis.synthesizer import Synthesizer

TEST_LIFETIME = 1.0
"""Lifetime of a cached test of the models, s."""


class Readiness:
    """Readiness of the service.

    It tests the newest model of each name: the output for the trial question must equal, byte for
    byte, that of the opening of the model. draining: the process is shutting down.
    """

    def __init__(self, models: RegistryProvider) -> None:
        self.models = models
        self.draining = False
        self._last_test: tuple[ModelRegistry, float] | None = None
        self._changed_models: list[str] = []

    def document(self, may_read: Callable[[str], bool]) -> dict[str, Any]:
        """Return the status, the models in service and the facts of reloads.

        may_read: filter on the names of models. Raises RequestError 503 when not ready.
        """
        library = self.models.registry
        if self.draining:
            raise RequestError(problems.NOT_READY, "the service is ending")
        if not library.models:
            raise RequestError(problems.NOT_READY, "there is no model")
        if wrong := self._tested(library):
            names = ", ".join(name for name in wrong if may_read(name.partition("@")[0]))
            detail = f"not as when opened answers {names or 'a model'}"
            raise RequestError(problems.NOT_READY, detail)
        reloads = self.models.reloads
        changed = datetime.fromtimestamp(reloads.changed, UTC).isoformat(timespec="seconds")
        return {
            "status": "ready",
            "models": [m.identity for m in library.models.values() if may_read(m.name)],
            "reload": {
                "looks": reloads.looks,
                "opened": reloads.opened,
                "failed": reloads.failed,
                "changed": changed,
                "faults": [_fault_facts(fault) for fault in reloads.faults if may_read(fault.name)],
            },
        }

    def _tested(self, library: ModelRegistry) -> list[str]:
        """Return the identities of the models whose output has changed."""
        now = time.monotonic()
        if (
            self._last_test is None
            or self._last_test[0] is not library
            or now > self._last_test[1] + TEST_LIFETIME
        ):
            self._changed_models = [
                m.identity for m in library.models.values() if not _gives_trial_output(m)
            ]
            self._last_test = library, now
        return self._changed_models


def _gives_trial_output(model: Synthesizer) -> bool:
    try:
        return model.session.run_trial() == model.session.golden
    except Exception:  # onnxruntime's exceptions share no base of their own
        return False


def _fault_facts(fault: LoadFailure) -> dict[str, str]:
    # The text after a colon comes from libraries and may contain paths: it is only logged.
    detail = fault.error.message.partition(": ")[0]
    return {"model": fault.name, "version": fault.version, "detail": detail}
