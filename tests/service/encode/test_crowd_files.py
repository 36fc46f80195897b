"""Tests of crowd files: complete or absent, streamed, reproducible, without leftovers."""

import hashlib
import os
import resource
import subprocess
import sys
import tempfile
import weakref
import zipfile
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import conftest
import crowds
import numpy as np
import pytest
from pxr import Sdf, UsdUtils

from posefield.common.errors import FileError, InvalidField
from posefield.encode import character, crowd_size, crowd_writer, layers

FOLDER = Path(__file__).parent
MOTION = [0, 1, 2, 3, 4, 2, 0, 1]
LAYOUTS = crowds.LAYOUTS


@pytest.fixture(scope="module")
def made():
    return crowds.motions(conftest.person(), 5, 12)


@pytest.fixture
def clip(made):
    return crowds.crowd(conftest.person(), made, MOTION)


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """Folder in which all temporary files are made."""
    found = tmp_path / "temporary"
    found.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(found))
    return found


def contents(folder):
    found = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


def breaking(clip, after):
    """The same crowd, whose motions break off."""

    def batches():
        for index, batch in enumerate(clip.batches):
            if index == after:
                raise RuntimeError("the model has gone")
            yield batch

    return replace(clip, batches=batches())


def test_a_folder_has_a_layer_for_each_motion_and_two_more(clip, tmp_path):
    crowd_writer.write(clip, tmp_path / "many.usd")
    parts = ["character", *(f"m{i:05}" for i in range(5)), "summary"]
    assert list(contents(tmp_path)) == ["many.usd", *(f"many_clips/{p}.usdc" for p in parts)]
    assert all(data.startswith(b"PXR-USDC") for data in contents(tmp_path).values())


@pytest.mark.parametrize(("ending", "instancing"), [("usdc", "references"), ("usd", "flatten")])
def test_a_single_layer_needs_no_other(ending, instancing, clip, tmp_path):
    crowd_writer.write(clip, tmp_path / f"one.{ending}", instancing)
    assert list(contents(tmp_path)) == [f"one.{ending}"]
    opened, assets, missing = UsdUtils.ComputeAllDependencies(str(tmp_path / f"one.{ending}"))
    assert (len(opened), assets, missing) == (1, [], [])


@pytest.mark.parametrize("instancing", crowd_size.INSTANCING)
def test_an_archive_is_stored_aligned_and_begins_with_what_is_opened(instancing, clip, tmp_path):
    path = tmp_path / "crowd.usdz"
    crowd_writer.write(clip, path, instancing)
    data = path.read_bytes()
    with zipfile.ZipFile(path) as found:
        assert found.testzip() is None
        entries = found.infolist()
    assert entries[0].filename == "crowd.usdc"
    assert len(entries) == (1 if instancing == "flatten" else 1 + 5 + 2)
    package = Sdf.ZipFile.Open(str(path))
    for entry in entries:
        info = package.GetFileInfo(entry.filename)
        assert info.dataOffset % 64 == 0
        assert data[info.dataOffset :].startswith(b"PXR-USDC")
        assert (info.compressionMethod, info.encrypted) == (0, False)


@pytest.mark.parametrize(("ending", "instancing"), crowds.STREAMED)
def test_a_stream_has_the_bytes_of_the_file(ending, instancing, clip, made, tmp_path, temporary):
    path = tmp_path / f"crowd.{ending}"
    crowd_writer.write(clip, path, instancing)
    again = crowds.crowd(conftest.person(), made, MOTION, size=2)
    assert b"".join(crowd_writer.stream(again, ending, instancing)) == path.read_bytes()
    assert contents(temporary) == {}


@pytest.mark.parametrize(("ending", "instancing"), LAYOUTS)
def test_what_breaks_off_leaves_what_was_there(ending, instancing, made, clip, tmp_path):
    path = tmp_path / f"crowd.{ending}"
    crowd_writer.write(replace(clip, batches=crowds.cut(made, 2), facts={}), path, instancing)
    before = contents(tmp_path)
    with pytest.raises(RuntimeError, match="the model has gone"):
        crowd_writer.write(breaking(clip, after=1), path, instancing)
    assert contents(tmp_path) == before
    assert not [found for found in tmp_path.rglob("*") if ".writing" in found.name]


@pytest.mark.parametrize(("ending", "instancing"), LAYOUTS)
def test_a_batch_is_garbage_before_the_next_is_made(ending, instancing, made, clip, tmp_path):
    alive = []
    given = replace(clip, batches=watched(made, alive))
    crowd_writer.write(given, tmp_path / f"crowd.{ending}", instancing)
    assert alive == [0] * 5


def test_batches_that_are_kept_would_be_counted(made):
    alive = []
    assert len(list(watched(made, alive))) == 5
    assert alive == [0, 4, 8, 12, 16]


def watched(made, alive):
    """Batches of one motion each; before one is made, says how many earlier arrays are alive."""
    earlier = []
    for batch in crowds.cut(made, 1):
        alive.append(sum(array() is not None for array in earlier))
        yield watch(batch, earlier)


def watch(batch, earlier):
    copy = deepcopy(batch)
    arrays = (value for value in vars(copy).values() if value is not None)
    earlier.extend(map(weakref.ref, arrays))
    return copy


# Names of fields that come into being before usd-core is loaded have addresses in the order given.
PRINT_DIGESTS = """
import sys
from pxr import Vt
names = [Vt.TokenArray([name]) for name in sys.argv[2:]]
sys.path.insert(0, sys.argv[1])
import test_crowd_files
test_crowd_files.print_digests()
"""
FIELDS = (
    "apiSchemas",
    "default",
    "elementSize",
    "interpolation",
    "kind",
    "timeSamples",
    "typeName",
)


def print_digests():
    person = conftest.person()
    made = crowds.motions(person, 5, 12)
    for ending in crowd_size.STREAMS:
        for instancing in crowd_size.INSTANCING:
            sent = b"".join(
                crowd_writer.stream(crowds.crowd(person, made, MOTION), ending, instancing)
            )
            print(ending, instancing, hashlib.sha256(sent).hexdigest())  # noqa: T201
    layer, copy = Sdf.Layer.CreateAnonymous("x.usdc"), Sdf.Layer.CreateAnonymous("x.usdc")
    prim = layers.add_character(layer, "Character", character.rig(person))
    Sdf.CopySpec(layer, prim.path, copy, prim.path)
    print("CopySpec", hashlib.sha256(layers.crate_bytes(copy)).hexdigest())  # noqa: T201


@pytest.mark.system
def test_other_processes_write_the_same_bytes():
    digests = []
    for turn in range(3):
        names = FIELDS[turn:] + FIELDS[:turn]
        command = [sys.executable, "-c", PRINT_DIGESTS, str(FOLDER), *names]
        environment = {**os.environ, "PYTHONHASHSEED": str(turn)}
        said = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
        digests.append(said.stdout.splitlines())
    assert len(digests[0]) == 10
    differing = {line.split()[0] for lines in digests for line in lines if line not in digests[0]}
    # usd-core's own copies have their fields in the order of addresses.
    assert differing == {"CopySpec"}


@pytest.mark.parametrize(
    ("many", "said"),
    [({"frames": 2_000_000}, "6.0 GB in 8"), ({"motion": np.arange(70_000)}, "70003")],
)
def test_a_crowd_that_no_archive_can_hold_is_refused_at_once(many, said, clip, tmp_path):
    given = replace(breaking(clip, after=0), **many)
    for ask in (
        lambda: crowd_writer.write(given, tmp_path / "crowd.usdz"),
        lambda: crowd_writer.stream(given, "usdz"),
    ):
        with pytest.raises(InvalidField, match=said):
            ask()
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_named_and_keeps_the_previous_file(clip, temporary, tmp_path):
    most = resource.getrlimit(resource.RLIMIT_FSIZE)
    for ending, place in (("usda", f"{tmp_path / 'crowd.usda'}: "), ("usdz", f"{temporary}: ")):
        path = tmp_path / f"crowd.{ending}"
        path.write_bytes(b"old")
        # The disk takes 5 kB of a file and no more.
        resource.setrlimit(resource.RLIMIT_FSIZE, (5_000, most[1]))
        try:
            with pytest.raises(FileError, match="File too large") as fault:
                crowd_writer.write(clip, path)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, most)
        assert str(fault.value).startswith(place)
        assert contents(tmp_path)[path.name] == b"old" and contents(temporary) == {}
