"""Comparison of archives over HTTP with `posefield export` for the same clips."""

import json

import pytest
from asking import unpacked
from typer.testing import CliRunner

from posefield.cli import app as commands

QUESTIONS = [
    {"name": "first", "fps": 24.0, "start": 0.1},
    {"performer": "tall", "level": 1},
    {"end": 0.4, "extrapolate": "refuse"},
]


@pytest.fixture
def exported(models, controls, tmp_path):
    """Files by name and lines of the manifest that the command writes."""

    def run(extension):
        table = tmp_path / "queries.jsonl"
        table.write_text("".join(json.dumps({**controls, **q}) + "\n" for q in QUESTIONS))
        target = tmp_path / "target"
        model = str(models / "reach.onnx")
        command = ["export", model, str(table), "-o", str(target), "--format", extension]
        done = CliRunner().invoke(commands, command)
        assert done.exit_code == 0, done.output
        files = {path.name: path.read_bytes() for path in target.rglob(f"clips/*/*.{extension}")}
        return files, (target / "manifest.jsonl").read_bytes()

    return run


@pytest.mark.parametrize(("kind", "extension"), [("zip", "usdc"), ("tar", "bvh"), ("zip", "json")])
def test_both_ways_give_the_same_files_and_say_the_same_of_them(
    kind, extension, ask, exported, controls
):
    # The order of controls is no part of a question.
    backwards = dict(reversed(controls.items()))
    clips = [{"controls": backwards, **question} for question in QUESTIONS]
    body = {"format": extension, "clips": clips}
    found = unpacked(kind, ask("POST", f"/v1/models/reach/clips.{kind}", json=body).content)
    said = found.pop("manifest.jsonl")
    files, manifest = exported(extension)
    assert found == files and len(files) == len(QUESTIONS)
    assert [without_place(line) for line in said.splitlines()] == [
        without_place(line) for line in manifest.splitlines()
    ]


def without_place(line):
    entry = json.loads(line)
    return {key: value for key, value in entry.items() if key != "file"}
