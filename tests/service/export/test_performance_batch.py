"""Tests of many scripts: files, manifest, resumption, and scripts at fault."""

import hashlib
import json

import exporting
import pytest

from posefield.batch import scripts as many
from posefield.batch.scripts import PerformanceBatch
from posefield.common.errors import InvalidField


def walk(**more):
    return {"segments": [{"kind": "walk", "model": "walk", "seconds": 1.0}], **more}


def lines(*scripts):
    return "".join(json.dumps(script) + "\n" for script in scripts)


@pytest.fixture
def scripts(tmp_path):
    """A file of three scripts, of which two are named."""
    path = tmp_path / "scripts.jsonl"
    path.write_text(lines(walk(name="slow"), walk(fps=24), walk(name="take", take=3)))
    return path


@pytest.fixture
def batch(models, tmp_path):
    return PerformanceBatch((models,), str(tmp_path / "out"), "bvh")


def test_each_script_has_a_file_and_a_line(batch, scripts, tmp_path):
    told = []
    outcome = many.run(batch, many.read_scripts(scripts), advance=lambda count: told.append(count))
    out = tmp_path / "out"
    found = exporting.lines(out / "manifest.jsonl")
    assert [each["name"] for each in found] == ["slow", "000002", "take"]
    assert sorted(exporting.content(out)) == [
        "manifest.jsonl",
        *(f"performances/{name}.bvh" for name in ("000002", "slow", "take")),
    ]
    for each in found:
        content = (out / each["file"]).read_bytes()
        assert each["sha256"] == hashlib.sha256(content).hexdigest()
        assert each["bytes"] == len(content) and content.startswith(b"HIERARCHY")
        assert each["segments"][0]["kind"] == "walk" and each["warnings"] == []
    assert (found[1]["frames"], found[0]["frames"]) == (25, 31)
    assert outcome.before == 0 and told == [0, 1, 1, 1]
    assert outcome.sentence.startswith("3 performances, 0.")


def test_only_what_changed_is_made_again(batch, scripts, tmp_path):
    out = tmp_path / "out"
    rows = many.read_scripts(scripts)
    many.run(batch, rows)
    whole = exporting.content(out)
    assert many.run(batch, rows).before == 3
    (out / "performances/take.bvh").unlink()
    assert many.run(batch, rows).before == 2
    assert exporting.content(out) == whole
    scripts.write_text(lines(walk(name="slow", fps=60), walk(fps=24)))
    outcome = many.run(batch, many.read_scripts(scripts))
    assert outcome.before == 1 and [each["name"] for each in outcome.entries] == ["slow", "000002"]
    assert exporting.content(out)["performances/slow.bvh"] != whole["performances/slow.bvh"]


def test_all_scripts_at_fault_are_named_and_nothing_is_written(batch, tmp_path):
    path = tmp_path / "scripts.jsonl"
    reech = {"segments": [{"kind": "act", "model": "reech"}]}
    path.write_text(lines(walk(), reech, walk(fps=5000)))
    with pytest.raises(InvalidField) as caught:
        many.run(batch, many.read_scripts(path))
    said = str(caught.value).splitlines()
    assert said[0] == "scripts: 2 that cannot be performed:"
    assert said[1].startswith("  scripts.jsonl:2: segments/0/model: no model 'reech' (did you")
    assert said[2].startswith("  scripts.jsonl:3: fps: 5000 frames/s, expected 1 to ")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (lines(walk(name="a"), walk(name="a")), "name: 'a' is that of scripts.jsonl:1, expected"),
        ("not JSON\n", "scripts.jsonl:1: expected UTF-8 JSON"),
        ("\n\n", "scripts.jsonl has no script, expected at least one"),
    ],
)
def test_scripts_that_cannot_be_read_are_named(tmp_path, text, said):
    path = tmp_path / "scripts.jsonl"
    path.write_text(text)
    with pytest.raises(InvalidField) as caught:
        many.read_scripts(path)
    assert said in str(caught.value)


@pytest.mark.system
def test_processes_give_the_same_bytes(batch, scripts, tmp_path, models):
    rows = many.read_scripts(scripts)
    many.run(batch, rows)
    several = PerformanceBatch((models,), str(tmp_path / "several"), "bvh")
    many.run(several, rows, workers=2)
    assert exporting.content(tmp_path / "several") == exporting.content(tmp_path / "out")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("scripts.jsonl",), "output: none, expected a folder for the files of many scripts"),
        (("scripts.jsonl", "-o", "out", "--workers", 0), "workers: 0, expected 1 or more"),
        (("one.json", "-o", "a.glb", "--format", "glb"), "format: given for one script, expected"),
        (("scripts.jsonl", "-o", "out", "--format", "glb", "--layout", "segments"), "no layouts"),
        (("gone.jsonl", "-o", "out"), "gone.jsonl: No such file or directory, expected scripts"),
    ],
)
def test_options_that_do_not_fit_are_refused(posefield, scripts, monkeypatch, words, said):
    monkeypatch.chdir(scripts.parent)
    (scripts.parent / "one.json").write_text(json.dumps(walk()))
    code, _, told = posefield("perform", *words)
    assert code in (2, 3) and said in told
