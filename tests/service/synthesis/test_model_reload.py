"""Tests of reload: versions side by side, atomic replacement, and the old version on errors."""

import gc
import os
import shutil
import weakref

import pytest
from model_files import numbered

from posefield.common.errors import UnknownModel
from posefield.model_file import checked_file
from posefield.registry import model_registry
from posefield.registry.model_registry import ReloadingRegistry, VersionLimits

ROOM = VersionLimits()


@pytest.fixture(scope="module")
def content(model_path):
    """Function that gives a model file of a number: each other bytes, and all the same answers."""
    plain = model_path.read_bytes()
    return lambda number: numbered(plain, number)


@pytest.fixture
def put(content, tmp_path):
    """Function that puts the model of a number in place of a file, in one step; its identity."""

    def at(name, number):
        path, aside = tmp_path / name, tmp_path / ".aside"
        path.parent.mkdir(parents=True, exist_ok=True)
        aside.write_bytes(content(number))
        aside.rename(path)
        return checked_file.digest(content(number))

    return at


def followed(shelf):
    """The library once a change is settled."""
    assert not shelf.scan()
    assert shelf.scan()
    return shelf.registry


def identities(shelf):
    return [model.identity for model in shelf.registry.models.values()]


def test_a_file_that_was_replaced_is_newest_and_the_old_answers_under_its_hash(put, tmp_path):
    old = put("walk.onnx", 1)
    shelf = ReloadingRegistry([tmp_path], ROOM)
    before = shelf.registry
    new = put("walk.onnx", 2)
    after = followed(shelf)
    assert after.find("walk").identity == f"walk@{new}" != f"walk@{old}"
    assert after.find(f"walk@{old}") is before.find("walk")
    assert [m.identity for m in after.versions("walk")] == [f"walk@{new}", f"walk@{old}"]


def test_nothing_new_leaves_the_very_same_library(put, tmp_path):
    put("walk.onnx", 1)
    shelf = ReloadingRegistry([tmp_path], ROOM)
    taken = shelf.registry
    assert shelf.scan()
    assert shelf.registry is taken
    assert (shelf.reloads.looks, shelf.reloads.opened) == (2, 1)


def test_a_file_is_read_only_when_two_looks_find_it_the_same(put, content, tmp_path):
    put("walk.onnx", 1)
    shelf = ReloadingRegistry([tmp_path], ROOM)
    whole = content(2)
    # A copy in progress, longer at every look.
    for share in (0.3, 0.6, 1.0):
        (tmp_path / "walk.onnx").write_bytes(whole[: int(share * len(whole))])
        assert not shelf.scan()
        assert not shelf.reloads.faults
    assert shelf.scan()
    assert shelf.registry.find("walk").session.digest == checked_file.digest(whole)
    assert shelf.reloads.failed == 0


@pytest.mark.parametrize("broken", [b"not a model", None])
def test_a_broken_file_leaves_the_old_one_and_is_told_until_it_changes(
    broken, put, content, tmp_path, caplog
):
    old = put("walk.onnx", 1)
    shelf = ReloadingRegistry([tmp_path], ROOM)
    path = tmp_path / "walk.onnx"
    path.write_bytes(content(2)[:-9000] if broken is None else broken)
    for _ in range(4):
        shelf.scan()
    assert identities(shelf) == [f"walk@{old}"]
    (fault,) = shelf.reloads.faults
    assert (fault.name, fault.version, fault.error.path) == ("walk", "", str(path))
    assert (shelf.reloads.failed, shelf.reloads.opened) == (1, 1)
    assert shelf.reloads.last_error == str(fault.error)
    assert [record.getMessage() for record in caplog.records] == [str(fault.error)]
    new = put("walk.onnx", 3)
    followed(shelf)
    assert identities(shelf) == [f"walk@{new}"]
    assert shelf.reloads.faults == () and shelf.reloads.last_error == str(fault.error)


def test_older_versions_are_bounded_and_the_oldest_goes(put, tmp_path):
    digests = [put("walk.onnx", 0)]
    shelf = ReloadingRegistry([tmp_path], VersionLimits(older=2))
    for number in (1, 2, 3):
        digests.append(put("walk.onnx", number))
        followed(shelf)
    held = [m.session.digest for m in shelf.registry.versions("walk")]
    assert held == digests[:0:-1]
    with pytest.raises(UnknownModel) as caught:
        shelf.registry.find(f"walk@{digests[0]}")
    said = ", ".join(f"walk@{digest}" for digest in held)
    assert caught.value.message == f"no model 'walk@{digests[0]}'; there are {said}"


def test_older_versions_are_bounded_by_memory_the_furthest_from_newest_first(put, tmp_path):
    for name in ("run.onnx", "walk.onnx"):
        put(name, 0)
    one = ReloadingRegistry([tmp_path], ROOM).registry.find("walk").session.memory
    shelf = ReloadingRegistry([tmp_path], VersionLimits(older=5, memory=3 * one))
    for number in (1, 2):
        runs, walks = put("run.onnx", number), put("walk.onnx", number)
        followed(shelf)
    assert len(shelf.registry.older) == 3
    assert [len(shelf.registry.versions(name)) for name in ("run", "walk")] == [3, 2]
    assert identities(shelf) == [f"run@{runs}", f"walk@{walks}"]
    without = ReloadingRegistry([tmp_path], VersionLimits(memory=0))
    put("run.onnx", 3)
    assert followed(without).older == ()


def test_what_is_held_no_longer_is_freed(put, tmp_path):
    put("walk.onnx", 1)
    shelf = ReloadingRegistry([tmp_path], VersionLimits(older=0))
    models = [weakref.ref(shelf.registry.find("walk"))]
    for number in (2, 3, 4):
        put("walk.onnx", number)
        followed(shelf)
        models.append(weakref.ref(shelf.registry.find("walk")))
    gc.collect()
    assert [model() is None for model in models] == [True, True, True, False]


def test_a_folder_of_versions_answers_with_the_highest_and_holds_the_next(put, tmp_path):
    digests = {n: put(f"walk/{n}.onnx", n) for n in (2, 10, 9, 1)}
    shelf = ReloadingRegistry([tmp_path], ROOM)
    assert model_registry.load([tmp_path]).find("walk").session.digest == digests[10]
    assert [m.session.digest for m in shelf.registry.versions("walk")] == [
        digests[n] for n in (10, 9, 2)
    ]
    digests[11] = put("walk/11.onnx", 11)
    assert followed(shelf).find("walk").session.digest == digests[11]
    (tmp_path / "walk/11.onnx").unlink()
    after = followed(shelf)
    assert after.find("walk").session.digest == digests[10]
    # Whoever was told of it may ask for it.
    assert after.find(f"walk@{digests[11]}")


def test_versions_as_model_servers_lay_them_out(put, tmp_path):
    old, new = put("walk/2/model.onnx", 2), put("walk/10/model.onnx", 10)
    (tmp_path / "walk/config.pbtxt").write_text('name: "walk"')
    shelf = ReloadingRegistry([tmp_path], ROOM)
    assert [m.session.digest for m in shelf.registry.versions("walk")] == [new, old]


def test_a_deleted_name_goes_with_all_its_versions(put, tmp_path):
    walk, _, run = put("walk.onnx", 1), put("run.onnx", 1), put("run.onnx", 2)
    shelf = ReloadingRegistry([tmp_path], ROOM)
    put("run.onnx", 3)
    followed(shelf)
    (tmp_path / "run.onnx").unlink()
    assert not shelf.scan()
    assert shelf.registry.find("run"), "it may be about to be put back"
    shelf.scan()
    assert identities(shelf) == [f"walk@{walk}"]
    for key in ("run", f"run@{run}"):
        with pytest.raises(UnknownModel):
            shelf.registry.find(key)


def test_a_source_without_any_model_left_keeps_what_it_had(put, tmp_path):
    """A folder that is suddenly empty is a disk that was not mounted."""
    walk = put("models/walk.onnx", 1)
    shelf = ReloadingRegistry([tmp_path / "models"], ROOM)
    shutil.rmtree(tmp_path / "models")
    for _ in range(3):
        shelf.scan()
    assert identities(shelf) == [f"walk@{walk}"]
    (fault,) = shelf.reloads.faults
    assert fault.name == "" and "no .onnx file" in fault.error.message
    assert shelf.reloads.failed == 1


def test_a_link_that_is_turned_is_a_change(put, tmp_path):
    """As Kubernetes does it with what it mounts."""
    put("..1/walk.onnx", 1)
    new = put("..2/walk.onnx", 2)
    for number in (1, 2):
        os.utime(tmp_path / f"..{number}/walk.onnx", (0, 0))
    (tmp_path / "..data").symlink_to("..1")
    (tmp_path / "walk.onnx").symlink_to("..data/walk.onnx")
    shelf = ReloadingRegistry([tmp_path], ROOM)
    (tmp_path / "..turned").symlink_to("..2")
    (tmp_path / "..turned").rename(tmp_path / "..data")
    followed(shelf)
    assert identities(shelf) == [f"walk@{new}"]
