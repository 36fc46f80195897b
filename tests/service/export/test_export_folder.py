"""Tests of output folders: files are complete or absent."""

import errno
import os
import subprocess
import sys

import pytest

from posefield.batch.target import FolderTarget
from posefield.common.errors import FileError

# Dies with half a file written; what is written reaches the disk before.
DIES = """
import os, signal, sys
from posefield.batch.target import FolderTarget

def pieces():
    yield bytes(1 << 20)
    os.kill(os.getpid(), signal.SIGKILL)

folder = FolderTarget(sys.argv[1], ".state/writing")
folder.prepare()
folder.stream("clips/000/a.usdc", pieces())
"""


@pytest.fixture
def folder(tmp_path):
    """A folder that is ready to be written to."""
    made = FolderTarget(str(tmp_path), ".state/writing")
    made.prepare()
    return made


def files(path):
    return {str(p.relative_to(path)): p.stat().st_size for p in path.rglob("*") if p.is_file()}


@pytest.mark.parametrize("before", [None, b"old"])
def test_a_writer_that_is_killed_leaves_no_part_of_a_file(before, folder, tmp_path):
    if before:
        folder.write([("clips/000/a.usdc", before)])
    subprocess.run([sys.executable, "-c", DIES, tmp_path], check=False)
    assert folder.read("clips/000/a.usdc") == before
    (left,) = set(files(tmp_path)) - {"clips/000/a.usdc"}
    # It was in the middle of it, and that lies where it is taken for no clip.
    assert left.startswith(".state/writing/")
    assert files(tmp_path)[left] == 1 << 20
    folder.remove(".state")
    assert set(files(tmp_path)) <= {"clips/000/a.usdc"}


def test_two_writers_of_one_file_do_each_other_no_harm(folder, tmp_path):
    other = FolderTarget(str(tmp_path), ".state/writing")

    def pieces():
        yield b"sa"
        other.write([("a", b"same")])
        yield b"me"

    folder.stream("a", pieces())
    assert folder.read("a") == b"same"
    assert files(tmp_path) == {"a": 4}


@pytest.mark.parametrize("number", [None, errno.EPERM, errno.EOPNOTSUPP])
def test_a_file_is_created_once_though_files_have_one_name(number, folder, tmp_path, monkeypatch):
    """As on exFAT, or on a share; other faults of a link are no reason to go on."""

    def link(*_):
        raise OSError(number, "no links here")

    if number:
        monkeypatch.setattr(os, "link", link)
    assert folder.create("a", b"first")
    assert not folder.create("a", b"second")
    assert files(tmp_path) == {"a": 5} and folder.read("a") == b"first"
    if number:
        number = errno.EIO
        with pytest.raises(FileError, match="b: cannot be written or read: no links here"):
            folder.create("b", b"first")
        assert files(tmp_path) == {"a": 5}
