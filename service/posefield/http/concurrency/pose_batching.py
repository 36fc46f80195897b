"""Batching of concurrent pose requests into one inference call.

There is no timer: a batch holds the requests of one iteration of the event loop. A single request
is evaluated immediately.
"""

import asyncio
from asyncio import Future

from posefield.http.telemetry import metrics
from posefield.synthesis import poses
from posefield.synthesis.poses import Moments, Row
from posefield.synthesis.synthesizer import Synthesizer

MOST = 64
"""Maximum size of a batch: larger ones do not reduce the cost per pose."""

Waiting = list[tuple[Moments, "Future[Row]"]]


class Batcher:
    """Batches of the current iteration of an event loop."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[str, int], tuple[Synthesizer, Waiting]] = {}
        self._arrived = self._before = 0

    async def row(self, model: Synthesizer, asked: Moments) -> Row:
        """Return the graph's output for a question; the batch does not affect its bytes.

        A question is batched if it is for one time, the model's level is exact in batches, and the
        previous iteration had at least two questions.
        """
        self._arrive()
        if self._before < 2 or len(asked.when) > 1 or not poses.exact(model, asked.level):
            metrics.batched(1)
            return poses.rows(model, [asked])[0]
        return await self._together(model, asked)

    def _arrive(self) -> None:
        """Count the questions of an iteration, which predict the number in the next one."""
        if not self._arrived:
            asyncio.get_running_loop().call_soon(self._turn)
        self._arrived += 1

    def _turn(self) -> None:
        self._before, self._arrived = self._arrived, 0

    def _together(self, model: Synthesizer, asked: Moments) -> "Future[Row]":
        loop = asyncio.get_running_loop()
        if not self._waiting:
            loop.call_soon(self._answer)
        # Keyed by identity: requests may be for two versions of a model at the same time.
        key = model.identity, asked.level
        future: Future[Row] = loop.create_future()
        self._waiting.setdefault(key, (model, []))[1].append((asked, future))
        return future

    def _answer(self) -> None:
        waiting, self._waiting = self._waiting, {}
        for model, own in waiting.values():
            for first in range(0, len(own), MOST):
                _ask(model, own[first : first + MOST])


def _ask(model: Synthesizer, own: Waiting) -> None:
    metrics.batched(len(own))
    try:
        rows = poses.rows(model, [asked for asked, _ in own])
    except Exception as fault:
        for _, future in own:
            if not future.done():
                future.set_exception(fault)
        return
    for (_, future), row in zip(own, rows, strict=True):
        if not future.done():
            future.set_result(row)
