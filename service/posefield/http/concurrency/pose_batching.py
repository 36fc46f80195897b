"""Batching of concurrent pose requests into one inference call.

There is no timer: a batch holds the requests of one iteration of the event loop. A single request
is evaluated immediately.
"""

import asyncio
from asyncio import Future

from posefield.http.telemetry import metrics
from posefield.synthesis import poses
from posefield.synthesis.poses import OutputRow, PreparedPoseQuestion
from posefield.synthesis.synthesizer import Synthesizer

MAX_BATCH = 64
"""Maximum size of a batch: larger ones do not reduce the cost per pose."""

PendingPoses = list[tuple[PreparedPoseQuestion, "Future[OutputRow]"]]


class PoseBatcher:
    """Batches of the current iteration of an event loop."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[str, int], tuple[Synthesizer, PendingPoses]] = {}
        self._arrived = self._previous = 0

    async def row(self, model: Synthesizer, asked: PreparedPoseQuestion) -> OutputRow:
        """Return the graph's output for a question; the batch does not affect its bytes.

        A question is batched if it is for one time, the model's level is exact in batches, and the
        previous iteration had at least two questions.
        """
        self._count_arrival()
        if (
            self._previous < 2
            or len(asked.when) > 1
            or not poses.is_batch_exact(model, asked.level)
        ):
            metrics.count_inference(1)
            return poses.run_batch(model, [asked])[0]
        return await self._enqueue(model, asked)

    def _count_arrival(self) -> None:
        """Count the questions of an iteration, which predict the number in the next one."""
        if not self._arrived:
            asyncio.get_running_loop().call_soon(self._end_iteration)
        self._arrived += 1

    def _end_iteration(self) -> None:
        self._previous, self._arrived = self._arrived, 0

    def _enqueue(self, model: Synthesizer, asked: PreparedPoseQuestion) -> "Future[OutputRow]":
        loop = asyncio.get_running_loop()
        if not self._waiting:
            loop.call_soon(self._evaluate_batches)
        # Keyed by identity: requests may be for two versions of a model at the same time.
        key = model.identity, asked.level
        future: Future[OutputRow] = loop.create_future()
        self._waiting.setdefault(key, (model, []))[1].append((asked, future))
        return future

    def _evaluate_batches(self) -> None:
        waiting, self._waiting = self._waiting, {}
        for model, own in waiting.values():
            for first in range(0, len(own), MAX_BATCH):
                _evaluate_batch(model, own[first : first + MAX_BATCH])


def _evaluate_batch(model: Synthesizer, own: PendingPoses) -> None:
    metrics.count_inference(len(own))
    try:
        rows = poses.run_batch(model, [asked for asked, _ in own])
    except Exception as fault:
        for _, future in own:
            if not future.done():
                future.set_exception(fault)
        return
    for (_, future), row in zip(own, rows, strict=True):
        if not future.done():
            future.set_result(row)
