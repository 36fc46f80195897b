"""Tests of models in an S3 object store in a separate process."""

import pytest
import stores
from model_files import numbered

from posefield.common.errors import ModelError
from posefield.model_file import checked_file
from posefield.registry import model_registry
from posefield.registry.model_registry import ReloadingRegistry, VersionLimits
from posefield.registry.object_store import connect

pytestmark = pytest.mark.usefixtures("store_environment")


@pytest.fixture
def url(store, request):
    """URL of a place in a bucket of the test's own."""
    return f"s3://{stores.bucket(store, request.node.name)}/models"


@pytest.fixture
def put(url, model_path):
    """Function that puts the model of a number under a name; its hash."""
    store, plain = connect(url), model_path.read_bytes()

    def at(name, number):
        content = numbered(plain, number)
        store.put(name, content)
        return checked_file.digest(content)

    return at


def test_models_are_named_as_in_a_folder(put, url):
    put("walk.onnx", 1)
    old, new = put("reach/9.onnx", 2), put("reach/10.onnx", 3)
    put(".hidden.onnx", 4)
    put("notes.txt", 5)
    shelf = ReloadingRegistry([url], VersionLimits())
    assert sorted(shelf.registry.models) == ["reach", "walk"]
    assert [m.session.digest for m in shelf.registry.versions("reach")] == [new, old]
    assert sorted(model_registry.load([f"{url}/"]).models) == ["reach", "walk"]


@pytest.mark.parametrize("ending", ["", "/walk.onnx"])
def test_what_is_put_there_is_followed(ending, put, url):
    old = put("walk.onnx", 1)
    shelf = ReloadingRegistry([url + ending], VersionLimits())
    assert shelf.scan() and shelf.reloads.opened == 1
    new = put("walk.onnx", 2)
    assert not shelf.scan()
    assert shelf.scan()
    assert [m.session.digest for m in shelf.registry.versions("walk")] == [new, old]


def test_a_broken_object_leaves_the_old_one(put, url):
    old = put("walk.onnx", 1)
    shelf = ReloadingRegistry([url], VersionLimits())
    connect(url).put("walk.onnx", b"broken")
    shelf.scan()
    shelf.scan()
    assert shelf.registry.find("walk").session.digest == old
    (fault,) = shelf.reloads.faults
    assert fault.error.path == f"{url}/walk.onnx"


def test_a_bucket_that_is_not_there_is_refused(url):
    with pytest.raises(ModelError, match="cannot be read"):
        model_registry.load(["s3://no-such-bucket-anywhere/models"])
    with pytest.raises(ModelError, match=r"no \.onnx object under this URL"):
        model_registry.load([url])


def test_a_store_that_cannot_be_reached_leaves_what_there_was(model_path, tmp_path, monkeypatch):
    with stores.serving(tmp_path / "said") as address:
        for name, value in stores.told(address).items():
            monkeypatch.setenv(name, value)
        url = f"s3://{stores.bucket(address, 'models')}"
        connect(url).put("walk.onnx", model_path.read_bytes())
        shelf = ReloadingRegistry([url], VersionLimits())
    shelf.scan()
    assert list(shelf.registry.models) == ["walk"]
    (fault,) = shelf.reloads.faults
    assert fault.error.message.startswith("cannot be read: ")
