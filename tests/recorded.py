"""Models whose graphs record their calls."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from posefield.inference.session import Graph, Session

Feed = dict[str, Any]


@dataclass
class RecordedGraph:
    """A graph, the feeds of its calls, and a check that may refuse one."""

    real: Graph
    calls: list[Feed] = field(default_factory=list)
    check: Callable[[Feed], None] = lambda feed: None

    def run(self, values: Sequence[str], feed: Feed, level: int) -> list[Any]:
        """Note the feed, check it, and answer as the real one."""
        self.calls.append(feed)
        self.check(feed)
        return self.real.run(values, feed, level)


def session(
    opened: Session, check: Callable[[Feed], None] = lambda feed: None
) -> tuple[Session, list[Feed]]:
    """Return the session with its graph recorded, and the list that the feeds are added to."""
    graph = RecordedGraph(opened.graph, check=check)
    return replace(opened, graph=graph), graph.calls
