"""Tests of `--verify`: damaged files are detected by size or checksum."""

import shutil

import exporting
import pytest

from posefield.batch import run

ROWS = 12


@pytest.fixture(scope="module")
def source():
    return exporting.queries(ROWS, "usdc", fps=10.0)


@pytest.fixture(scope="module")
def complete(source, model_path, tmp_path_factory):
    """Folder of a complete export, by layout."""

    def of(layout):
        folder = tmp_path_factory.mktemp(layout)
        work = exporting.work(model_path, source, folder, 4, layout)
        run.run(work, source, exporting.Recorder())
        return folder

    return {layout: of(layout) for layout in ("folder", "tar", "library")}


def flip(path):
    """Change one bit in the middle of a file."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


DAMAGED = [
    ("folder", "clips/000/clip-0005.usdc"),
    ("library", "character.usd"),
    ("tar", "clips-000001.tar"),
]


@pytest.mark.parametrize(("layout", "name"), DAMAGED)
def test_another_size_is_found_and_a_flipped_bit_to_verify_and_the_file_made_again(
    layout, name, complete, source, model_path, tmp_path
):
    target = shutil.copytree(complete[layout], tmp_path / "target")
    work = exporting.work(model_path, source, target, 4, layout)
    assert run.run(work, source, exporting.Recorder(), verify=True).already_complete
    flip(target / name)
    recorder = exporting.Recorder()
    assert not run.run(work, source, recorder, verify=True).already_complete
    assert recorder.notes == [f"{target}/{name}: missing or damaged; the export is made again"]
    assert exporting.content(target) == exporting.content(complete[layout])
    (target / name).write_bytes((target / name).read_bytes()[:-1])
    assert not run.run(work, source, exporting.Recorder()).already_complete
    assert exporting.content(target) == exporting.content(complete[layout])


def test_a_manifest_that_lost_a_line_is_found_without_verifying(
    complete, source, model_path, tmp_path
):
    target = shutil.copytree(complete["folder"], tmp_path / "target")
    manifest = target / "manifest.jsonl"
    first, second, *rest = manifest.read_bytes().splitlines(keepends=True)
    # Of the same size: spaces after a value are JSON still.
    manifest.write_bytes(b"".join([first[:-1], b" " * len(second), b"\n", *rest]))
    work = exporting.work(model_path, source, target, 4)
    assert not run.run(work, source, exporting.Recorder()).already_complete
    assert exporting.content(target) == exporting.content(complete["folder"])


@pytest.mark.parametrize(
    ("layout", "name"),
    [("folder", "clips/000/clip-0001.usdc"), ("tar", "clips-000000.tar")],
)
def test_a_chunk_with_a_flipped_bit_is_made_again_when_resumed(
    layout, name, complete, source, model_path, tmp_path
):
    work = exporting.work(model_path, source, tmp_path, 4, layout)
    run.run(work, source, exporting.Recorder(2))
    flip(tmp_path / name)
    stopped = exporting.Recorder(0)
    run.run(work, source, stopped)
    assert stopped.begun == (ROWS, 8)
    recorder = exporting.Recorder()
    run.run(work, source, recorder, verify=True)
    assert recorder.begun == (ROWS, 4)
    assert exporting.content(tmp_path) == exporting.content(complete[layout])
