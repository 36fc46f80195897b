"""Tests of the README: its examples run in order."""

import re
from pathlib import Path

import pytest
from posefield_client import errors
from posefield_client.errors import Problem

pytestmark = pytest.mark.system

ROOT = Path(__file__).parents[3]
README = ROOT / "clients/python/README.md"
ADDRESS = "http://localhost:8000"


def examples(readme=README):
    return re.findall(r"^```python\n(.*?)^```", readme.read_text(), re.DOTALL | re.MULTILINE)


def test_every_example_runs(address, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    for example in examples():
        exec(compile(example.replace(ADDRESS, address), "README.md", "exec"), names)
    for each in ("client", "patient", "once", "more", "none"):
        names[each].close()
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {
        *(
            "clip.usdc",
            "clip.glb",
            "performance.usdc",
            "performances.zip",
            "crowd.usdz",
            "clips.zip",
            "later.usdc",
        )
    }
    said = capsys.readouterr().out
    assert "bytes" in said
    assert "turn" in said
    assert "no answer" not in said


def test_the_table_says_what_is_asked_again():
    rows = re.findall(r"^\| (`.*?) \|.*\| (yes)? ?\|$", README.read_text(), re.MULTILINE)
    told = {name: bool(again) for cell, again in rows for name in re.findall(r"`(\w+)`", cell)}
    assert {"Busy", "Unexpected", "TimedOut", "InternalError"} <= set(told)
    assert told == {name: getattr(errors, name).again for name in told}
    assert all(issubclass(getattr(errors, name), errors.PosefieldError) for name in told)
    assert Problem.again is False
