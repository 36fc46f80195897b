"""Retries of requests; all requests are idempotent."""

import random
from collections.abc import Callable
from dataclasses import dataclass

from posefield_client.errors import PosefieldError


@dataclass(frozen=True)
class Retry:
    """Exponential backoff with full jitter.

    attempts: largest number of attempts. first: upper bound of the first wait, s; it doubles with
    each attempt up to `longest`. patience: time limit from the first attempt, s. The wait is added
    to a Retry-After of the service; if it would exceed `patience`, the request fails.
    """

    attempts: int = 5
    first: float = 0.2
    longest: float = 10.0
    patience: float = 60.0
    chance: Callable[[], float] = random.random

    def wait(self, asked: int, fault: PosefieldError, elapsed: float) -> float | None:
        """Return the seconds to wait after an attempt; None to give up.

        asked: number of attempts so far. elapsed: since the first, s.
        """
        told = fault.retry_after or 0.0
        if not fault.again or asked >= self.attempts:
            return None
        seconds = told + min(self.longest, self.first * 2.0 ** min(asked - 1, 64)) * self.chance()
        return seconds if elapsed + seconds <= self.patience else None


NEVER = Retry(attempts=1)
"""One attempt, without retries."""
