"""Tests of people on tracks over HTTP: bytes of the command, refusals and limits."""

import json

import numpy as np
import pytest
from asking import asker
from typer.testing import CliRunner

import posefield
from posefield.cli import app as command
from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.http.track_operations import TRACK_FORMATS
from posefield.registry.model_registry import ModelRegistry

PATH = "/v1/models/cmu_walk/tracks"
ANNA = {"id": "anna", "times": [0, 0.5, 1], "positions": [[0, 0], [0.6, 0], [1.2, 0.1]]}
BEN = {"id": "ben", "times": [0.2, 1], "positions": [[3, 0], [3, 1]]}


@pytest.fixture(scope="module")
def walks():
    model = posefield.load("cmu_walk").synthesizer
    return ModelRegistry({"cmu_walk": model})


@pytest.fixture(scope="module")
def query(walks):
    return asker(create_app(walks, Settings()))


@pytest.mark.parametrize("ending", TRACK_FORMATS)
def test_the_bytes_are_those_of_the_command(ending, query, tmp_path):
    table, output = tmp_path / "street.csv", tmp_path / f"street.{ending}"
    rows = [
        f"{time},{person['id']},{x},{y}"
        for person in (ANNA, BEN)
        for time, (x, y) in zip(person["times"], person["positions"], strict=True)
    ]
    table.write_text("\n".join(["time,id,x,y", *rows]))
    words = ["crowd", "cmu_walk", "--trajectories", str(table), "--take", "index", "-o"]
    outcome = CliRunner().invoke(command, [*words, str(output)])
    assert outcome.exit_code == 0, outcome.output
    body = {"tracks": [ANNA, BEN], "take": "index"}
    answer = query("POST", f"{PATH}.{ending}", json=body)
    assert answer.status_code == 200, answer.text
    assert answer.content == output.read_bytes()
    assert ("_gt_380.osi" in answer.headers["Content-Disposition"]) == (ending == "osi")
    arrays = [{**one, "times": np.array(one["times"])} for one in (ANNA, BEN)]
    posefield.load("cmu_walk").crowd(tracks=arrays, take="index").save(output)
    assert answer.content == output.read_bytes()
    other = query("POST", f"{PATH}.{ending}", json={**body, "take": 0})
    assert other.content != answer.content


@pytest.mark.parametrize(
    ("change", "pointer", "text"),
    [
        ({"times": [0, 0.5, 0.4]}, "/tracks/1/times/2", "goes back from 0.5 s to 0.4 s"),
        ({"positions": [[0, 0], [0.6, 0], [90, 0]]}, "/tracks/1/positions/2", "jumps 89.40 m"),
        ({"positions": [[0, 0], [0.6, 0]]}, "/tracks/1/positions", "expected 3 as in times"),
        ({"headings": [0, 0, 90]}, "/tracks/1/headings/2", "heading 90 radians, 5156.62 deg"),
        ({"id": "ben"}, "/tracks/1/id", "expected another than that of tracks/0"),
        ({"times": [], "positions": []}, "/tracks/1/times", "no sample"),
    ],
)
def test_a_track_that_cannot_be_walked_is_refused_with_its_sample(change, pointer, text, query):
    answer = query("POST", f"{PATH}.npz", json={"tracks": [BEN, {**ANNA, **change}]})
    assert answer.status_code == 422
    (fault,) = answer.json()["errors"]
    assert fault["pointer"] == pointer and text in fault["detail"]


def test_unusable_people_are_left_out_and_told_if_the_query_says_so(query):
    gone = {**ANNA, "id": "gone", "times": [0, 0.5, 0.4]}
    answer = query("POST", f"{PATH}.npz", json={"tracks": [gone, BEN], "skip_bad": True})
    alone = query("POST", f"{PATH}.npz", json={"tracks": [BEN]})
    assert answer.content == alone.content
    (warning,) = answer.headers.get_list("Posefield-Warning")
    assert json.loads(warning).startswith("person 'gone' left out: sample 2: time goes back")
    none = query("POST", f"{PATH}.npz", json={"tracks": [gone], "skip_bad": True})
    assert none.status_code == 422 and "no usable person among 1" in none.json()["detail"]


def test_mirrored_tracks_are_refused_as_in_files(query):
    angles = np.arange(0.0, 6.0, 0.4)
    ways = np.cumsum([np.cos(angles), -np.sin(angles)], axis=1).T.tolist()
    times = list(range(len(angles)))
    mirrored = {"id": "a", "times": times, "headings": angles.tolist(), "positions": ways}
    answer = query("POST", f"{PATH}.npz", json={"tracks": [mirrored]})
    assert answer.status_code == 422 and "turned over?" in answer.json()["detail"]


def test_people_times_frames_are_limited_before_any_work(walks):
    small = asker(create_app(walks, Settings(crowd_limit=2, crowd_frames=90, crowd_poses=100)))

    def detail(*tracks, **question):
        answer = small("POST", f"{PATH}.osi", json={"tracks": tracks, **question})
        assert answer.status_code == 422
        return answer.json()["detail"]

    far = {"id": "c", "times": [3600, 3601], "positions": [[9, 9], [9, 9]]}
    assert "3 people, expected 1 to 2" in detail(ANNA, BEN, far)
    assert "frames from the first sample to the last, expected at most 90" in detail(ANNA, far)
    assert "124 poses of 2 in 62 frames, expected at most 100" in detail(ANNA, BEN, fps=60)
    bytes_ = Settings(output_limit=64 * 1024)
    answer = asker(create_app(walks, bytes_))("POST", f"{PATH}.osi", json={"tracks": [ANNA]})
    assert answer.status_code == 422 and "bytes of 1 in 32 frames as osi" in answer.json()["detail"]


def test_many_left_out_people_do_not_fill_the_headers(query):
    gone = [{**ANNA, "id": f"p{number}", "times": [0, 2, 1]} for number in range(50)]
    answer = query("POST", f"{PATH}.npz", json={"tracks": [*gone, BEN], "skip_bad": True})
    lines = answer.headers.get_list("Posefield-Warning")
    assert len(lines) == 21 and json.loads(lines[-1]) == "and 30 more"
