"""Tests of `posefield adapt`: a model file and new clips give a model with one more performer."""

import json

import newcomers
import numpy as np
import pytest
from typer.testing import CliRunner

import posefield_train
from posefield import cli
from posefield.inference import session
from posefield.model_file import checked_file
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.cli import commands
from posefield_train.graph import onnx_export
from posefield_train.source import canonical

SHOWN = (2.0, 7.0, 12.5)
SAID = ("--performer", "cy", "--unit", "1", "--up", "y", "--licence", "CC0-1.0")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return newcomers.write(tmp_path_factory.mktemp("family") / "small")


@pytest.fixture(scope="module")
def base(folder):
    recipe = newcomers.recipe()
    trained = posefield_train.train(recipe, folder)
    path = folder / "small.onnx"
    posefield_train.export(trained, path)
    return path


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    return newcomers.write_newcomer(tmp_path_factory.mktemp("cy") / "cy", SHOWN)


@pytest.fixture(scope="module")
def adapted(base, table):
    """The file of one adaptation, and what the command says of it."""
    path = base.with_name("new.onnx")
    commands(cli.app)
    words = ("adapt", base, "--table", table, "-o", path, *SAID, "--json")
    done = CliRunner().invoke(cli.app, [*map(str, words)])
    assert done.exit_code == 0, done.output
    return path, json.loads(done.stdout)


def test_the_new_file_says_who_it_knows_and_where_that_comes_from(base, adapted):
    path, facts = adapted
    old, new = (session.load(p).card for p in (base, path))
    assert facts["clips"] == new.samples == old.samples + 3 == len(new.examples)
    assert (old.performers, new.performers) == (("a", "b", "d"), ("a", "b", "cy", "d"))
    whose = [new.performers[i] for i in new.moved_by]
    assert whose == [*(old.performers[i] for i in old.moved_by), "cy", "cy", "cy"]
    assert new.examples[-3:] == tuple((value,) for value in SHOWN)
    assert new.sources[-1] == "2.bvh" and len(new.left_out) == new.samples
    assert len(new.levels) == len(old.levels) and new.skeleton.same_tree(old.skeleton)
    step = new.provenance["adapted"][0]
    assert step["parent_sha256"] == checked_file.sha256(base.read_bytes())
    assert (step["performer"], step["clips"], step["licence"]) == ("cy", 3, "CC0-1.0")
    assert "adapted from small@" not in new.diagnostics["notes"][0]
    assert (
        f"adapted from tiny@{checked_file.digest(base.read_bytes())} to 'cy' by 3 clips"
        in (new.diagnostics["notes"][-1])
    )
    assert 0.0 < facts["parity_m"] < onnx_export.PARITY_LIMIT


def test_the_same_clips_give_the_same_bytes(posefield, adapted, base, table, tmp_path):
    again = tmp_path / "again.onnx"
    assert posefield("adapt", base, "--table", table, "-o", again, *SAID)[0] == 0
    assert again.read_bytes() == adapted[0].read_bytes()


def head(path, who, level=0):
    """Return the head's mean position in a performer's clip."""
    model = Synthesizer("small", session.load(path))
    answer = clips.synthesize_clip(
        model, ClipQuestion(controls={"speed": 4.0}, performer=who, level=level)
    )
    return answer.clip.positions()[:, 2].mean(axis=0)


def test_the_service_answers_for_the_newcomer_at_every_level(adapted):
    path, _ = adapted
    true = newcomers.clip("cy", 4.0)
    expected = canonical.canonicalize(true, False, False)[0].positions()[:, 2].mean(axis=0)
    for number, level in enumerate(session.load(path).card.levels):
        own, other = (np.linalg.norm(head(path, who, number) - expected) for who in ("cy", "a"))
        assert own < 0.02 + 2.0 * level.rms
        # Negative control: by another's name it is somebody else's.
        assert other > 1.5 * own


def test_a_model_can_be_adapted_again(posefield, adapted, tmp_path):
    path, _ = adapted
    other, said = tmp_path / "two.onnx", [*SAID]
    said[1] = "Bo"
    table = newcomers.write_newcomer(tmp_path / "bo", (3.0, 8.0), "b")
    assert posefield("adapt", path, "--table", table, "-o", other, *said)[0] == 0
    card = session.load(other).card
    assert card.performers == ("Bo", "a", "b", "cy", "d")
    assert [step["performer"] for step in card.provenance["adapted"]] == ["cy", "Bo"]
    assert card.diagnostics["notes"][-1].startswith("adapted from tiny@")


def said(**other):
    """The options of an adaptation, some of them others; None: left out."""
    given = {**dict(zip(SAID[::2], SAID[1::2], strict=True)), **other}
    return [word for pair in given.items() if pair[1] is not None for word in pair]


def test_questions_that_cannot_be_meant_and_files_that_cannot_be_used(
    posefield, base, model_path, table, tmp_path
):
    clip, out, broken = table.with_name("0.bvh"), ("-o", tmp_path / "x.onnx"), tmp_path / "b.onnx"
    broken.write_bytes(base.read_bytes()[:-100])
    listed, missing = (("--table", path) for path in (table, tmp_path / "none.csv"))
    for code, words, message in (
        (2, (base, clip, *said(**{"--performer": "a"})), "'a' is known already, as are: a, b, d"),
        (2, (base, clip, *said(**{"--performer": ""})), "expected a name of printable"),
        (2, (base, clip, *said(**{"--performer": "c\u200by"})), "expected a name of printable"),
        (2, (base, clip, *said(**{"--licence": " \t"})), "licence: blank, expected"),
        (2, (base, *SAID), "either motion files or --table"),
        (2, (base, clip, "-o", tmp_path / "x.bin", *SAID), "ends in .onnx"),
        (3, (base, clip, *SAID), "cannot be measured"),
        (2, (base, clip, *said(**{"--unit": "-1"})), "expected a length in metres"),
        (2, (base, clip, *said(**{"--licence": None})), "Missing option '--licence'"),
        (3, (broken, *listed, *SAID), "b.onnx"),
        (3, (base, *missing, *SAID), "none.csv: cannot be read"),
        (4, (base, *listed, *said(**{"--unit": "0.01"})), "in another unit?"),
        (2, (model_path, *listed, *SAID), "tells no performers apart"),
    ):
        found, _, err = posefield("adapt", *words, *(() if "-o" in words else out))
        assert found == code and message in err
    assert not (tmp_path / "x.onnx").exists()
