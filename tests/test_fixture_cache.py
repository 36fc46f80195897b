"""Tests of the fixture cache: one build per digest, and a new digest after a change."""

import subprocess
import sys
import threading
from pathlib import Path

import fixture_cache
import pytest

# Trains the smallest of the models, and prints the project's files that were imported for it.
TRAIN = """
import sys
from pathlib import Path
import fixture_models
from families import sample_walk
from posefield_train import training
from posefield_train.graph import onnx_export
from posefield_train.source import ingest

own = sample_walk.recipe()
found, _ = ingest.ingest(own, sample_walk.write_walk(Path(sys.argv[1])))
onnx_export.export_model(training.train_examples(own, found))
for module in list(sys.modules.values()):
    file = getattr(module, "__file__", None) or ""
    if file.startswith(sys.argv[2]) and "/.venv" not in file:
        print(Path(file).relative_to(sys.argv[2]))
"""


@pytest.fixture
def place():
    """A name under which nothing is kept, before and after."""
    place = fixture_cache.FOLDER / fixture_cache.digest() / f"test-{threading.get_native_id()}"
    yield place
    place.unlink(missing_ok=True)
    place.with_name(f"{place.name}.lock").unlink(missing_ok=True)


@pytest.mark.system
def test_the_digest_covers_every_file_that_training_imports(tmp_path):
    words = [sys.executable, "-c", TRAIN, tmp_path, fixture_cache.ROOT]
    own = {"PYTHONPATH": str(fixture_cache.ROOT / "tests"), "PATH": ""}
    said = subprocess.run(words, env=own, capture_output=True, text=True, check=True).stdout
    imported = {Path(line) for line in said.split()}
    assert Path("model_export/posefield_train/training.py") in imported
    assert imported <= set(fixture_cache.sources(fixture_cache.ROOT))


def test_a_file_is_built_once_by_many_that_want_it_at_once(place):
    built = []

    def build(new):
        built.append(new)
        new.write_bytes(b"whole")

    def ask():
        assert fixture_cache.path(place.name, build).read_bytes() == b"whole"

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(built) == 1 and place.exists() and not built[0].exists()


def test_a_build_that_fails_leaves_nothing_and_is_tried_again(place):
    def broken(new):
        new.write_bytes(b"half")
        raise RuntimeError("interrupted")

    with pytest.raises(RuntimeError, match="interrupted"):
        fixture_cache.path(place.name, broken)
    assert not place.exists()
    fixture_cache.path(place.name, lambda new: new.write_bytes(b"whole"))
    assert place.read_bytes() == b"whole"
