"""Characters of users over HTTP: list, clips, archives and performances, refusals and caching."""

import io
import json
import zipfile

import numpy as np
import pytest
from asking import asker
from user_rigs import glb_rig, stage_positions, usd_rig

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.registry.model_registry import ModelRegistry

SCRIPT = {"segments": [{"kind": "walk", "model": "cmu_walk", "seconds": 1.5}], "fps": 15}
WALK = {"speed": "1.3", "fps": "15"}
CLIP = "/v1/models/cmu_walk/clip"


@pytest.fixture(scope="module")
def folder(shipped_walk, tmp_path_factory):
    made = tmp_path_factory.mktemp("characters")
    usd_rig(made / "hero.usdc", shipped_walk.session.card)
    glb_rig(made / "small.glb", shipped_walk.session.card)
    content = (made / "small.glb").read_bytes()
    (made / "odd.glb").write_bytes(content.replace(b"mixamorig:LeftUpLeg", b"mixamorig:QftQxPzzw"))
    (made / "odd.toml").write_text(
        '[roles]\nleftUpperLeg = "mixamorig:QftQxPzzw"\nrightUpperLeg = "mixamorig:RightUpLeg"\n'
    )
    (made / "broken.usdc").write_bytes(b"no USD")
    (made / "notes.txt").write_text("no character")
    return made


def asked(shipped_walk, folder, **settings):
    settings = Settings(characters=str(folder), **settings)
    return asker(create_app(ModelRegistry({"cmu_walk": shipped_walk}), settings))


@pytest.fixture(scope="module")
def ask(shipped_walk, folder):
    return asked(shipped_walk, folder)


def saved(folder, name, response):
    assert response.status_code == 200, response.text
    (folder / name).write_bytes(response.content)
    return folder / name


def test_the_list_has_the_characters_and_why_files_are_left_out(ask, folder, valid):
    found = ask("GET", "/v1/characters").json()
    valid("CharacterList", found)
    named = {own["name"]: own for own in found["characters"]}
    assert list(named) == ["hero", "odd", "small"]
    assert (named["hero"]["file"], named["hero"]["format"]) == ("hero.usdc", "USD")
    roles = {own["role"]: own for own in named["odd"]["roles"]}
    assert roles["leftUpperLeg"] == {
        "role": "leftUpperLeg",
        "joint": "mixamorig:QftQxPzzw",
        "confidence": 1.0,
    }
    (fault,) = found["faults"]
    assert fault["file"] == "broken.usdc" and "USD" in fault["reason"]
    # Clients do not learn where the folder is.
    assert str(folder) not in json.dumps(found)


def test_without_a_folder_there_are_none(shipped_walk):
    ask = asker(create_app(ModelRegistry({"cmu_walk": shipped_walk}), Settings()))
    assert ask("GET", "/v1/characters").json() == {"characters": [], "faults": []}
    refused = ask("GET", f"{CLIP}.usda", params={**WALK, "character": "hero"})
    assert refused.status_code == 422 and "no characters" in refused.json()["detail"]


def test_a_clip_moves_the_character(ask, folder, valid):
    response = ask("GET", f"{CLIP}.usdc", params={**WALK, "character": "hero"})
    path = saved(folder, "served.usd", response)
    joints, points = stage_positions(path, 5)
    plain = stage_positions(folder / "hero.usdc", 0)[0]
    assert len(points) > 100 and np.abs(joints - plain).max() > 0.1
    document = ask("GET", f"{CLIP}.json", params={**WALK, "character": "hero"}).json()
    valid("Trust", document["trust"])
    told = document["trust"]["retargeting"]
    assert (told["character"], told["file"]) == ("hero", "hero.usdc") and told["skate"] < 0.05
    assert "mixamorig:LeftFoot" in document["names"]
    path.unlink()


@pytest.mark.parametrize(
    ("path", "more", "said"),
    [
        (f"{CLIP}.usdc", {"character": "heros"}, "did you mean 'hero'?"),
        (f"{CLIP}.usdz", {"character": "hero"}, "referred to, not copied"),
        (f"{CLIP}.glb", {"character": "small", "body": "bones"}, "the body is in its file"),
        ("/v1/models/cmu_walk/pose.json", {"character": "hero", "time": "0"}, "character"),
    ],
)
def test_what_cannot_be_served_is_refused(ask, path, more, said):
    known = WALK if "clip" in path else {}
    response = ask("GET", path, params={**known, **more})
    assert response.status_code in (400, 422) and said in response.json()["detail"]
    assert response.headers["content-type"] == "application/problem+json"


def test_archives_move_the_character(ask, folder):
    clips = [
        {"controls": {"speed": speed}, "fps": 15, "name": f"w{n}"}
        for n, speed in enumerate((1.2, 1.4))
    ]
    body = {"format": "usdc", "character": "hero", "clips": clips}
    response = ask("POST", "/v1/models/cmu_walk/clips.zip", json=body)
    assert response.status_code == 200, response.text
    files = zipfile.ZipFile(io.BytesIO(response.content))
    single = ask("POST", f"{CLIP}.usdc", json={**clips[0], "character": "hero"} | {"name": None})
    assert single.status_code == 400  # A clip has no name.
    del clips[0]["name"]
    single = ask("POST", f"{CLIP}.usdc", json={**clips[0], "character": "hero"})
    assert files.read("w0.usdc") == single.content
    lines = files.read("manifest.jsonl").decode().splitlines()
    assert all(json.loads(own)["retargeting"]["character"] == "hero" for own in lines)
    refused = ask("POST", "/v1/models/cmu_walk/clips.zip", json=body | {"character": "x"})
    assert refused.status_code == 422 and "expected one of hero" in refused.json()["detail"]


def test_performances_move_the_character(ask, folder, valid):
    url = "/v1/performances"
    response = ask("POST", f"{url}.usda?character=hero", json=SCRIPT)
    path = saved(folder, "performed.usd", response)
    assert len(stage_positions(path, 10)[1]) > 100
    path.unlink()
    report = ask("POST", f"{url}.json?character=hero", json=SCRIPT).json()["trust"]
    valid("PerformanceReport", report)
    assert report["retargeting"]["file"] == "hero.usdc"
    body = {"format": "usda", "character": "hero", "scripts": [{**SCRIPT, "name": "one"}]}
    archive = ask("POST", f"{url}/batch.zip", json=body)
    assert archive.status_code == 200, archive.text
    assert zipfile.ZipFile(io.BytesIO(archive.content)).read("one.usda") == response.content


def test_the_entity_tag_depends_on_the_characters(ask, shipped_walk, folder, tmp_path):
    url, params = f"{CLIP}.glb", {**WALK, "character": "small"}
    tag = ask("GET", url, params=params).headers["etag"]
    again = ask("GET", url, params=params, headers={"If-None-Match": tag})
    assert again.status_code == 304
    glb_rig(tmp_path / "small.glb", shipped_walk.session.card, 0.81)
    other = asked(shipped_walk, tmp_path)
    changed = other("GET", url, params=params, headers={"If-None-Match": tag})
    assert changed.status_code == 200 and changed.headers["etag"] != tag
    # Without a character, nothing depends on the folder.
    plain = [each("GET", url, params=WALK).headers["etag"] for each in (ask, other)]
    assert plain[0] == plain[1] != tag
