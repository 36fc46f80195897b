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


@pytest.mark.parametrize("key", ["run", "walk@0000000000000000", "walk@x@y"])
def test_what_is_not_there_is_refused_with_what_is(place, key):
    loaded = model_registry.load([place("walk.onnx")])
    with pytest.raises(UnknownModel) as caught:
        loaded.find(key)
    assert caught.value.field == "model"
    assert caught.value.message == f"no model {key!r}; there are {loaded.models['walk'].identity}"


def test_a_folder_gives_all_its_models_and_nothing_else(place):
    place("set/b.onnx")
    folder = place("set/a.onnx").parent
    (folder / "notes.txt").write_text("not a model")
    # What begins with a point is somebody's: a copy under way, Kubernetes' ..data.
    place("set/.c.onnx")
    place("set/..data/c.onnx")
    place("set/deeper/still/c.onnx")
    assert list(model_registry.load([folder]).models) == ["a", "b"]


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"no \.onnx file in this folder") as caught:
        model_registry.load([tmp_path])
    assert caught.value.path == str(tmp_path)


def test_two_files_of_one_stem_are_refused_by_the_second(place):
    first, second = place("one/walk.onnx"), place("two/walk.onnx")
    with pytest.raises(ModelError, match="a second model named 'walk'") as caught:
        model_registry.load([first, second])
    assert caught.value.path == str(second)


@pytest.mark.parametrize("stem", ["Walk", "my walk", "wälk", "a" * 65])
def test_a_stem_that_cannot_stand_in_a_path_is_refused(place, stem):
    path = place(f"{stem}.onnx")
    with pytest.raises(ModelError, match=r"expected \[a-z0-9\]") as caught:
        model_registry.load([path])
    assert caught.value.path == str(path)
    assert repr(stem) in caught.value.message
