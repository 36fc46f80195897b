"""How fast an export goes, and how long it will take."""

import time
from dataclasses import dataclass, field


@dataclass
class Pace:
    """How fast it goes: of `total` rows, `before` were done when this run began."""

    total: int
    before: int
    done: int = 0
    since: float = field(default_factory=time.monotonic)

    @property
    def rate(self) -> float:
        """Rows a second, in this run."""
        return self.done / max(self.seconds, 1e-9)

    @property
    def seconds(self) -> float:
        """How long it has been going."""
        return time.monotonic() - self.since

    def words(self) -> str:
        """Rate and time left, once there is something to go by."""
        if not self.done:
            return ""
        left = round((self.total - self.before - self.done) / self.rate)
        return f"{self.rate:,.0f} a second, {left // 60}:{left % 60:02d} left"
