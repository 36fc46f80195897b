"""Tests of errors: pickling between processes keeps all fields."""

import pickle

import pytest

from posefield.common import errors
from posefield.common.errors import FileError, WorkerDied


def every(kind):
    return [kind, *(child for own in kind.__subclasses__() for child in every(own))]


@pytest.mark.parametrize(
    "error",
    [
        *(kind("/a/file", "found x, expected y", 7) for kind in every(FileError)),
        *(kind("fps", "0, expected more", 3) for kind in every(errors.QueryError)),
        *(kind("no model") for kind in every(errors.TrainingError)),
        WorkerDied("gone"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_errors_are_the_same_in_another_process(error):
    told = pickle.loads(pickle.dumps(error))
    assert type(told) is type(error)
    assert (str(told), vars(told)) == (str(error), vars(error))
