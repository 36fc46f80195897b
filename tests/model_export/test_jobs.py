"""Tests of jobs in local processes."""

import os
import time

import pytest

from posefield.common.errors import TrainingError
from posefield_train.parallel.jobs import ProcessJobs


def divide(dividend, divisor):
    if divisor == 0:
        raise TrainingError("divided by 0")
    return dividend // divisor, os.getpid()


def wait(seconds):
    time.sleep(seconds)
    return seconds


def test_one_process_runs_jobs_here_and_in_order():
    found = list(ProcessJobs(1).run(divide, [(1,), (2,), (3,)], (12,)))
    assert found == [(12, os.getpid()), (6, os.getpid()), (4, os.getpid())]


def test_arguments_are_read_as_jobs_are_started():
    read = []

    def arguments():
        for seconds in range(50):
            read.append(seconds)
            yield (0,)

    results = ProcessJobs(1).run(wait, arguments())
    assert next(results) == 0
    assert len(read) < 5
    assert len(list(results)) == 49


@pytest.mark.system
def test_more_processes_share_the_jobs_and_the_first_result_comes_first():
    jobs = [(1.5,), (0.01,), (0.02,), (0.03,)]
    found = list(ProcessJobs(2).run(wait, jobs))
    assert sorted(found) == sorted(own for (own,) in jobs)
    # The longest job began first.
    assert found[-1] == 1.5


@pytest.mark.system
def test_an_error_in_another_process_is_raised():
    with pytest.raises(TrainingError, match="divided by 0"):
        list(ProcessJobs(2).run(divide, [(1,), (0,), (2,)], (12,)))
