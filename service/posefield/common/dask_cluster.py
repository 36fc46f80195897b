"""Calls of one function on the workers of a Dask cluster; needs the extra "dask"."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from itertools import islice
from typing import Any

import dask
from distributed import CancelledError, Client, KilledWorker, as_completed, get_worker
from distributed.comm import CommClosedError

from posefield.common.errors import ClusterError

TIMEOUT = 10.0
"""Seconds to wait for the scheduler, and for a first worker."""
AHEAD = 3
"""Calls submitted for each thread of the workers, so that none waits for the next."""
# The size of the arguments is known; the warning is meant for authors of Dask programs.
QUIET = {"distributed.admin.large-graph-warning-threshold": "1 TiB"}


@contextmanager
def connect(address: str) -> Iterator[Client]:
    """Yield a client of the scheduler at an address such as tcp://host:8786.

    Raises ClusterError if the scheduler does not answer, has no workers, or ends during the block.
    """
    try:
        client = Client(address, timeout=TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as fault:
        message = f"no Dask scheduler answers within {TIMEOUT:g} s, expected tcp://HOST:PORT"
        raise ClusterError(address, message) from fault
    with client, dask.config.set(QUIET):
        try:
            client.wait_for_workers(1, timeout=TIMEOUT)
        except TimeoutError as fault:
            raise ClusterError(address, f"has no workers after {TIMEOUT:g} s") from fault
        try:
            yield client
        except KilledWorker as fault:
            message = f"workers died at the same job {fault.allowed_failures + 1} times, the last "
            message += f"was {fault.last_worker.address}: out of memory?"
            raise ClusterError(address, message) from fault
        except (CancelledError, CommClosedError) as fault:
            raise ClusterError(address, "the scheduler has gone") from fault


def results(
    client: Client,
    function: Callable[..., Any],
    shared: Sequence[Any],
    arguments: Iterable[Sequence[Any]],
    packages: Iterable[str],
) -> Iterator[Any]:
    """Yield the results of `function(*shared, *arguments)`, in the order of completion.

    A call whose worker dies is repeated on another. packages: whose versions workers must share;
    ClusterError names one that does not. Calls that are left are cancelled with the iterator.
    """
    versions = {name: version(name) for name in packages}
    # The result of a task, not scattered data, which is lost with the workers that hold it.
    common = client.submit(_Common, function, tuple(shared), versions, pure=False)
    waiting = (client.submit(_call, common, tuple(call), pure=False) for call in arguments)
    threads = sum(client.nthreads().values())
    running = as_completed(islice(waiting, AHEAD * threads), loop=client.loop)
    try:
        for future in running:
            yield future.result()
            running.update(islice(waiting, 1))
    finally:
        client.cancel([*running.futures, common])


@dataclass(frozen=True)
class _Common:
    """Common part of the calls of a run."""

    function: Callable[..., Any]
    shared: tuple[Any, ...]
    versions: Mapping[str, str]


def _call(common: _Common, arguments: tuple[Any, ...]) -> Any:
    for name, expected in common.versions.items():
        if (here := version(name)) != expected:
            raise ClusterError(get_worker().address, f"{name} {here}, expected {expected}")
    return common.function(*common.shared, *arguments)
