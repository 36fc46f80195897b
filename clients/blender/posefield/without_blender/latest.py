"""A thread that answers the newest question only: whoever drags a slider cares for no other."""

import threading
from collections.abc import Callable
from typing import Any


class Latest:
    """Asks one question at a time, and next the newest of those that came meanwhile.

    answer: called in the thread; what it gives or raises is kept until `take`.
    """

    def __init__(self, answer: Callable[[Any], Any]) -> None:
        self._answer = answer
        self._change = threading.Condition()
        self._waiting: list[Any] = []
        self._done: list[Any] = []
        self._asking = self._ended = False
        self._thread = threading.Thread(target=self._run, name="posefield", daemon=True)
        self._thread.start()

    def ask(self, question: Any) -> None:
        """Put a question in the place of the one that waits."""
        with self._change:
            self._waiting = [question]
            self._change.notify_all()

    def take(self) -> list[Any]:
        """The newest answer, or exception, that nobody has taken; empty where there is none."""
        with self._change:
            done, self._done = self._done, []
            return done

    @property
    def busy(self) -> bool:
        """Whether an answer is still to come or to be taken."""
        with self._change:
            return bool(self._waiting or self._asking or self._done)

    def close(self) -> None:
        """End; a question on its way is still asked, and its answer dropped."""
        with self._change:
            self._ended = True
            self._waiting, self._done = [], []
            self._change.notify_all()

    def join(self, seconds: float) -> bool:
        """Whether the thread has ended in time."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (question := self._next()) is not None:
            found = self._tried(question[0])
            with self._change:
                self._asking = False
                self._done = [] if self._ended else [found]

    def _next(self) -> list[Any] | None:
        with self._change:
            self._change.wait_for(lambda: self._waiting or self._ended)
            if self._ended:
                return None
            question, self._waiting = self._waiting, []
            self._asking = True
            return question

    def _tried(self, question: Any) -> Any:
        try:
            return self._answer(question)
        except Exception as fault:
            return fault
