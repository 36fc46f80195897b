"""Tests of kept results: a second run computes what is missing, and nothing else."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from posefield_train.parallel.finished_jobs import FinishedJobs


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
