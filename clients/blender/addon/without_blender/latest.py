"""Thread that processes only the newest question, as a moving slider makes others obsolete."""

import threading
from collections.abc import Callable
from typing import Any


class Latest:
    """Thread that processes one question at a time, and next the newest one received meanwhile.

    answer: called in the thread; its result or exception is stored until `take`.
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
        """Replace the waiting question."""
        with self._change:
            self._waiting = [question]
            self._change.notify_all()

    def take(self) -> list[Any]:
        """Return the newest result or exception that was not taken yet; empty if there is none."""
        with self._change:
            done, self._done = self._done, []
            return done

    @property
    def busy(self) -> bool:
        """Return True while a result is pending or not taken."""
        with self._change:
            return bool(self._waiting or self._asking or self._done)

    def close(self) -> None:
        """End the thread; the result of a running question is dropped."""
        with self._change:
            self._ended = True
            self._waiting, self._done = [], []
            self._change.notify_all()

    def join(self, seconds: float) -> bool:
        """Return True if the thread ended within some seconds."""
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
