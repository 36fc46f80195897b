"""Tests of the number of BLAS threads of a server process."""

import numpy as np
from threadpoolctl import threadpool_info, threadpool_limits

from posefield.batch import process_pool
from posefield.common.cancellation import SINGLE_THREAD_ENV


def threads():
    """Numbers of threads of the BLAS libraries that are loaded."""
    np.ones((2, 2)) @ np.ones((2, 2))
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


def test_blas_keeps_to_one_thread(monkeypatch):
    for name in SINGLE_THREAD_ENV:
        monkeypatch.delenv(name, raising=False)
    with threadpool_limits(2, user_api="blas"):
        assert threads() == {2}
        process_pool.limit_threads()
        assert threads() == {1}
