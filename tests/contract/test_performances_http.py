"""Performances over HTTP: bad scripts are problems that name their place in the script."""

import bad_scripts
import pytest
from bad_scripts import REFUSED, UNREADABLE

from posefield.encode import performance_files

ADDRESS = "/v1/performances.json"
JSON = {"content-type": "application/json"}


def assert_problem(answer, status):
    assert answer.status_code == status, answer.text[:300]
    assert answer.headers["content-type"] == "application/problem+json"
    return answer.json()


# One of each kind: all of them are tried in process.
@pytest.mark.parametrize(("scripts", "status"), [(UNREADABLE, 400), (REFUSED, 422)])
def test_a_bad_script_is_a_problem_with_a_pointer(ask, scripts, status):
    document, pointer, words = next(iter(scripts.values()))
    found = assert_problem(ask("POST", ADDRESS, json=document), status)
    assert [own["pointer"] for own in found["errors"]] == [pointer]
    assert words in found["errors"][0]["detail"]
    assert len(found["detail"]) < 1000


def test_a_plan_is_json(ask):
    script = bad_scripts.walk()
    answer = ask("POST", f"{ADDRESS}?plan=true", json=script)
    assert answer.status_code == 200 and answer.json().keys() == {"trust"}
    for address, said in (
        ("/v1/performances.usdc?plan=true", "expected the format json"),
        (f"{ADDRESS}?plan=yes", "expected true or false"),
    ):
        found = assert_problem(ask("POST", address, json=script), 400)
        assert found["errors"][0]["parameter"] == "plan" and said in found["detail"]


@pytest.mark.parametrize(
    ("content", "status"),
    [
        (b'{"segments":[' + b" " * 2_000_000 + b"]}", 413),
        (b"[" * 100_000, 400),
        (b'{"segments":[{"kind":"walk","model":"walk","seconds":NaN}]}', 400),
        (b"\xff", 400),
    ],
    ids=["2 MB", "deep", "NaN", "not UTF-8"],
)
def test_a_body_that_is_no_script_is_a_problem(ask, content, status):
    found = assert_problem(ask("POST", ADDRESS, content=content, headers=JSON), status)
    assert found["detail"]


def test_segments_are_a_layout_of_usd(ask):
    script = bad_scripts.walk()
    for form in performance_files.SEGMENTED:
        whole, parts = (
            ask("POST", f"/v1/performances.{form}?layout={layout}", json=script)
            for layout in ("whole", "segments")
        )
        assert whole.status_code == parts.status_code == 200
        assert (b"Segments" in parts.content) is (form == "usda")
        assert b"Segments" not in whole.content and parts.content != whole.content
        assert whole.content == ask("POST", f"/v1/performances.{form}", json=script).content
