"""Tests of cancellation: its scope, and the cost of a check."""

from concurrent.futures import ThreadPoolExecutor

import anyio
import pytest
from anyio import to_thread

from posefield.common import cancellation as cancel
from posefield.common.cancellation import Cancellation, Cancelled


@pytest.fixture
def cancellation():
    """Cancellation of the test's own context."""
    made = Cancellation()
    token = cancel.current.set(made)
    yield made
    cancel.current.reset(token)


def test_threads_of_anyio_see_the_cancellation_of_the_task():
    async def ask() -> None:
        own = Cancellation()
        cancel.current.set(own)
        await to_thread.run_sync(cancel.check)
        own.cancel()
        with pytest.raises(Cancelled):
            await to_thread.run_sync(cancel.check)

    anyio.run(ask)


def test_threads_of_a_pool_see_it_where_it_is_carried(cancellation):
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(cancel.bind_context(abs), [-1, 2, -3])) == [1, 2, 3]
        carried = cancel.bind_context(cancel.check)
        cancellation.cancel()
        with pytest.raises(Cancelled):
            pool.submit(carried).result()
        # Negative control: a pool's threads have contexts of their own.
        pool.submit(cancel.check).result()
