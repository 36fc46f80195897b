"""Tests of the model library: files and folders, by name and by hash."""

import shutil

import pytest

from posefield.common.errors import ModelError, UnknownModel
from posefield.registry import model_registry


@pytest.fixture
def place(model_path, tmp_path):
    """Function that puts a copy of the model somewhere below a folder of its own."""

    def at(name):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(model_path, path)
        return path

    return at


def test_a_model_is_named_by_its_file_and_found_by_name_and_hash(place):
    loaded = model_registry.load([place("walk.onnx")])
    model = loaded.models["walk"]
    assert loaded.find("walk") is model
    assert loaded.find(model.identity) is model
    assert model.identity == f"walk@{model.session.digest}"


@pytest.mark.parametrize("key", ["run", "walk@0000000000000000", "walk@", "", "@", "walk@x@y"])
def test_what_is_not_there_is_refused_with_what_is(place, key):
    loaded = model_registry.load([place("walk.onnx")])
    with pytest.raises(UnknownModel) as caught:
        loaded.find(key)
    assert caught.value.field == "model"
    assert caught.value.message == f"no model {key!r}; there are {loaded.models['walk'].identity}"


def test_a_hash_alone_or_too_short_is_no_name(place):
    loaded = model_registry.load([place("walk.onnx")])
    digest = loaded.models["walk"].session.digest
    for key in (digest, f"walk@{digest[:8]}", f"run@{digest}"):
        with pytest.raises(UnknownModel):
            loaded.find(key)


def test_a_folder_gives_all_its_models_and_nothing_else(place):
    place("set/b.onnx")
    folder = place("set/a.onnx").parent
    (folder / "notes.txt").write_text("not a model")
    # What begins with a point is somebody's: a copy under way, Kubernetes' ..data.
    place("set/.c.onnx")
    place("set/..data/c.onnx")
    place("set/deeper/still/c.onnx")
    assert list(model_registry.load([folder]).models) == ["a", "b"]


def test_files_and_folders_go_together(place):
    loaded = model_registry.load([place("walk.onnx"), place("set/a.onnx").parent])
    assert list(loaded.models) == ["walk", "a"]


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"no \.onnx file in this folder") as caught:
        model_registry.load([tmp_path])
    assert caught.value.path == str(tmp_path)


def test_two_files_of_one_stem_are_refused_by_the_second(place):
    first, second = place("one/walk.onnx"), place("two/walk.onnx")
    with pytest.raises(ModelError, match="a second model named 'walk'") as caught:
        model_registry.load([first, second])
    assert caught.value.path == str(second)


@pytest.mark.parametrize("stem", ["Walk", "my walk", "-walk", "walk.v2", "wälk", "a" * 65, "w@1"])
def test_a_stem_that_cannot_stand_in_a_path_is_refused(place, stem):
    path = place(f"{stem}.onnx")
    with pytest.raises(ModelError, match=r"expected \[a-z0-9\]") as caught:
        model_registry.load([path])
    assert caught.value.path == str(path)
    assert repr(stem) in caught.value.message


@pytest.mark.parametrize("stem", ["w", "walk-2", "2_walks", "a" * 64])
def test_a_stem_that_can_is_a_name(place, stem):
    assert list(model_registry.load([place(f"{stem}.onnx")]).models) == [stem]


def test_a_damaged_file_among_good_ones_is_named(place, tmp_path):
    good, bad = place("set/a.onnx"), tmp_path / "set" / "b.onnx"
    bad.write_bytes(good.read_bytes()[:1000])
    with pytest.raises(ModelError) as caught:
        model_registry.load([good.parent])
    assert caught.value.path == str(bad)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"none\.onnx: cannot be read"):
        model_registry.load([tmp_path / "none.onnx"])
