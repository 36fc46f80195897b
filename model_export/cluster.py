"""Where joblib's jobs are run: here in processes, or on a Dask cluster that has posefield too."""

import asyncio
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import joblib
from distributed import Client
from distributed.client import FutureCancelledError
from distributed.scheduler import KilledWorker
from joblib._dask import DaskDistributedBackend

from service import scheduler
from service.motion.errors import ClusterError

KIT = scheduler.Kit(
    ("service", "model_export"),
    ("numpy", "scipy", "onnx", "onnxruntime", "pydantic", "scikit-learn", "numba", "joblib"),
)
"""What an evaluation and a model's bytes hang on."""


@contextmanager
def jobs(address: str, shared: Sequence[Any] = ()) -> Iterator[None]:
    """Inside, joblib runs its jobs on the workers of the scheduler at an address.

    shared: arguments that many jobs have in common, sent to every worker once.
    A job whose worker dies is run again by another. Raises ClusterError where the cluster cannot be
    used, where a job has killed every worker that it ran on, and where all workers died at once.
    """
    with scheduler.connect(address, KIT) as client:
        backend = _Backend(client=client, scatter=list(shared))
        try:
            with joblib.parallel_config(backend=backend):
                yield
        except KilledWorker as fault:
            raise ClusterError(address, scheduler.killed(fault)) from fault
        except FutureCancelledError as fault:
            message = f"lost all workers at once, and the data with them ({fault})"
            raise ClusterError(address, message) from fault


class _Backend(DaskDistributedBackend):  # type: ignore[misc]  # joblib has no types
    """joblib's own, but for jobs that failed outside of their code: it would wait for them for
    ever (joblib 1.6)."""

    client: Client
    _callbacks: dict[Any, Callable[[Any], None]]

    async def _collect(self) -> None:
        while self._continue:
            async for future, result in self.waiting_futures:
                self._results.pop(future).set_result(result)
                self._callbacks.pop(future)(_Fault(result[1]) if _failed(future) else result)
            await asyncio.sleep(0.01)

    def retrieve_result_callback(self, out: Any) -> Any:
        if isinstance(out, _Fault):
            raise out.fault
        return super().retrieve_result_callback(out)


class _Fault:
    """An error in place of a result."""

    def __init__(self, fault: BaseException) -> None:
        self.fault = fault


def _failed(future: Any) -> bool:
    return bool(future.status == "error")
