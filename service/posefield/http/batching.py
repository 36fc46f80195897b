"""Batching of concurrent requests: poses into one inference call, clips in a thread.

There is no timer. A batch of poses holds the requests of one iteration of the event loop. Clips of
a batch share much of the work, and a thread switch takes a tenth of a millisecond: those that
arrive during a batch form the next one.

Work that takes longer runs in threads of its own, with limits by kind of work, and cancellation.
"""

import asyncio
import logging
import math
import os
from asyncio import Future, Task
from collections.abc import Callable, Hashable, Sequence
from contextlib import suppress
from contextvars import copy_context
from functools import partial
from typing import Any, TypeVar, TypeVarTuple

from anyio import CancelScope, CapacityLimiter, to_thread

from posefield.common import cancellation
from posefield.common.cancellation import Cancellation, Cancelled
from posefield.encode.character import Convention
from posefield.encode.formats import ClipEncoder
from posefield.http import metrics
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import ClipAnswer
from posefield.synthesis import clip_draft, clips, poses
from posefield.synthesis.poses import OutputRow, PreparedPoseQuestion
from posefield.synthesis.synthesizer import Synthesizer

faults = logging.getLogger(__name__)

Result = TypeVar("Result")
Arguments = TypeVarTuple("Arguments")

CORES = os.cpu_count() or 1
HALF = max(1, CORES // 2)
POSE_LIMITER = CapacityLimiter(CORES)
"""Limit on threads for poses that take milliseconds, which wait for no other work."""
SYNTHESIS_LIMITER = CapacityLimiter(HALF)
"""Limit on threads for work of up to tenths of a second: clips with targets or standing feet, long
clips, grids, compression. More threads would delay the event loop and poses several times as long:
each holds Python's lock in turn (decision 0030)."""
PERFORMANCE_LIMITER = CapacityLimiter(HALF)
LONG_LIMITER = CapacityLimiter(1)
CROWD_LIMITER = CapacityLimiter(HALF)
ARCHIVE_LIMITER = CapacityLimiter(CORES)
"""Limits on threads for work of seconds, separate so that other work does not wait for it. Long
performances and those of archives are made one at a time: each may take all memory for answers."""
SWITCH_INTERVAL = 0.001
"""Seconds after which a thread lets others run Python, such as the event loop that answers poses;
Python's default of 5 ms is that long for each thread before it."""

# The limiters above count the threads; anyio's own limit must not apply.
_UNBOUNDED = CapacityLimiter(math.inf)


async def run_in_thread(
    work: Callable[[*Arguments], Result],
    *arguments: *Arguments,
    limiter: CapacityLimiter = SYNTHESIS_LIMITER,
) -> Result:
    """Call `work` in a thread within a limit, and return its result.

    If the awaiting task is cancelled, the work is asked to stop (`posefield.common.cancellation`),
    and counts against the limit until it has stopped.
    """
    async with limiter:
        return await within(work, *arguments)


async def within(work: Callable[[*Arguments], Result], *arguments: *Arguments) -> Result:
    """Call `work` in a thread as `run_in_thread` does, for a caller that holds a place already."""
    flag = Cancellation()
    token = cancellation.current.set(flag)
    try:
        thread = asyncio.ensure_future(to_thread.run_sync(work, *arguments, limiter=_UNBOUNDED))
    finally:
        cancellation.current.reset(token)
    try:
        return await asyncio.shield(thread)
    except asyncio.CancelledError:
        flag.cancel()
        await _wait_until_ended(thread)
        raise


async def _wait_until_ended(thread: "asyncio.Future[Result]") -> None:
    """Wait until a thread has ended, even if the waiting task is cancelled again.

    Log the exception of work that failed for another reason than its cancellation.
    """
    # anyio repeats a cancellation, asyncio delivers it once: the scope shields from the former.
    with CancelScope(shield=True):
        while not thread.done():
            with suppress(asyncio.CancelledError):
                await asyncio.wait({thread})
    fault = thread.exception()
    if fault is not None and not isinstance(fault, Cancelled):
        faults.error("work that no client waits for has failed", exc_info=fault)


MAX_CLIPS = 32
"""Maximum clips of a batch: all of its requests wait for the whole batch, some 15 ms."""

MAX_BATCHED_FRAMES = 1000
"""Maximum frames of a clip in a batch, so that short clips do not wait for long ones."""

Work = Callable[[Sequence[Any]], Sequence[Any]]
"""Work on the items of a batch: returns their results in order, an exception for a failed item."""

Pending = list[tuple[Any, "Future[Any]"]]


EncodedClip = tuple[ClipAnswer, bytes]
"""A clip and its file."""


class ClipBatcher:
    """Queues of clips in an event loop, by the work to be done with them."""

    def __init__(self) -> None:
        self._waiting: dict[Hashable, Pending] = {}
        self._tasks: set[Task[None]] = set()

    async def clip(
        self,
        model: Synthesizer,
        question: ClipQuestion,
        longest: int,
        encoder: ClipEncoder,
        convention: Convention,
    ) -> EncodedClip:
        """Return the clip of a question and its file; the batch does not affect its bytes.

        longest: largest number of frames. Raises as `clips.synthesize_clip` does.
        """
        if encoder.inline_limit:
            answer = clips.synthesize_clip(model, question, longest)
            return answer, await self.file(encoder, convention, answer)
        if clip_draft.largest_frame_count(model, question) > MAX_BATCHED_FRAMES:
            answer = await run_in_thread(clips.synthesize_clip, model, question, longest)
            return answer, await self.file(encoder, convention, answer)
        key = encoder.extension, convention, model.identity, question.level, longest
        work = partial(_encoded_clips, model, longest, encoder, convention)
        clip: EncodedClip = await self._result(key, question, work)
        return clip

    async def file(self, encoder: ClipEncoder, convention: Convention, answer: ClipAnswer) -> bytes:
        """Return the file of an answer; the batch does not affect its bytes."""
        if len(answer.clip) <= encoder.inline_limit:
            return encoder.encode(answer, convention)
        if len(answer.clip) > MAX_BATCHED_FRAMES:
            return await run_in_thread(encoder.encode, answer, convention)

        def work(answers: Sequence[ClipAnswer]) -> list[bytes]:
            return encoder.write(answers, convention)

        content: bytes = await self._result((encoder.extension, convention), answer, work)
        return content

    def _result(self, key: Hashable, item: Any, work: Work) -> "Future[Any]":
        future: Future[Any] = asyncio.get_running_loop().create_future()
        if key not in self._waiting:
            self._waiting[key] = []
            # A batch serves several requests: without the cancellation of one.
            context = copy_context()
            context.run(cancellation.current.set, None)
            task = asyncio.create_task(self._work(key, work), context=context)
            # The event loop keeps only weak references to tasks.
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        self._waiting[key].append((item, future))
        return future

    async def _work(self, key: Hashable, work: Work) -> None:
        while waiting := self._waiting[key]:
            self._waiting[key] = waiting[MAX_CLIPS:]
            batch = [(item, future) for item, future in waiting[:MAX_CLIPS] if not future.done()]
            try:
                items = [item for item, _ in batch]
                results = await to_thread.run_sync(work, items) if batch else []
            except Exception as fault:
                results = [fault] * len(batch)
            for (_, future), result in zip(batch, results, strict=True):
                if future.done():
                    continue
                if isinstance(result, Exception):
                    future.set_exception(result)
                else:
                    future.set_result(result)
        del self._waiting[key]


def _encoded_clips(
    model: Synthesizer,
    longest: int,
    encoder: ClipEncoder,
    convention: Convention,
    questions: Sequence[ClipQuestion],
) -> list[EncodedClip | Exception]:
    answers = clips.synthesize_clips(model, questions, longest)
    clip_answers = [answer for answer in answers if isinstance(answer, ClipAnswer)]
    files = iter(encoder.write(clip_answers, convention))
    return [
        answer if isinstance(answer, Exception) else (answer, next(files)) for answer in answers
    ]


MAX_POSES = 64
"""Maximum size of a batch: larger ones do not reduce the cost per pose."""

PendingPoses = list[tuple[PreparedPoseQuestion, "Future[OutputRow]"]]


class PoseBatcher:
    """Batches of the current iteration of an event loop."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[str, int], tuple[Synthesizer, PendingPoses]] = {}
        self._arrived = self._previous = 0

    async def row(self, model: Synthesizer, question: PreparedPoseQuestion) -> OutputRow:
        """Return the graph's output for a question; the batch does not affect its bytes.

        A question is batched if it is for one time, the model's level is exact in batches, and the
        previous iteration had at least two questions.
        """
        self._count_arrival()
        if (
            self._previous < 2
            or len(question.when) > 1
            or not poses.is_batch_exact(model, question.level)
        ):
            metrics.count_inference(1)
            return poses.run_batch(model, [question])[0]
        return await self._enqueue(model, question)

    def _count_arrival(self) -> None:
        """Count the questions of an iteration, which predict the number in the next one."""
        if not self._arrived:
            asyncio.get_running_loop().call_soon(self._end_iteration)
        self._arrived += 1

    def _end_iteration(self) -> None:
        self._previous, self._arrived = self._arrived, 0

    def _enqueue(self, model: Synthesizer, question: PreparedPoseQuestion) -> "Future[OutputRow]":
        loop = asyncio.get_running_loop()
        if not self._waiting:
            loop.call_soon(self._evaluate_batches)
        # Keyed by identity: requests may be for two versions of a model at the same time.
        key = model.identity, question.level
        future: Future[OutputRow] = loop.create_future()
        self._waiting.setdefault(key, (model, []))[1].append((question, future))
        return future

    def _evaluate_batches(self) -> None:
        waiting, self._waiting = self._waiting, {}
        for model, pending in waiting.values():
            for first in range(0, len(pending), MAX_POSES):
                _evaluate_batch(model, pending[first : first + MAX_POSES])


def _evaluate_batch(model: Synthesizer, pending: PendingPoses) -> None:
    metrics.count_inference(len(pending))
    try:
        rows = poses.run_batch(model, [question for question, _ in pending])
    except Exception as fault:
        for _, future in pending:
            if not future.done():
                future.set_exception(fault)
        return
    for (_, future), row in zip(pending, rows, strict=True):
        if not future.done():
            future.set_result(row)
