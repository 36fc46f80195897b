"""When a question is asked again: every one may be, for none changes anything."""

import random
from collections.abc import Callable
from dataclasses import dataclass

from posefield_client.errors import PosefieldError


@dataclass(frozen=True)
class Retry:
    """Exponential backoff with full jitter, within limits.

    attempts: how often a question is asked at most; first: seconds that the first wait is at most,
    each further one twice that, up to `longest`; patience: seconds since the question was first
    asked after which it is not asked again. Where the service says Retry-After it is not asked
    before, however long that is; where it would end patience, not at all.
    """

    attempts: int = 5
    first: float = 0.2
    longest: float = 10.0
    patience: float = 60.0
    chance: Callable[[], float] = random.random

    def wait(self, asked: int, fault: PosefieldError, elapsed: float) -> float | None:
        """Seconds to wait after so many attempts that took so long; None: give up."""
        told = fault.retry_after or 0.0
        if not fault.again or asked >= self.attempts:
            return None
        seconds = told + min(self.longest, self.first * 2.0 ** min(asked - 1, 64)) * self.chance()
        return seconds if elapsed + seconds <= self.patience else None


NEVER = Retry(attempts=1)
"""Ask once."""
