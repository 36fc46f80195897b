"""Tests of `posefield export --character`: all clips for the character of another file."""

import json

import exporting
import pytest
from user_rigs import glb_rig, stage_positions, usd_rig

from posefield.registry import model_registry

SPEEDS = (1.1, 1.3, 1.5)


@pytest.fixture(scope="module")
def card(shipped_walk):
    return shipped_walk.session.card


@pytest.fixture(scope="module")
def rigs(card, tmp_path_factory):
    folder = tmp_path_factory.mktemp("characters")
    usd_rig(folder / "hero.usdc", card)
    glb_rig(folder / "small.glb", card)
    return folder


@pytest.fixture(scope="module")
def controls(card):
    """Controls of each clip."""
    usual = {control.name: control.default for control in card.controls}
    return [usual | {"speed": speed} for speed in SPEEDS]


@pytest.fixture
def table(controls, tmp_path):
    """Path of a table of three clips in three formats."""
    path = tmp_path / "queries.jsonl"
    forms = zip(controls, ("usda", "glb", "json"), strict=True)
    rows = [own | {"format": form, "name": form} for own, form in forms]
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    return path


@pytest.fixture
def export(posefield, table):
    """Function that exports the table; gives exit code, output and errors."""
    model = model_registry.SHIPPED_FOLDER / "cmu_walk.onnx"

    def run(*words):
        return posefield("export", model, table, "--fps", "15", "--workers", "1", *words)

    return run


def test_each_file_is_that_of_a_single_clip(export, posefield, controls, rigs, tmp_path):
    whom = ("--character", rigs / "hero.usdc")
    code, _, err = export("-o", tmp_path / "made", *whom)
    assert code == 0, err
    single = tmp_path / "one" / "clips" / "000"
    single.mkdir(parents=True)
    for own, form in zip(controls, ("usda", "glb", "json"), strict=True):
        asked = [word for name, value in own.items() for word in ("-c", f"{name}={value!r}")]
        words = (model_registry.SHIPPED_FOLDER / "cmu_walk.onnx", *asked, "--fps", "15", *whom)
        assert posefield("clip", *words, "-o", single / f"{form}.{form}")[0] == 0
    made = tmp_path / "made" / "clips" / "000"
    assert exporting.content(made) == exporting.content(single)
    # The reference is right from the folder of the clips.
    assert len(stage_positions(made / "usda.usda", 3)[1]) > 100
    for line in exporting.lines(tmp_path / "made" / "manifest.jsonl"):
        assert line["retargeting"]["character"] == "hero" and line["retargeting"]["scale"] > 1.1


def test_an_export_is_of_one_character(export, rigs, card, tmp_path):
    """Shards resume it with the same file; a changed file is another export, told before work."""
    hero = tmp_path / "hero.glb"
    glb_rig(hero, card)
    words = ("-o", tmp_path / "made", "--character", hero, "--chunk", "1")
    assert export(*words, "--shard", "0/3")[0] == 0
    before = exporting.content(tmp_path / "made")
    glb_rig(hero, card, 0.7)
    code, _, err = export(*words)
    assert code != 0 and "holds another export, whose character differ" in err
    assert exporting.content(tmp_path / "made") == before
    glb_rig(hero, card)
    code, _, err = export(*words)
    assert (code, err) == (0, "resumed: 1 of 3 clips were finished\n")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--layout", "tar"], "layout: 'tar' with a character, expected 'folder'"),
        (["-o", "s3://bucket/made"], "character: given with a URL as output, expected a folder"),
        (["--unit", "m"], "unit: 'm', expected none given: the layer has the unit, 0.01 m"),
    ],
)
def test_what_has_no_character_is_refused(export, rigs, tmp_path, words, said):
    made = tmp_path / "made"
    code, _, err = export("-o", made, "--character", rigs / "hero.usdc", *words)
    assert code != 0 and said in err, err
    assert not made.exists()
