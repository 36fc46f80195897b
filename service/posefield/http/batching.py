"""Batching of concurrent requests: poses into one inference call, clips in a thread.

There is no timer. A batch of poses holds the requests of one iteration of the event loop. Clips of
a batch share much of the work, and a thread switch takes a tenth of a millisecond: those that
arrive during a batch form the next one.
"""

import asyncio
from asyncio import Future, Task
from collections.abc import Callable, Hashable, Sequence
from contextvars import Context, copy_context
from functools import partial
from typing import Any

from anyio import to_thread

from posefield.common import cancellation
from posefield.encode.character import Convention
from posefield.encode.formats import ClipEncoder
from posefield.http import metrics, worker_threads
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import ClipAnswer
from posefield.synthesis import clip_draft, clips, poses
from posefield.synthesis.poses import OutputRow, PreparedPoseQuestion
from posefield.synthesis.synthesizer import Synthesizer

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
            answer = await worker_threads.run_in_thread(
                clips.synthesize_clip, model, question, longest
            )
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
            return await worker_threads.run_in_thread(encoder.encode, answer, convention)

        def work(answers: Sequence[ClipAnswer]) -> list[bytes]:
            return encoder.write(answers, convention)

        content: bytes = await self._result((encoder.extension, convention), answer, work)
        return content

    def _result(self, key: Hashable, item: Any, work: Work) -> "Future[Any]":
        future: Future[Any] = asyncio.get_running_loop().create_future()
        if key not in self._waiting:
            self._waiting[key] = []
            task = asyncio.create_task(self._work(key, work), context=_uncancelled_context())
            # The event loop keeps only weak references to tasks.
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        self._waiting[key].append((item, future))
        return future

    async def _work(self, key: Hashable, work: Work) -> None:
        while waiting := self._waiting[key]:
            self._waiting[key] = waiting[MAX_CLIPS:]
            await _work_batch(work, waiting[:MAX_CLIPS])
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


def _uncancelled_context() -> Context:
    """Return a context without a request's cancellation: a batch serves several requests."""
    context = copy_context()
    context.run(cancellation.current.set, None)
    return context


async def _work_batch(work: Work, batch: Pending) -> None:
    batch = [(item, future) for item, future in batch if not future.done()]
    try:
        results = await to_thread.run_sync(work, [item for item, _ in batch]) if batch else []
    except Exception as fault:
        results = [fault] * len(batch)
    for (_, future), result in zip(batch, results, strict=True):
        if future.done():
            continue
        if isinstance(result, Exception):
            future.set_exception(result)
        else:
            future.set_result(result)


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
