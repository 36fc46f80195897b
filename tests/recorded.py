"""Models whose onnxruntime sessions record their calls."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from posefield.inference.session import Session

Feed = dict[str, Any]


@dataclass
class Runtime:
    """A session of onnxruntime, the feeds of its calls, and a check that may refuse one."""

    real: Any
    calls: list[Feed] = field(default_factory=list)
    check: Callable[[Feed], None] = lambda feed: None

    def run(self, outputs: list[str], feed: Feed) -> list[Any]:
        """Note the feed, check it, and answer as the real one."""
        self.calls.append(feed)
        self.check(feed)
        return self.real.run(outputs, feed)


def session(
    opened: Session, check: Callable[[Feed], None] = lambda feed: None
) -> tuple[Session, list[Feed]]:
    """Return the session with every graph recorded, and the list that the feeds are added to."""
    calls: list[Feed] = []

    def recorded(runtimes: Sequence[Any]) -> tuple[Runtime, ...]:
        return tuple(Runtime(runtime, calls, check) for runtime in runtimes)

    graphs = ("runtimes", "duration_sessions", "sigma_sessions", "state_sessions")
    return replace(opened, **{name: recorded(getattr(opened, name)) for name in graphs}), calls
