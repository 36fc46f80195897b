"""Tests of crowd encoding in another process: equal bytes and no leftovers."""

import os
import tempfile
from contextvars import copy_context
from dataclasses import replace

import conftest
import crowds
import pytest
from serving import children

from posefield.common import cancellation
from posefield.common.cancellation import Cancellation, Cancelled
from posefield.encode import crowd_writer
from posefield.encode.crowd_size import STREAMS
from posefield.encode.crowd_writer import EncoderDied

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def made():
    return crowds.motions(conftest.person(), 5, 12)


@pytest.fixture
def crowd(made):
    return crowds.crowd(conftest.person(), made, [0, 1, 2, 3, 4, 2])


@pytest.fixture(autouse=True)
def folder(monkeypatch, tmp_path):
    """Folder of temporary files, in which none is left, and no process either."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    # Fixtures of other modules may have processes too.
    before = {*children(os.getpid())}
    yield tmp_path
    assert list(tmp_path.iterdir()) == []
    assert {*children(os.getpid())} <= before


@pytest.mark.parametrize("instancing", ["references", "flatten"])
@pytest.mark.parametrize("ending", STREAMS)
def test_its_bytes_are_those_of_this_process(crowd, made, ending, instancing):
    apart = b"".join(crowd_writer.stream_from_child(crowd, ending, instancing))
    again = replace(crowd, batches=crowds.cut(made, 3))
    assert apart == b"".join(crowd_writer.encode_here(again, ending, instancing))


def test_a_fault_of_the_motions_is_raised_here(crowd):
    def broken():
        yield next(iter(crowd.batches))
        raise RuntimeError("broken")

    with pytest.raises(RuntimeError, match="broken"):
        list(crowd_writer.stream_from_child(replace(crowd, batches=broken()), "usdc", "references"))


def test_a_process_that_ends_early_is_a_fault(crowd):
    with pytest.raises(EncoderDied, match="it ended with 1"):
        list(crowd_writer.stream_from_child(replace(crowd, rate="none"), "usdc", "references"))


class Third(Cancellation):
    """Cancels itself at the third check."""

    def __init__(self):
        super().__init__()
        self.checks = 0

    def check(self):
        self.checks += 1
        if self.checks == 3:
            self.cancel()
        super().check()


def test_a_cancelled_crowd_ends_its_process(crowd):
    own, context = Third(), copy_context()
    context.run(cancellation.current.set, own)
    pieces = crowd_writer.stream_from_child(crowd, "usdc", "references")
    with pytest.raises(Cancelled):
        context.run(next, pieces)
    assert own.checks == 3
