"""Tests of file writing: files are complete or absent."""

import os
import resource
import signal
import subprocess
import sys
import threading

import pytest

from posefield.common import atomic_files
from posefield.common.errors import FileError


@pytest.mark.parametrize("mask", [0o077, 0o000])
def test_everyone_may_read_and_the_owner_write_whatever_the_mask(tmp_path, mask):
    before = os.umask(mask)
    try:
        atomic_files.write(b"x", tmp_path / "model.onnx")
    finally:
        os.umask(before)
    assert (tmp_path / "model.onnx").stat().st_mode & 0o777 == 0o644


def test_disk_that_fills_up_leaves_the_old_file_and_nothing_else(tmp_path):
    target, most = tmp_path / "model.onnx", resource.getrlimit(resource.RLIMIT_FSIZE)
    target.write_bytes(b"old")
    # The disk takes 1000 bytes of a file and no more.
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, most[1]))
    try:
        with pytest.raises(FileError) as refusal:
            atomic_files.write(b"x" * 5000, target)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, most)
    assert str(refusal.value) == f"{target}: cannot be written: File too large"
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_reader_never_sees_a_part(tmp_path):
    target = tmp_path / "model.onnx"
    contents = [bytes([i]) * 300_000 for i in (1, 2)]
    atomic_files.write(contents[0], target)
    done = threading.Event()

    def keep_writing():
        for i in range(60):
            atomic_files.write(contents[i % 2], target)
        done.set()

    writer = threading.Thread(target=keep_writing)
    writer.start()
    seen = set()
    while not done.is_set():
        seen.add(target.read_bytes())
    writer.join()
    assert seen <= set(contents)


def test_pieces_that_break_off_leave_the_old_file(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "fcntl", None)  # As on Windows, which has no such locks.
    (target := tmp_path / "crowd.usdz").write_bytes(b"old")

    def pieces():
        yield b"new"
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        atomic_files.write_chunks(pieces(), target)
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def fill(path, folder, word):
    with atomic_files.replacing_pair(path, folder) as (file, inside):
        file.write_text(word)
        (inside / word).write_text(word)


def seen(folder):
    found = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_text() for path in found}


def test_a_file_and_its_folder_are_replaced_together(tmp_path):
    for word in ("first", "second"):
        fill(tmp_path / "crowd.usd", tmp_path / "crowd_clips", word)
        assert seen(tmp_path) == {"crowd.usd": word, f"crowd_clips/{word}": word}


def test_a_file_and_its_folder_stay_where_one_cannot_be_replaced(tmp_path):
    taken, folder = tmp_path / "crowd.usd", tmp_path / "crowd_clips"
    (taken / "inside").mkdir(parents=True)
    with pytest.raises(FileError, match="Is a directory"):
        fill(taken, folder, "new")
    assert not folder.exists()
    folder.mkdir()
    (folder / "old").write_text("old")
    with pytest.raises(FileError, match="Is a directory"):
        fill(taken, folder, "new")
    assert seen(tmp_path) == {"crowd_clips/old": "old"}
    assert sorted(tmp_path.iterdir()) == [taken, folder]


def test_files_written_together_are_replaced_all_or_none(tmp_path):
    files = [tmp_path / name for name in ("a.osi", "b.npz", "c.usd")]
    files[0].write_text("old")
    files[2].mkdir()

    def write():
        with atomic_files.together():
            for path in files:
                atomic_files.write(b"new", path)
                assert not path.is_file() or path.read_text() == "old"

    with pytest.raises(FileError) as refusal:
        write()
    assert str(refusal.value) == f"{files[2]}: cannot be written: Is a directory"
    assert seen(tmp_path) == {"a.osi": "old"}
    assert sorted(tmp_path.iterdir()) == files[::2]
    files[2].rmdir()
    write()
    assert seen(tmp_path) == dict.fromkeys(("a.osi", "b.npz", "c.usd"), "new")


KILLED = """
import os, pathlib, signal, sys
from posefield.common import atomic_files
with atomic_files.replacing(pathlib.Path(sys.argv[1])) as file:
    file.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_process_left_is_removed_and_nothing_else(tmp_path):
    target, other = tmp_path / "crowd.osi", tmp_path / "other.osi"
    for path in (target, other):
        killed = subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False)
        assert killed.returncode == -signal.SIGKILL
    with atomic_files.replacing(target) as file:
        file.write_text("slow")
        atomic_files.write(b"quick", target)
        assert target.read_text() == "quick"
    assert target.read_text() == "slow"
    left = [path.name for folder in tmp_path.glob(".writing.*") for path in folder.iterdir()]
    assert left == ["other.osi"]
