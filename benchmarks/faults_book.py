"""Record of the requests' outcomes, and of those that must never occur."""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field
from time import monotonic

from faults_known import Answer, Known
from faults_wire import Wire

UNAVAILABLE = ("overloaded", "late", "not-ready", "unsaid")
"""Problems that may be answered with 503, as the contract says; an answer to HEAD has no body."""

GONE = (OSError, EOFError, TimeoutError)
"""Errors of a connection that does not answer."""

NOTICED = 5.0
"""Seconds after which a client that shares a busy machine has noticed that a connection broke."""


@dataclass
class Book:
    """right: right answers by status. refused: documented 503 by their problem. faulty: answers to
    clients that broke the rules, by status. away: connections refused while no server ran.
    killed: when a process was killed; broken: connections that this ended. versions: answers under
    a plain name by which version they were of. scene: what began last, and when. wrong: what must
    not be, a line each."""

    right: Counter[int] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    faulty: Counter[str] = field(default_factory=Counter)
    versions: Counter[int] = field(default_factory=Counter)
    killed: list[float] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)
    scene: tuple[float, str] = (0.0, "nothing")
    away: int = 0
    broken: int = 0
    listening: bool = True
    ended: bool = False

    def answered(self, reference: Known, answer: Answer) -> None:
        """Note an answer to a question whose right answers are known."""
        indices = [i for i, right in enumerate(reference.right) if answer.is_like(right)]
        if indices:
            self.right[answer.status] += 1
            if len(reference.right) > 1 and len(indices) == 1:
                self.versions[indices[0]] += 1
        elif not self.is_refusal(answer):
            name = f"{reference.question.method} {reference.model}{reference.question.rest[:60]}"
            expected = " or ".join(f"{a.status} {a.headers.get('etag')}" for a in reference.right)
            answer_text = f"{answer.status} {answer.headers.get('etag')} {answer.body[:200]!r}"
            self.fault(f"{name}: {answer_text}, expected {expected}")

    def is_refusal(self, answer: Answer) -> bool:
        """Note a documented 503, or say that it is none."""
        kind = (answer.problem or "").rpartition(":")[2]
        if answer.status != 503 or kind not in UNAVAILABLE:
            return False
        self.refused[kind] += 1
        return True

    def allowed(self, what: str, answer: Answer, statuses: Collection[int]) -> None:
        """Note an answer to a request that breaks the rules."""
        self.faulty[f"{what} {answer.status}"] += 1
        if answer.status in statuses or self.is_refusal(answer):
            # What is not HTTP is answered by the server itself, in plain text.
            if answer.status <= 400 or answer.problem:
                return
        self.fault(f"{what}: {answer.status} {answer.body[:200]!r}, expected {statuses}")

    def unanswered(self, wire: Wire, what: str, reason: BaseException) -> None:
        """Note a request of a well-behaved client that was sent and not answered."""
        now = monotonic()
        if any(wire.opened_at < when and now < when + NOTICED for when in self.killed):
            self.broken += 1
        else:
            self.fault(f"{what}: not answered, {reason!r}")

    def turned_away(self, reason: BaseException) -> None:
        """Note a connection that was refused."""
        self.away += 1
        if self.listening:
            self.fault(f"no connection, {reason!r}")

    def fault(self, line: str) -> None:
        """Note what must not be."""
        when, scene = self.scene
        self.wrong.append(f"{line}; {monotonic() - when:.2f} s after {scene} began")
