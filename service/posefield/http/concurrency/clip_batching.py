"""Batching of concurrent clips in a thread: their synthesis and encoding, or their encoding alone.

Clips of a batch share much of the work, and a thread switch takes a tenth of a millisecond. There
is no timer: requests that arrive during a batch form the next one.
"""

import asyncio
from asyncio import Future, Task
from collections.abc import Callable, Hashable, Sequence
from contextvars import Context, copy_context
from functools import partial
from typing import Any, NamedTuple

from anyio import to_thread

from posefield.common import cancellation
from posefield.encode.files.file_convention import Convention
from posefield.encode.formats import ClipEncoder
from posefield.http.concurrency import worker_threads
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import ClipAnswer
from posefield.synthesis import clip_batch, clips
from posefield.synthesis.synthesizer import Synthesizer

MAX_BATCH = 32
"""Maximum clips of a batch: all of its requests wait for the whole batch, some 15 ms."""

MAX_BATCHED_FRAMES = 1000
"""Maximum frames of a clip in a batch, so that short clips do not wait for long ones."""

Work = Callable[[Sequence[Any]], Sequence[Any]]
"""Work on the items of a batch: returns their results in order, an exception for a failed item."""

Pending = list[tuple[Any, "Future[Any]"]]


class EncodedClip(NamedTuple):
    """A clip and its file."""

    answer: ClipAnswer
    content: bytes


class ClipBatcher:
    """Queues of clips in an event loop, by the work to be done with them."""

    def __init__(self) -> None:
        self._waiting: dict[Hashable, Pending] = {}
        self._tasks: set[Task[None]] = set()

    async def clip(
        self,
        model: Synthesizer,
        question: ClipQuestion,
        most: int,
        encoder: ClipEncoder,
        convention: Convention,
    ) -> EncodedClip:
        """Return the clip of a question and its file; the batch does not affect its bytes.

        most: largest number of frames. Raises as `clips.synthesize_clip` does.
        """
        if clip_batch.longest(model, question) > MAX_BATCHED_FRAMES:
            answer = await worker_threads.run_in_thread(
                clips.synthesize_clip, model, question, most
            )
            return EncodedClip(answer, await self.file(encoder, convention, answer))
        key = encoder.extension, convention, model.identity, question.level, most
        work = partial(_encoded_clips, model, most, encoder, convention)
        made: EncodedClip = await self._result(key, question, work)
        return made

    async def file(self, encoder: ClipEncoder, convention: Convention, answer: ClipAnswer) -> bytes:
        """Return the file of an answer; the batch does not affect its bytes."""
        if len(answer.clip) > MAX_BATCHED_FRAMES:
            return await worker_threads.run_in_thread(encoder.encode, answer, convention)
        work = partial(_files, encoder, convention)
        made: bytes = await self._result((encoder.extension, convention), answer, work)
        return made

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
            self._waiting[key] = waiting[MAX_BATCH:]
            await _work_batch(work, waiting[:MAX_BATCH])
        del self._waiting[key]


def _encoded_clips(
    model: Synthesizer,
    most: int,
    encoder: ClipEncoder,
    convention: Convention,
    asked: Sequence[ClipQuestion],
) -> list[EncodedClip | Exception]:
    answers = clips.synthesize_clips(model, asked, most)
    made = [answer for answer in answers if isinstance(answer, ClipAnswer)]
    files = iter(encoder.write(made, convention))
    return [
        answer if isinstance(answer, Exception) else EncodedClip(answer, next(files))
        for answer in answers
    ]


def _files(
    encoder: ClipEncoder, convention: Convention, answers: Sequence[ClipAnswer]
) -> list[bytes]:
    return encoder.write(answers, convention)


def _uncancelled_context() -> Context:
    """Return a context without a request's cancellation: a batch serves several requests."""
    context = copy_context()
    context.run(cancellation.current.set, None)
    return context


async def _work_batch(work: Work, own: Pending) -> None:
    wanted = [(item, future) for item, future in own if not future.done()]
    try:
        items = [item for item, _ in wanted]
        results = await to_thread.run_sync(work, items) if wanted else []
    except Exception as fault:
        results = [fault] * len(wanted)
    for (_, future), result in zip(wanted, results, strict=True):
        if future.done():
            continue
        if isinstance(result, Exception):
            future.set_exception(result)
        else:
            future.set_result(result)
