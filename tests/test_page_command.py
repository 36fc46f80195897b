"""`posefield page`: a folder that shows a model without a service, whole or not at all."""

import gzip
import json
import re
import shlex
from pathlib import Path

import pytest

from service import page
from service.synthesis import session

README = Path(__file__).parents[1] / "clients/viewer/README.md"


@pytest.fixture
def built(tmp_path, monkeypatch):
    """Parts as `make page` leaves them, small."""
    web = tmp_path / "web"
    (web / "offline").mkdir(parents=True)
    (web / "index.html").write_bytes(b"<!doctype html><html><head><title>x</title></head></html>")
    for name in page.PARTS:
        plain = name.encode()
        content = gzip.compress(plain) if name.endswith(".gz") else plain
        (web / "offline" / name).write_bytes(content)
    monkeypatch.setattr(page, "PAGE", web / "index.html")
    monkeypatch.setattr(page, "OFFLINE", web / "offline")
    return web


def test_the_folder_holds_the_page_its_parts_and_the_model(built, model_path, tmp_path, posefield):
    folder = tmp_path / "out"
    code, said, _ = posefield("page", model_path, "-o", folder, "--json")
    assert code == 0
    parts = {name.removesuffix(".gz") for name in page.PARTS}
    found = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert found.keys() == parts | {"index.html", "reaching.onnx"}
    assert json.loads(said)["files"] == {name: len(content) for name, content in found.items()}
    assert found["reaching.onnx"] == model_path.read_bytes()
    runtime = "ort-wasm-simd-threaded.wasm"
    assert found[runtime] == f"{runtime}.gz".encode()


def test_the_readmes_example_runs(built, model_path, tmp_path, posefield, monkeypatch):
    (command,) = re.findall(r"^posefield (page .*)$", README.read_text(), re.MULTILINE)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    Path("reaching.onnx").write_bytes(model_path.read_bytes())
    assert posefield(*shlex.split(command))[0] == 0
    assert Path("folder/index.html").exists()


def test_the_page_names_its_model(built, model_path, tmp_path, posefield):
    odd = tmp_path / 'a "b".onnx'
    odd.write_bytes(model_path.read_bytes())
    code, said, _ = posefield("page", odd, "-o", tmp_path / "out")
    shown = (tmp_path / "out/index.html").read_text()
    digest = session.load(model_path).digest
    mark = re.search(r"<head><meta ([^>]*)><title>", shown)
    assert code == 0 and mark is not None
    assert mark[1] == (
        'name="posefield-model" content="a%20%22b%22.onnx" '
        f'data-identity="a &quot;b&quot;@{digest}"'
    )
    assert f"python3 -m http.server --directory {tmp_path / 'out'}" in said
    assert "posefield-model" not in (built / "index.html").read_text()


def test_the_same_folder_is_the_same_to_the_byte(built, model_path, tmp_path, posefield):
    for name in ("one", "two"):
        assert posefield("page", model_path, "-o", tmp_path / name)[0] == 0
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()


def test_a_page_that_was_not_built_says_how(built, model_path, tmp_path, posefield):
    (built / "index.html").unlink()
    code, _, said = posefield("page", model_path, "-o", tmp_path / "out")
    assert code == 3
    assert "make page" in said
    assert not (tmp_path / "out").exists()


def test_a_part_that_is_missing_leaves_no_page(built, model_path, tmp_path, posefield):
    (built / "offline/offline.js").unlink()
    code, _, said = posefield("page", model_path, "-o", tmp_path / "out")
    assert code == 3
    assert "offline.js" in said
    assert not (tmp_path / "out/index.html").exists()


def test_what_is_no_model_is_refused(built, tmp_path, posefield):
    (tmp_path / "no.onnx").write_bytes(b"no")
    code, _, said = posefield("page", tmp_path / "no.onnx", "-o", tmp_path / "out")
    assert (code, (tmp_path / "out").exists()) == (3, False)
    assert "no.onnx" in said
