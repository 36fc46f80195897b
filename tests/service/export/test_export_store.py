"""Tests of exports to an S3 object store in a separate process."""

import exporting
import pytest
import stores

from posefield.batch import process_pool, run
from posefield.batch.store_target import StoreTarget
from posefield.common.errors import FileError
from posefield.registry import object_store

pytestmark = [pytest.mark.system, pytest.mark.usefixtures("store_environment")]

ROWS = 30


@pytest.fixture
def bucket(store, request):
    """URL of a place in a bucket of the test's own."""
    return f"s3://{stores.bucket(store, request.node.name)}/exports/first"


@pytest.fixture(scope="module")
def source():
    return exporting.queries(ROWS)


@pytest.fixture(scope="module")
def local(source, model_path, tmp_path_factory):
    """Content of the same export to a folder, by layout."""

    def of(layout):
        folder = tmp_path_factory.mktemp(layout)
        work = exporting.work(model_path, source, folder, layout=layout)
        run.run(work, source, exporting.Recorder())
        return exporting.content(folder)

    return {layout: of(layout) for layout in ("folder", "tar")}


def content(url):
    """Bytes of every object under a URL, by path."""
    store = StoreTarget(url)
    return {path: store.read(path) for path in paths(url)}


def paths(url):
    """Path of every object under a URL."""
    import obstore

    return [meta["path"] for batch in obstore.list(object_store.connect(url)) for meta in batch]


@pytest.mark.parametrize("layout", ["folder", "tar"])
def test_a_store_gets_what_a_folder_would(layout, source, model_path, bucket, local):
    work = exporting.work(model_path, source, bucket, layout=layout)
    outcome = run.run(work, source, exporting.Recorder(), process_pool.runner(2))
    assert outcome.done == ROWS
    assert content(bucket) == local[layout]


def test_what_was_stopped_goes_on_in_a_store(source, model_path, bucket, local):
    work = exporting.work(model_path, source, bucket)
    run.run(work, source, exporting.Recorder(2))
    assert "manifest.jsonl" not in paths(bucket)
    watch = exporting.Recorder()
    run.run(work, source, watch)
    assert watch.begun == (ROWS, 16)
    assert content(bucket) == local["folder"]
    assert run.run(work, source, watch).already_complete


def test_a_bucket_that_there_is_not_is_named(source, model_path):
    work = exporting.work(model_path, source, "s3://nowhere/at/all")
    with pytest.raises(FileError, match=r"^s3://nowhere/at/all: cannot be written or read"):
        run.run(work, source, exporting.Recorder())


def test_a_file_is_created_once(bucket):
    store = StoreTarget(bucket)
    assert store.create("a", b"1")
    assert not store.create("a", b"2")
    assert store.read("a") == b"1"


def test_a_large_file_goes_in_pieces_and_what_breaks_off_is_not_there(bucket):
    store = StoreTarget(bucket)
    store.stream("large", (bytes([n]) * 1_000_000 for n in range(20)))
    assert store.read("large")[::1_000_000] == bytes(range(20))

    def broken():
        yield bytes(9_000_000)
        raise KeyError("no more")

    with pytest.raises(KeyError):
        store.stream("broken", broken())
    assert store.read("broken") is None
