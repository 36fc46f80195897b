"""Tests of jobs in local processes, and of kept results."""

import hashlib
import os
import pickle
import time
from dataclasses import dataclass, field

import numpy as np
import pytest

from posefield.common.errors import FileError, TrainingError
from posefield_train.jobs import PACKAGES, FinishedJobs, ProcessJobs


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


def scaled(table, factor):
    """Job of the tests."""
    return factor * table


@dataclass
class HereJobs:
    """Jobs that run here, count, and stop after some of them."""

    stop: int = 100
    ran: list = field(default_factory=list)

    def run(self, function, arguments, shared=()):
        for own in arguments:
            if len(self.ran) == self.stop:
                raise InterruptedError
            self.ran.append(own)
            yield function(*shared, *own)


TABLE = np.arange(4.0)
EACH = [(1.0,), (2.0,), (3.0,)]


def totals(jobs, folder, table=TABLE, function=scaled):
    found = FinishedJobs(jobs, folder).run(function, EACH, (table,))
    return sorted(float(own.sum()) for own in found)


def test_a_run_that_was_stopped_goes_on(tmp_path):
    stopped, second, third = HereJobs(stop=2), HereJobs(), HereJobs()
    with pytest.raises(InterruptedError):
        totals(stopped, tmp_path)
    assert totals(second, tmp_path) == totals(third, tmp_path) == [6.0, 12.0, 18.0]
    assert [len(jobs.ran) for jobs in (stopped, second, third)] == [2, 1, 0]


def test_other_data_and_other_functions_are_computed_anew(tmp_path):
    totals(HereJobs(), tmp_path)
    other, same, data = HereJobs(), HereJobs(), HereJobs()

    def doubled(table, factor):
        return 2 * factor * table

    assert totals(other, tmp_path, function=doubled) == [12.0, 24.0, 36.0]
    assert totals(data, tmp_path, table=TABLE + 1e-12)
    assert (len(other.ran), len(data.ran)) == (3, 3)
    # Negative control: equal arrays are equal data.
    assert totals(same, tmp_path, table=TABLE.copy())
    assert len(same.ran) == 0


def test_a_result_that_was_cut_short_is_computed_anew(tmp_path):
    totals(HereJobs(), tmp_path)
    file = sorted(tmp_path.iterdir())[0]
    file.write_bytes(file.read_bytes()[:-1])
    again = HereJobs()
    assert totals(again, tmp_path) == [6.0, 12.0, 18.0]
    assert len(again.ran) == 1


class Hostile:
    """An object whose pickle makes a file when it is read."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return os.mkdir, (str(self.mark),)


@pytest.mark.parametrize("nested", [False, True])
def test_a_result_that_would_run_code_is_refused(tmp_path, nested):
    folder, mark = tmp_path / "kept", tmp_path / "ran"
    totals(HereJobs(), folder)
    held = pickle.dumps([np.ones(2), Hostile(mark)] if nested else Hostile(mark))
    for file in folder.iterdir():
        file.write_bytes(hashlib.sha256(held).digest() + held)
    with pytest.raises(FileError, match=r"names (posix|nt)\.mkdir, expected arrays"):
        totals(HereJobs(), folder)
    assert not mark.exists()


@dataclass(frozen=True)
class Part:
    """Result of a benchmark, in a data class of its own."""

    values: np.ndarray


def part(table, factor):
    """Job of a benchmark."""
    return Part(factor * table)


def test_data_classes_of_the_packages_that_are_named_are_read(tmp_path):
    def run(jobs, **packages):
        found = FinishedJobs(jobs, tmp_path, **packages).run(part, EACH, (TABLE,))
        return sorted(float(own.values.sum()) for own in found)

    named, again = {"packages": (*PACKAGES, __name__.partition(".")[0])}, HereJobs()
    assert run(HereJobs(), **named) == run(again, **named) == [6.0, 12.0, 18.0]
    assert again.ran == []
    # Negative control.
    with pytest.raises(FileError, match="expected arrays"):
        run(HereJobs())
