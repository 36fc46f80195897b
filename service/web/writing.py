"""Files that several clients wait for at once, written a few at a time in a thread.

A writer of files shares much of its work among the clips that it is given together, and a change of
threads costs a tenth of a millisecond. Nobody waits for others to come: what has come while the
last files were written is written next.
"""

import asyncio
from asyncio import Future, Task

from anyio import to_thread

from service.encode import Encoder
from service.encode.convention import Convention
from service.motion.answer import ClipAnswer

MOST = 16
"""Files that are written together: the last waits for the first."""

LONG = 1000
"""Frames beyond which a clip is written by itself, so that no short one waits for it."""

Waiting = list[tuple[ClipAnswer, "Future[bytes]"]]


class Desk:
    """What an event loop's clients wait for, by format and convention."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[str, Convention], Waiting] = {}
        self._tasks: set[Task[None]] = set()

    async def file(self, encoder: Encoder, convention: Convention, answer: ClipAnswer) -> bytes:
        """File of an answer; the same bytes whatever is written with it."""
        if len(answer.clip) > LONG:
            return await to_thread.run_sync(encoder.encode, answer, convention)
        future: Future[bytes] = asyncio.get_running_loop().create_future()
        key = encoder.extension, convention
        if key not in self._waiting:
            self._waiting[key] = []
            task = asyncio.create_task(self._write(encoder, convention))
            # The loop itself holds no task for long.
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        self._waiting[key].append((answer, future))
        return await future

    async def _write(self, encoder: Encoder, convention: Convention) -> None:
        key = encoder.extension, convention
        while waiting := self._waiting[key]:
            self._waiting[key] = waiting[MOST:]
            await _written(encoder, convention, waiting[:MOST])
        del self._waiting[key]


async def _written(encoder: Encoder, convention: Convention, own: Waiting) -> None:
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
