"""Tests of `posefield page`: one file with the page and computed answers, without a service."""

import gzip
import html
import json
import re
import shlex
from base64 import b64decode
from pathlib import Path

import pytest

from posefield.cli import command_page
from posefield.common.errors import FileError
from posefield.encode import character_file
from posefield.inference import session
from posefield.question import results

README = Path(__file__).parents[1] / "clients/viewer/README.md"
BANDS_TS = Path(__file__).parents[1] / "clients/viewer/src/bands.ts"
FEW = ("--answers", 1)


def data(path):
    """The tables in a copy, and the bytes after them."""
    found = re.search(r'id="posefield-copy" data-identity="([^"]*)">([^<]*)<', path.read_text())
    assert found is not None
    plain = gzip.decompress(b64decode(found[2]))
    size = int.from_bytes(plain[:4], "little")
    return html.unescape(found[1]), json.loads(plain[4 : 4 + size]), plain[4 + size :]


@pytest.fixture(scope="module")
def copy(styled_path, tmp_path_factory):
    """A copy of the page with few answers."""
    path = tmp_path_factory.mktemp("copy") / "styled.html"
    command_page.page(styled_path, path, 1)
    return path


def test_the_file_holds_the_page_and_the_model(styled_path, copy, tmp_path, posefield):
    code, said, _ = posefield("page", styled_path, "-o", tmp_path / "own.html", "--json", *FEW)
    assert code == 0
    assert (tmp_path / "own.html").read_bytes() == copy.read_bytes()
    opened = session.load(styled_path)
    identity, tables, blocks = data(copy)
    told = json.loads(said)
    assert identity == tables["card"]["identity"] == f"styled@{opened.digest}"
    assert tables["card"]["name"] == opened.card.name
    assert told["bytes"] == copy.stat().st_size
    assert told["answers"] == tables["answers"]["answers"] == 4**2 * 3 * len(opened.card.levels)
    assert told["errors"] == tables["accuracy"]
    last = tables["answers"]["support"]
    body = tables["character"]
    assert body["offset"] == last["offset"] + 2 * last["rows"] * last["columns"]
    assert len(blocks) == body["offset"] + body["size"]
    expected = character_file.character_glb(opened.card.skeleton, identity)
    assert blocks[body["offset"] :] == expected
    before = command_page.VIEWER_PAGE.read_text()
    assert copy.read_text().startswith(before.rpartition("</body>")[0])


def test_the_readmes_example_runs_and_says_how_far_answers_are_off(
    styled_path, tmp_path, posefield, monkeypatch
):
    (command,) = re.findall(r"^posefield (page .*)$", README.read_text(), re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    odd = Path('a "b".onnx')
    odd.write_bytes(styled_path.read_bytes())
    words = [str(odd) if word == "reaching.onnx" else word for word in shlex.split(command)]
    code, said, _ = posefield(*words, *FEW)
    identity, tables, _ = data(Path("reaching.html"))
    assert code == 0
    assert identity == f'a "b"@{session.load(styled_path).digest}'
    answers, worst = tables["answers"]["answers"], 100 * tables["accuracy"]["worst"]
    assert f"interpolated between {answers:,} answers" in said
    assert f"at most {worst:.1f} cm off" in said


def test_a_folder_is_refused(styled_path, tmp_path, posefield):
    code, _, said = posefield("page", styled_path, "-o", tmp_path)
    assert (code, "expected the name of a file" in said) == (3, True)


def test_a_page_that_was_not_built_is_named(tmp_path):
    with pytest.raises(FileError, match=r"viewer/index.html: .*make page"):
        command_page.built_page(tmp_path / "viewer/index.html")


def test_what_is_no_model_is_refused(tmp_path, posefield):
    (tmp_path / "no.onnx").write_bytes(b"no")
    code, _, said = posefield("page", tmp_path / "no.onnx", "-o", tmp_path / "out.html")
    assert (code, (tmp_path / "out.html").exists()) == (3, False)
    assert "no.onnx" in said


def test_the_pages_words_for_bands_name_the_services_limits():
    text = BANDS_TS.read_text()
    limits = [f"{100 * most:g}" for _, most in results.BANDS]
    close, near, rough = limits
    names = [name for name, _ in results.BANDS]
    assert names == ["close", "near", "rough"]
    assert f'close: "up to {close} cm"' in text
    assert f'near: "{close} to {near} cm"' in text
    assert f'rough: "{near} to {rough} cm"' in text
    assert f'guess: "more than {rough} cm"' in text
