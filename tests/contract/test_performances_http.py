"""Performances over HTTP: bad scripts are problems that name their place in the script."""

import bad_scripts

from posefield.encode import formats

ADDRESS = "/v1/performances.json"


def assert_problem(answer, status):
    assert answer.status_code == status, answer.text[:300]
    assert answer.headers["content-type"] == "application/problem+json"
    return answer.json()


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


def test_segments_are_a_layout_of_usd(ask):
    script = bad_scripts.walk()
    for form in formats.SEGMENTED:
        whole, parts = (
            ask("POST", f"/v1/performances.{form}?layout={layout}", json=script)
            for layout in ("whole", "segments")
        )
        assert whole.status_code == parts.status_code == 200
        assert (b"Segments" in parts.content) is (form == "usda")
        assert b"Segments" not in whole.content and parts.content != whole.content
        assert whole.content == ask("POST", f"/v1/performances.{form}", json=script).content
