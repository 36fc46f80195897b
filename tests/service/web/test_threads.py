"""Tests of work in threads: the limit counts cancelled work until it ends."""

import asyncio
import gc
import threading
import time

import pytest
from anyio import CapacityLimiter

from posefield.common import cancellation
from posefield.common.cancellation import Cancelled
from posefield.http import batching


class Work:
    """Work that goes on until it is cancelled, or to its end without looking."""

    def __init__(self, looks: bool = True, seconds: float = 20.0) -> None:
        self.begun, self.ended = threading.Event(), threading.Event()
        self.looks, self.seconds = looks, seconds

    def __call__(self) -> str:
        self.begun.set()
        until = time.monotonic() + self.seconds
        try:
            while time.monotonic() < until:
                if self.looks:
                    cancellation.check()
                time.sleep(0.005)
            return "done"
        finally:
            self.ended.set()


async def begun(work):
    while not work.begun.is_set():
        await asyncio.sleep(0.002)


async def cancelled(task):
    with pytest.raises(asyncio.CancelledError):
        await task


class Failing(Work):
    """Work that fails where it should stop."""

    def __call__(self) -> str:
        try:
            return super().__call__()
        except Cancelled:
            raise OSError("a fault of its own") from None


@pytest.mark.parametrize(("kind", "lines"), [(Work, []), (Failing, ["a fault of its own"])])
def test_cancelled_work_stops_and_leaves_nothing_in_the_log_unless_it_fails(kind, lines, caplog):
    async def scene():
        work = kind()
        task = asyncio.create_task(batching.run_in_thread(work))
        await begun(work)
        task.cancel()
        await cancelled(task)
        assert work.ended.is_set()

    asyncio.run(scene())
    # asyncio logs an exception that has not been retrieved when its future is collected.
    gc.collect()
    assert [str(record.exc_info[1]) for record in caplog.records] == lines


@pytest.mark.parametrize("times", [1, 3])
def test_a_place_is_held_until_work_that_does_not_look_has_ended(times):
    async def scene():
        places, work, next_one = CapacityLimiter(1), Work(looks=False, seconds=0.3), Work()
        task = asyncio.create_task(batching.run_in_thread(work, limiter=places))
        await begun(work)
        waiting = asyncio.create_task(batching.run_in_thread(next_one, limiter=places))
        for _ in range(times):
            task.cancel()
            await asyncio.sleep(0.01)
        assert not next_one.begun.is_set() and not task.done()
        await begun(next_one)
        assert work.ended.is_set() and task.done()
        waiting.cancel()
        await cancelled(waiting)
        assert places.borrowed_tokens == 0

    asyncio.run(scene())
