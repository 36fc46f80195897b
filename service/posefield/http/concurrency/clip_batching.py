"""Batching of concurrent clip encodings in a thread.

Encoders share much of their work among the clips of a call, and a thread switch takes a tenth of a
millisecond. There is no timer: requests that arrive during a batch form the next one.
"""

import asyncio
from asyncio import Future, Task
from contextvars import Context, copy_context

from anyio import to_thread

from posefield.common import cancellation
from posefield.encode.files.file_convention import Convention
from posefield.encode.formats import ClipEncoder
from posefield.http.concurrency import worker_threads
from posefield.question.results import ClipAnswer

MAX_BATCH = 16
"""Maximum files of a batch: all of its requests wait for the whole batch."""

MAX_BATCHED_FRAMES = 1000
"""Maximum frames of a clip in a batch, so that short clips do not wait for long ones."""

PendingClips = list[tuple[ClipAnswer, "Future[bytes]"]]


class ClipBatcher:
    """Queues of clips to encode in an event loop, by format and convention."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[str, Convention], PendingClips] = {}
        self._tasks: set[Task[None]] = set()

    async def file(self, encoder: ClipEncoder, convention: Convention, answer: ClipAnswer) -> bytes:
        """Return the file of an answer; the batch does not affect its bytes."""
        if len(answer.clip) > MAX_BATCHED_FRAMES:
            return await worker_threads.run_in_thread(encoder.encode, answer, convention)
        future: Future[bytes] = asyncio.get_running_loop().create_future()
        key = encoder.extension, convention
        if key not in self._waiting:
            self._waiting[key] = []
            task = asyncio.create_task(
                self._write(encoder, convention), context=_uncancelled_context()
            )
            # The event loop keeps only weak references to tasks.
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        self._waiting[key].append((answer, future))
        return await future

    async def _write(self, encoder: ClipEncoder, convention: Convention) -> None:
        key = encoder.extension, convention
        while waiting := self._waiting[key]:
            self._waiting[key] = waiting[MAX_BATCH:]
            await _encode_batch(encoder, convention, waiting[:MAX_BATCH])
        del self._waiting[key]


def _uncancelled_context() -> Context:
    """Return a context without a request's cancellation: a batch serves several requests."""
    context = copy_context()
    context.run(cancellation.current.set, None)
    return context


async def _encode_batch(encoder: ClipEncoder, convention: Convention, own: PendingClips) -> None:
    wanted = [(answer, future) for answer, future in own if not future.done()]
    try:
        answers = [answer for answer, _ in wanted]
        files = await to_thread.run_sync(encoder.write, answers, convention) if wanted else []
    except Exception as fault:
        for _, future in wanted:
            if not future.done():
                future.set_exception(fault)
        return
    for (_, future), file in zip(wanted, files, strict=True):
        if not future.done():
            future.set_result(file)
