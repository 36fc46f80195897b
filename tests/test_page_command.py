"""Tests of `posefield page`: a folder with a page of a model that needs no service."""

import gzip
import html
import json
import re
import shlex
from pathlib import Path

import numpy as np
import onnx
import pytest

from posefield.cli import command_page
from posefield.common.errors import FileError
from posefield.inference import session
from posefield.kriging import support

README = Path(__file__).parents[1] / "clients/viewer/README.md"


@pytest.fixture
def web(tmp_path):
    """Parts as `make page` leaves them, small."""
    web = tmp_path / "web"
    (web / "offline").mkdir(parents=True)
    (web / "viewer").mkdir()
    page_text = b"<!doctype html><html><head><title>x</title></head></html>"
    (web / "viewer/index.html").write_bytes(page_text)
    for name in command_page.OFFLINE_FILES:
        plain = name.encode()
        content = gzip.compress(plain) if name.endswith(".gz") else plain
        (web / "offline" / name).write_bytes(content)
    return web


def test_the_folder_holds_the_page_its_parts_and_the_model(model_path, tmp_path, posefield):
    folder = tmp_path / "out"
    code, said, _ = posefield("page", model_path, "-o", folder, "--json")
    assert code == 0
    parts = {name.removesuffix(".gz") for name in command_page.OFFLINE_FILES}
    found = {path.name: path.read_bytes() for path in folder.iterdir()}
    levels = {f"level-{level}.onnx" for level in range(4)}
    assert found.keys() == parts | levels | {"index.html", "model.json", "character.glb"}
    assert json.loads(said)["files"] == {name: len(content) for name, content in found.items()}
    opened = session.load(model_path)
    tables = json.loads(found["model.json"])
    assert tables["card"]["identity"] == f"reaching@{opened.digest}"
    assert tables["card"]["name"] == opened.card.name
    assert found["ort-wasm-simd-threaded.wasm"].startswith(b"\0asm")


def test_the_readmes_example_runs(model_path, tmp_path, posefield, monkeypatch):
    (command,) = re.findall(r"^posefield (page .*)$", README.read_text(), re.MULTILINE)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    Path("reaching.onnx").write_bytes(model_path.read_bytes())
    assert posefield(*shlex.split(command))[0] == 0
    assert Path("folder/index.html").exists()


def test_the_page_names_its_model(model_path, tmp_path, posefield):
    odd = tmp_path / 'a "b".onnx'
    odd.write_bytes(model_path.read_bytes())
    code, said, _ = posefield("page", odd, "-o", tmp_path / "out")
    shown = (tmp_path / "out/index.html").read_text()
    digest = session.load(model_path).digest
    mark = re.search(r"<head><meta ([^>]*)>", shown)
    assert code == 0 and mark is not None
    named = dict(re.findall(r'([a-z-]+)="([^"]*)"', mark[1]))
    assert {name: html.unescape(value) for name, value in named.items()} == {
        "name": "posefield-model",
        "content": "model.json",
        "data-identity": f'a "b"@{digest}',
    }
    assert f"python3 -m http.server --directory {tmp_path / 'out'}" in said


def test_the_same_folder_is_the_same_to_the_byte(model_path, tmp_path, posefield):
    for name in ("one", "two"):
        assert posefield("page", model_path, "-o", tmp_path / name)[0] == 0
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()


def test_parts_are_unpacked_and_the_page_is_marked_and_comes_last(web):
    made = dict(command_page.page_files({"model.json": b"{}"}, "a@0", web))
    assert list(made)[-2:] == ["model.json", "index.html"]
    assert made["ort-wasm-simd-threaded.wasm"] == b"ort-wasm-simd-threaded.wasm.gz"
    assert b'<head><meta name="posefield-model" content="model.json"' in made["index.html"]
    assert b"posefield-model" not in (web / "viewer/index.html").read_bytes()


@pytest.mark.parametrize("part", ["viewer/index.html", "offline/offline.js"])
def test_a_part_that_was_not_built_is_named_and_leaves_no_page(part, web, tmp_path):
    (web / part).unlink()
    with pytest.raises(FileError, match=rf"{part}: .*make page"):
        command_page.write_files(command_page.page_files({}, "a@0", web), tmp_path / "out")
    assert not (tmp_path / "out/index.html").exists()


def test_what_is_no_model_is_refused(tmp_path, posefield):
    (tmp_path / "no.onnx").write_bytes(b"no")
    code, _, said = posefield("page", tmp_path / "no.onnx", "-o", tmp_path / "out")
    assert (code, (tmp_path / "out").exists()) == (3, False)
    assert "no.onnx" in said


def test_levels_have_no_level_and_no_defaults(labelled_path, tmp_path, posefield):
    assert posefield("page", labelled_path, "-o", tmp_path / "out")[0] == 0
    model = onnx.load(tmp_path / "out/level-1.onnx")
    inputs = {value.name for value in model.graph.input}
    constants = {tensor.name: tensor for tensor in model.graph.initializer}
    assert inputs == {"controls", "time", "performer"}
    assert not inputs & constants.keys()
    assert onnx.numpy_helper.to_array(constants["level"]) == 1
    # Negative control: the whole file has defaults.
    whole = onnx.load(labelled_path).graph
    assert {"level", "performer"} <= {tensor.name for tensor in whole.initializer}


def test_the_table_of_support_says_what_the_service_says(model_path):
    card = session.load(model_path).card
    own = support.fit_support(np.array(card.examples))
    table = own.table()
    rng = np.random.default_rng(3)
    points = rng.uniform(own.low - 0.2, own.high + 0.2, (400, len(own.low)))
    found = [evaluated(table, point) for point in points]
    assert found == own.supported(points).tolist()
    assert {True, False} == set(found)


def evaluated(table, point):
    """The formula of the page's support.ts."""
    if not all(low <= x <= high for x, (low, high) in zip(point, table["bounds"], strict=True)):
        return False
    near = np.exp(np.array(table["slopes"]) @ point + table["offsets"])
    squared = sum((x * f - o) ** 2 for x, (f, o) in zip(point, table["scale"], strict=True))
    explained = np.exp(-2 * table["rate"] * squared) * (near @ np.array(table["inverse"]) @ near)
    return bool(1 - explained <= table["limit"])
