"""Test of a family of more than 300 clips, from its files to answers and an adapted model."""

import json
import re
import shutil
import urllib.parse
import urllib.request

import numpy as np
import pytest
import serving

from posefield.inference import session
from posefield_train.adapt import model_reconstruction

pytestmark = pytest.mark.system

CLIPS, INDUCING = 320, 160
AT = ("-c", "stature=1.7", "-c", "hip_height=0.9", "-c", "turn=20", "-c", "target_height=1.2")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Family of 320 clips at eight frames, which tells performers apart."""
    from posefield_train.sample import sample_files

    place = tmp_path_factory.mktemp("large") / "family"
    sample_files.write_family(place, sample_files.samples(CLIPS))
    text = (place / "recipe.toml").read_text()
    text = re.sub(r'(?s)(\[\[controls\]\]\nname = "stature"|\[presets\.).*?\n\n', "", text)
    text = text.replace("frames = 100", "frames = 8")
    settings = '[alignment]\nrounds = 0\n\n[kriging]\nlabel = "performer"\n\n'
    (place / "recipe.toml").write_text(text.replace("[size]", f"{settings}[size]"))
    return place


def test_a_large_family_is_trained_served_explained_and_adapted(posefield, folder, tmp_path):
    path = tmp_path / "large.onnx"
    code, out, _ = posefield("train", folder / "recipe.toml", "-o", path, "--json")
    assert code == 0
    facts = json.loads(out)
    assert facts["clips"] == CLIPS
    assert facts["projected"] == {"clips": CLIPS, "tuned": CLIPS, "inducing": INDUCING}
    assert facts["bytes"] < 350_000
    # The card lists the inducing clips, and counts all.
    opened = session.load(path)
    card = opened.card
    assert (card.samples, len(card.examples), len(card.sources)) == (INDUCING,) * 3
    assert card.provenance["clips"] == CLIPS
    assert card.performers == ("middle", "short", "tall")
    # Weights of the listed clips add up, and give the model's own prediction.
    code, out, _ = posefield("why", path, *AT[2:], "--nearest", INDUCING, "--json")
    assert code == 0
    weights = [clip["weight"] for clip in json.loads(out)["nearest"]]
    assert sum(weights) == pytest.approx(1.0, abs=1e-6)
    bank = model_reconstruction.load(path).adaptable.model.bank
    points = bank.points(np.array([[0.9, 20.0, 1.2]]), np.zeros((1, 3)))
    expected = bank.pose.weights(points) @ bank.pose.values
    assert np.abs(bank.pose.predict(points) - expected).max() < 1e-6
    # Served and exported: the same bytes.
    asked = {"stature": 1.7, "hip_height": 0.9, "turn": 20, "target_height": 1.2}
    made = tmp_path / "made"
    table = tmp_path / "asked.csv"
    table.write_text("hip_height,turn,target_height\n0.9,20,1.2\n")
    assert posefield("export", path, table, "-o", made, "--workers", "1")[0] == 0
    (exported,) = made.rglob("*.usdc")
    del asked["stature"]
    with serving.process(path) as child:
        query = urllib.parse.urlencode(asked)
        url = f"{serving.address(child)}/v1/models/large/clip.usdc?{query}"
        with urllib.request.urlopen(url) as answer:
            assert answer.read() == exported.read_bytes()
    # A new performer from clips of another family.
    clips = tmp_path / "new"
    clips.mkdir()
    rows = (folder / "clips.csv").read_text().splitlines()
    table = ["file,hip_height,turn,target_height"]
    for row in rows[1::80]:
        file, _, _, *controls, _ = row.split(",")
        shutil.copy(folder / file, clips)
        table.append(",".join([file.removeprefix("bvh/"), *controls]))
    (clips / "new.csv").write_text("\n".join(table) + "\n")
    words = ("--performer", "kim", "--unit", 1, "--up", "y", "--licence", "CC0-1.0")
    adapted = tmp_path / "adapted.onnx"
    code, _, _ = posefield(
        "adapt",
        path,
        "--table",
        clips / "new.csv",
        *words,
        "--root-offset",
        "replace",
        "-o",
        adapted,
    )
    assert code == 0
    own = session.load(adapted).card
    assert own.performers == ("kim", "middle", "short", "tall")
    assert own.samples == INDUCING + len(rows[1::80])
    assert own.provenance["clips"] == CLIPS + len(rows[1::80])
