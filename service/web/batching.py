"""Questions for poses that arrive together, answered by one call of the graph.

There is no timer: what has arrived when the event loop turns is asked together. Whoever asks alone
is answered at once.
"""

import asyncio
from asyncio import Future

from service.synthesis import poses
from service.synthesis.poses import Moments, Row
from service.synthesis.synthesizer import Synthesizer
from service.web import metrics

MOST = 64
"""Poses of one call: beyond, a pose costs no less."""

Waiting = list[tuple[Moments, "Future[Row]"]]


class Batcher:
    """What was asked in this turn of an event loop."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[str, int], tuple[Synthesizer, Waiting]] = {}
        self._arrived = self._before = 0

    async def row(self, model: Synthesizer, asked: Moments) -> Row:
        """What the model's graph says to a question; the same bytes whoever else asks."""
        self._arrive()
        if self._before < 2 or len(asked.when) > 1 or not poses.exact(model, asked.level):
            metrics.batched(1)
            return poses.rows(model, [asked])[0]
        return await self._together(model, asked)

    def _arrive(self) -> None:
        """Count the questions of a turn: many in one let expect many in the next."""
        if not self._arrived:
            asyncio.get_running_loop().call_soon(self._turn)
        self._arrived += 1

    def _turn(self) -> None:
        self._before, self._arrived = self._arrived, 0

    def _together(self, model: Synthesizer, asked: Moments) -> "Future[Row]":
        loop = asyncio.get_running_loop()
        if not self._waiting:
            loop.call_soon(self._answer)
        # Two versions of a model may be asked in one turn: each has an identity of its own.
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
