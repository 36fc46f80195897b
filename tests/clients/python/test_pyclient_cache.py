"""Tests of the client's cache: freshness, revalidation and limits."""

import time

import pytest
import scripted
import serving
from posefield_client import NEVER, Client, errors
from posefield_client.wire import Cache, Reply
from scripted import answer

TAG = '"0123456789abcdef0123456789abcdef"'
IMMUTABLE = "public, max-age=31536000, immutable"
REASONS = (
    b'{"model": "reach@0123456789abcdef", "controls": {}, "performer": null, "warnings": [],'
    b'"nearest": [], "others": {"count": %d, "weight": 1.0}}'
)


def reasons(count=0, control="public, no-cache", tag=TAG):
    return answer(REASONS % count, Cache_Control=control, ETag=tag)


def unchanged(control="public, no-cache"):
    return answer(b"", status=304, ETag=TAG, Cache_Control=control)


@pytest.mark.parametrize(
    ("answers", "counts", "tags"),
    [
        # Under a name the service is asked whether the answer is still right.
        ([reasons(5), unchanged()], [5, 5], [None, TAG]),
        ([reasons(5, "max-age=100, no-cache"), reasons(6)], [5, 6], [None, TAG]),
        ([reasons(5, "public, max-age=60")], [5, 5], [None]),
        ([reasons(5, "no-store"), reasons(6, "no-store")], [5, 6], [None, None]),
    ],
)
def test_a_second_question_is_answered_as_the_headers_say(answers, counts, tags):
    with scripted.serving(*answers) as server, Client(server.address) as client:
        asked = [client.model("reach").why(turn=1).others.count for _ in range(2)]
    assert asked == counts
    assert [headers.get("if-none-match") for _, headers, _ in server.asked] == tags


def test_a_fresh_answer_is_asked_for_again_when_its_time_is_over(monkeypatch):
    now = [1000.0]
    monkeypatch.setattr(time, "time", lambda: now[0])
    answers = [reasons(5, "max-age=60"), unchanged("max-age=60")]
    with scripted.serving(*answers) as server, Client(server.address) as client:
        for now[0], count in ((1000.0, 1), (1059.0, 1), (1061.0, 2), (1120.0, 2)):
            assert client.model("reach").why(turn=1).others.count == 5
            assert len(server.asked) == count


@pytest.mark.parametrize(
    "wrong", [answer(b"", "text/plain", 404), answer(b"{}", ETag=TAG, Cache_Control="max-age=60")]
)
def test_an_error_is_not_kept(wrong):
    with scripted.serving(wrong, answer(b"{}"), reasons(7)) as server:
        with Client(server.address, retry=NEVER) as client:
            with pytest.raises(errors.Unexpected):
                client.model("reach").why(turn=1)
            assert client.model("reach").why(turn=1).others.count == 7
    assert [h.get("if-none-match") for _, h, _ in server.asked] == [None] * 3


def test_the_least_recently_used_go_first_and_large_ones_are_not_kept():
    cache = Cache(1000)
    headers = {"etag": TAG, "cache-control": IMMUTABLE}
    for name in "abcdefghij":
        cache.keep(name, Reply(200, headers, bytes(125)))
        assert cache.find("a") is not None
    kept = [name for name in "abcdefghij" if cache.find(name) is not None]
    assert kept == list("adefghij")
    cache.keep("large", Reply(200, headers, bytes(126)))
    assert cache.find("large") is None


@pytest.mark.system
def test_the_real_service_is_asked_once_under_a_hash(models, controls):
    with serving.process(models) as child:
        with Client(serving.address(child), retry=NEVER) as client:
            model = client.model(client.model("reach").card.identity)
            pose = model.pose(0, **controls)
            child.terminate()
            child.wait(20)
            again = model.pose(0, **controls)
    assert again.rotations.tobytes() == pose.rotations.tobytes()
    assert again.trust == pose.trust
