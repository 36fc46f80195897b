"""Thread that answers only the newest question, as a moving slider makes others obsolete."""

import threading
from collections.abc import Callable
from typing import Any


class Latest:
    """One question at a time is answered in a thread, and next the newest received meanwhile.

    answer: called in a thread; its result or exception is kept until `take`.
    """

    def __init__(self, answer: Callable[[Any], Any]) -> None:
        self._answer = answer
        self._lock = threading.Lock()
        self._waiting: list[Any] = []
        self._done: list[Any] = []
        self._asking = False

    def ask(self, question: Any) -> None:
        """Replace the waiting question."""
        with self._lock:
            self._waiting = [question]
            if not self._asking:
                self._asking = True
                threading.Thread(target=self._run, name="posefield", daemon=True).start()

    def take(self) -> list[Any]:
        """Return the newest result or exception that was not taken yet; empty if there is none."""
        with self._lock:
            done, self._done = self._done, []
            return done

    @property
    def busy(self) -> bool:
        """Return True while a result is pending or not taken."""
        with self._lock:
            return bool(self._waiting or self._asking or self._done)

    def _run(self) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    self._asking = False
                    return
                (question,), self._waiting = self._waiting, []
            try:
                result = self._answer(question)
            except Exception as fault:
                result = fault
            with self._lock:
                self._done = [result]
