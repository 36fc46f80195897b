"""Tests of damaged model files: refused before onnxruntime reads them."""

import os
from pathlib import Path

import document_pages
import numpy as np
import onnx
import onnxruntime
import pytest
from model_files import numbered, written

from posefield.common.errors import ModelError
from posefield.model_file import checked_file
from posefield.registry import model_registry

DAMAGED = 500


@pytest.fixture(scope="module")
def content(labelled_path):
    return labelled_path.read_bytes()


def refusal(content):
    with pytest.raises(ModelError) as caught:
        checked_file.load_card(content, "some.onnx")
    assert caught.value.path == "some.onnx"
    assert "\n" not in caught.value.message
    return caught.value.message


def test_a_good_file_passes(content):
    card = checked_file.load_card(content, "some.onnx")
    assert checked_file.load_card(numbered(content, 7), "other").name == card.name


def flipped(content, rng):
    """One bit."""
    damaged = bytearray(content)
    damaged[rng.integers(len(content))] ^= 1 << rng.integers(8)
    return bytes(damaged)


def cut(content, rng):
    """A piece is missing, at the end or within."""
    start = rng.integers(len(content))
    end = len(content) if rng.random() < 0.5 else rng.integers(start, len(content)) + 1
    return content[:start] + content[end:]


def spliced(content, rng):
    """A piece stands in place of another."""
    size = rng.integers(1, 2000)
    start, other = rng.integers(0, len(content) - size, 2)
    return content[:start] + content[other : other + size] + content[start + size :]


@pytest.mark.parametrize("damage", [flipped, cut, spliced])
def test_every_damaged_file_is_refused(content, rng, damage):
    tried = 0
    while tried < DAMAGED:
        damaged = damage(content, rng)
        if damaged != content:
            tried += 1
            assert refusal(damaged) == checked_file.NO_CHECKSUM


def test_a_file_that_another_program_has_changed_is_refused(content):
    """As optimizers do it: the same answers, another graph."""
    model = onnx.load_from_string(content)
    model.graph.name = "optimized"
    assert refusal(model.SerializeToString()) == checked_file.NO_CHECKSUM
    model.metadata_props.add(key="optimizer", value="1.0")
    assert refusal(model.SerializeToString()) == checked_file.NO_CHECKSUM


@pytest.mark.parametrize("found", [b"", b"no model", bytes(range(256)) * 8, b"\0" * 4096])
def test_something_else_is_refused(found):
    assert refusal(found) == checked_file.NO_CHECKSUM
    assert refusal(checked_file.append_checksum(found)) != checked_file.NO_CHECKSUM


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda m: m.graph.node.add(op_type="Loop"),
            "its graph has an operator 'Loop', which posefield does not use",
        ),
        (
            lambda m: setattr(entry(m, "rate"), "value", "null"),
            "its card's entry 'rate' is wrong: Expected `float`, got `null`",
        ),
        (
            lambda m: setattr(entry(m, "labels"), "value", "[]"),
            "its card's kriging.labels has 1 entries, expected 0",
        ),
    ],
)
def test_a_checksum_does_not_make_a_wrong_file_right(content, change, said):
    model = onnx.load_from_string(content)
    change(model)
    assert refusal(written(model)) == said


def entry(model, key):
    return next(prop for prop in model.metadata_props if prop.key == f"posefield.{key}")


def test_a_graph_without_the_values_that_corrections_need_is_refused(content):
    model = onnx.load_from_string(content)
    for node in model.graph.node:
        for names in (node.input, node.output):
            names[:] = ["other" if name == "coefficients" else name for name in names]
    assert refusal(written(model)) == "its graph computes no value 'coefficients', expected one"


def unreadable(path):
    with pytest.raises(ModelError) as caught:
        checked_file.read(path)
    return caught.value.message


def test_what_is_no_file_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.onnx")
    (tmp_path / "endless.onnx").symlink_to("/dev/zero")
    for name in ("pipe", "endless"):
        assert unreadable(tmp_path / f"{name}.onnx") == "cannot be read: not a regular file"
    assert unreadable(tmp_path) == "cannot be read: Is a directory"
    assert unreadable(tmp_path / "none.onnx") == "cannot be read: No such file or directory"


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    path = tmp_path / "large.onnx"
    with path.open("wb") as file:
        # It takes no room on the disk.
        file.truncate(100 << 30)
    said = "cannot be read: 107374182400 bytes, expected at most 67108864"
    assert unreadable(path) == said
    assert "expected at most 67108864" in refusal(bytes(checked_file.MAX_BYTES + 1))


@pytest.mark.parametrize(("name", "level"), [(None, 0), (3, 0), (3, 2)])
def test_the_manuals_file_for_other_engines_has_all_inputs(name, level, tmp_path, monkeypatch):
    (tmp_path / "models").mkdir()
    shipped = model_registry.SHIPPED_FOLDER / "cmu_walk.onnx"
    monkeypatch.chdir(tmp_path)
    Path("models/cmu_walk.onnx").write_bytes(shipped.read_bytes())
    page = (document_pages.DOCS / "reference/model-file.md").read_text()
    exec(next(own.text for own in document_pages.blocks(page) if "import onnx\n" in own.text))
    labels = np.zeros((1, 15), "f4")
    labels[0, [] if name is None else name] = 1.0
    plain = {"controls": np.array([[1.2, 0, 1.38]], "f4"), "time": np.array([[0, 0.5]], "f4")}
    asked = {**plain, "labels": labels, "level": np.array(level)}
    own, other = (
        onnxruntime.InferenceSession(file)
        for file in ("models/cmu_walk.onnx", "cmu_walk_inputs.onnx")
    )
    assert {port.name for port in other.get_inputs()} == set(asked)
    expected = own.run(None, plain if (name, level) == (None, 0) else asked)
    assert all(map(np.array_equal, other.run(None, asked), expected))
