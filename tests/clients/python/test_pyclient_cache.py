"""Tests of the client's cache: freshness, revalidation, and separation by credentials."""

import os
import subprocess
import sys
import time

import pytest
import scripted
import serving
from posefield_client import (
    CONTRACT,
    NEVER,
    NOTHING,
    Client,
    Disk,
    Memory,
    errors,
    questions,
    transport,
)
from posefield_client import cache as caches
from posefield_client.cache import Kept
from posefield_client.exchange import Copy
from scripted import answer

from posefield.http.access import api_keys

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


@pytest.fixture(params=["memory", "disk"])
def cache(request, tmp_path):
    return Memory() if request.param == "memory" else Disk(tmp_path / "cache")


def asked_twice(cache, *answers):
    """The counts that come of two questions, and the entity tags that were sent."""
    with scripted.serving(*answers) as server, Client(server.address, cache=cache) as client:
        found = [client.model("reach").why(turn=1).others.count for _ in range(2)]
    return found, [headers.get("if-none-match") for _, headers, _ in server.asked]


def test_under_a_name_the_service_says_whether_it_is_still_right(cache):
    assert asked_twice(cache, reasons(5), unchanged()) == ([5, 5], [None, TAG])


def test_what_has_changed_is_taken_anew(cache):
    assert asked_twice(cache, reasons(5), reasons(6)) == ([5, 6], [None, TAG])


def test_what_never_changes_is_not_asked_for_again(cache):
    assert asked_twice(cache, reasons(5, IMMUTABLE)) == ([5, 5], [None])


def test_what_holds_for_a_while_is_not_asked_for_meanwhile(cache):
    assert asked_twice(cache, reasons(5, "public, max-age=60")) == ([5, 5], [None])


def test_what_is_still_right_holds_for_another_while(cache):
    held = [reasons(5, "max-age=0"), unchanged("max-age=60")]
    with scripted.serving(*held) as server, Client(server.address, cache=cache) as client:
        for _ in range(3):
            client.model("reach").why(turn=1)
    assert len(server.asked) == 2


def test_what_is_not_to_be_kept_is_not(cache):
    several = [reasons(5, "no-store"), reasons(6, "no-store")]
    assert asked_twice(cache, *several) == ([5, 6], [None, None])


def test_without_an_entity_tag_nothing_is_kept(cache):
    assert asked_twice(cache, reasons(5, tag=None), reasons(6)) == ([5, 6], [None, None])


def test_nothing_is_kept_where_nothing_is_to_be():
    assert asked_twice(NOTHING, reasons(5, IMMUTABLE), reasons(6)) == ([5, 6], [None, None])


def test_an_error_is_not_kept(cache):
    said = [answer(b"", "text/plain", 404), answer(b"{}"), answer(b"{}"), reasons(7, IMMUTABLE)]
    with scripted.serving(*said) as server:
        with Client(server.address, cache=cache, retry=NEVER) as client:
            with pytest.raises(Exception, match="404"):
                client.model("reach").why(turn=1)
            assert client.model("reach").why(turn=1).others.count == 7


@pytest.mark.parametrize("wrong", [answer(b"{}", ETag=TAG), answer(b"x", "text/html", ETag=TAG)])
def test_what_cannot_be_read_is_not_kept(cache, wrong):
    wrong = wrong.replace(b"ETag", b"Cache-Control: max-age=60\r\nETag")
    with scripted.serving(wrong, answer(b"{}"), answer(b"{}"), reasons(7)) as server:
        with Client(server.address, cache=cache, retry=NEVER) as client:
            with pytest.raises(errors.Unexpected):
                client.model("reach").why(turn=1)
            assert client.model("reach").why(turn=1).others.count == 7
    assert [h.get("if-none-match") for _, h, _ in server.asked] == [None] * 4


@pytest.mark.parametrize("until", [0.0, 2.0**40])
def test_what_is_kept_and_cannot_be_read_is_asked_for_anew(cache, until):
    with scripted.serving(reasons(7, IMMUTABLE)) as server:
        with Client(server.address, cache=cache, retry=NEVER) as client:
            target = questions.why("reach", turn=1).request.target
            told = {"content-type": "application/json", "etag": TAG}
            name = caches.name(client.core.scope, target)
            cache.keep(name, Kept(told, b"{}", until))
            found = [client.model("reach").why(turn=1).others.count for _ in range(2)]
    assert found == [7, 7]
    assert [h.get("if-none-match") for _, h, _ in server.asked] == [None]


def test_what_another_contract_said_is_another_answer():
    place = transport.place("http://x", None, 1.0)
    scope = transport.core(place, NEVER, NOTHING).scope
    assert scope == caches.scope(CONTRACT, place.address, "")
    assert scope != caches.scope("9.9.9", place.address, "")


def test_a_question_by_post_is_not_kept(cache):
    with scripted.serving(reasons(1, IMMUTABLE), reasons(2, IMMUTABLE)) as server:
        with Client(server.address, cache=cache) as client:
            many = {f"control_{place:04}": 0.5 for place in range(400)}
            found = [client.model("reach").why(controls=many).others.count for _ in range(2)]
    assert found == [1, 2]
    assert server.lines == ["POST /v1/models/reach/why"] * 2


@pytest.mark.parametrize("other", ["another", None])
def test_what_one_key_was_told_no_other_is(cache, other):
    with scripted.serving(reasons(1, IMMUTABLE), reasons(2, IMMUTABLE)) as server:
        found = []
        for key in ("one", other, "one"):
            with Client(server.address, key, cache=cache) as client:
                found.append(client.model("reach").why(turn=1).others.count)
    assert found == [1, 2, 1]


def test_what_one_service_said_no_other_did(cache):
    found = []
    for count in (1, 2):
        with scripted.serving(reasons(count, IMMUTABLE)) as server:
            with Client(server.address, cache=cache) as client:
                found.append(client.model("reach").why(turn=1).others.count)
    assert found == [1, 2]


def test_no_key_lies_in_the_folder(tmp_path):
    with scripted.serving(reasons(1, IMMUTABLE)) as server:
        with Client(server.address, "geheim", cache=tmp_path / "kept") as client:
            client.model("reach").why(turn=1)
    (file,) = (tmp_path / "kept").iterdir()
    said = file.name.encode() + file.read_bytes()
    assert b"geheim" not in said
    assert file.stat().st_mode & 0o077 == (tmp_path / "kept").stat().st_mode & 0o077 == 0


def test_a_folder_serves_the_next_client_as_well(tmp_path):
    with scripted.serving(reasons(5, IMMUTABLE)) as server:
        for _ in range(2):
            with Client(server.address, cache=tmp_path) as client:
                assert client.model("reach").why(turn=1).others.count == 5


@pytest.mark.parametrize(
    "damage", [lambda c: c[:-1], lambda c: b"", lambda c: c[:20] + b"x" + c[21:]]
)
def test_a_torn_file_is_none(damage, tmp_path):
    cache = Disk(tmp_path)
    kept = Kept({"etag": TAG}, b"content", 0.0)
    cache.keep("name", kept)
    assert cache.find("name") == kept
    file = tmp_path / "name"
    file.write_bytes(damage(file.read_bytes()))
    assert cache.find("name") is None


def test_a_folder_that_cannot_be_written_warns_and_does_no_harm(tmp_path):
    cache = Disk(tmp_path / "kept")
    (tmp_path / "kept").rmdir()
    with pytest.warns(UserWarning, match="cannot be kept in"):
        cache.keep("name", Kept({}, b"content", 0.0))


@pytest.mark.parametrize("make", [Memory, lambda limit: None], ids=["memory", "disk"])
def test_it_keeps_to_its_limit_and_what_was_used_last(make, tmp_path):
    cache = make(10_000) or Disk(tmp_path, 10_000)
    names = [caches.name(b"", str(place)) for place in range(100)]
    for place, name in enumerate(names):
        cache.keep(name, Kept({}, bytes(500), 0.0))
        assert cache.find(names[0]) is not None or place == 0
        time.sleep(0.002)
    found = [place for place, name in enumerate(names) if cache.find(name)]
    assert 0 in found
    assert 99 in found
    assert 5 < len(found) <= 20


def test_what_a_killed_process_left_is_taken_away(tmp_path):
    name = caches.name(b"", "question")
    old, new = tmp_path / f"{name}.{'0' * 12}.part", tmp_path / f"{name}.{'f' * 12}.part"
    for file in (old, new):
        file.write_bytes(b"half")
    os.utime(old, (0, 0))
    Disk(tmp_path, 0).keep(name, Kept({}, b"content", 0.0))
    # Somebody may be writing the new one just now, however little may be kept.
    assert list(tmp_path.iterdir()) == [new]


def test_files_of_others_in_the_folder_stay(tmp_path):
    name = caches.name(b"", "question")
    others = [tmp_path / called for called in ("thesis.txt", "half.part", f"{name}.txt", "a" * 39)]
    for file in others:
        file.write_bytes(b"mine")
        os.utime(file, (0, 0))
    Disk(tmp_path, 0).keep(name, Kept({}, b"content", 0.0))
    assert sorted(tmp_path.iterdir()) == sorted(others)


def test_what_cannot_be_marked_as_used_is_found_all_the_same(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError("read-only")

    cache = Disk(tmp_path)
    cache.keep("name", Kept({}, b"content", 0.0))
    monkeypatch.setattr(os, "utime", refuse)
    assert cache.find("name") is not None


def test_large_answers_are_not_kept(tmp_path, address, controls):
    with Client(address, cache=Disk(tmp_path / "kept", 16 * 1000)) as client:
        client.model("reach").clip(**controls).content("usdc")
        client.model("reach").clip(**controls).save(tmp_path / "clip.usdc")
    assert list((tmp_path / "kept").iterdir()) == []


def test_a_large_answer_of_unknown_length_is_not_held():
    copy = Copy(Anything(), 10)
    copy.begin(None)
    copy.write(bytes(10))
    assert copy.content == bytes(10)
    copy.write(b"x")
    assert copy.content == b""
    copy.begin(None)
    copy.write(b"again")
    assert copy.content == b"again"


class Anything:
    """Sink that takes anything."""

    def begin(self, total):
        """Nothing."""

    def write(self, chunk):
        """Nothing."""


WRITERS = """
import sys
from pathlib import Path
from posefield_client import Disk
from posefield_client.cache import Kept, name as called
cache = Disk(Path(sys.argv[1]), 100_000)
for turn in range(200):
    name = called(b"", str(turn % 40))
    found = cache.find(name)
    assert found is None or found.content == name.encode() * 100, name
    cache.keep(name, Kept({}, name.encode() * 100, 0.0))
"""


@pytest.mark.system
def test_several_processes_share_a_folder(tmp_path):
    command = [sys.executable, "-W", "error", "-c", WRITERS, str(tmp_path)]
    several = [subprocess.Popen(command, stderr=subprocess.PIPE) for _ in range(4)]
    assert [process.communicate(timeout=60)[1] for process in several] == [b""] * 4
    assert not list(tmp_path.glob("*.part"))
    assert sum(file.stat().st_size for file in tmp_path.iterdir()) < 2 * 100_000


@pytest.mark.system
def test_the_real_service_is_asked_once_under_a_hash(models, controls, tmp_path):
    with serving.process(models) as child:
        with Client(serving.address(child), cache=tmp_path, retry=NEVER) as client:
            model = client.model(client.model("reach").card.identity)
            pose, clip = model.pose(0, **controls), model.clip(**controls)
            clip.save(tmp_path / "one.usdc")
            child.terminate()
            child.wait(20)
            again = model.pose(0, **controls)
            clip.save(tmp_path / "two.usdc")
    assert again.rotations.tobytes() == pose.rotations.tobytes()
    assert again.trust == pose.trust
    assert (tmp_path / "one.usdc").read_bytes() == (tmp_path / "two.usdc").read_bytes()


def test_the_real_service_says_that_nothing_changed(address, controls, tmp_path):
    with Client(address) as client:
        model = client.model("reach")
        first = model.clip(**controls).save(tmp_path / "one.usdc")
        again = model.clip(**controls).save(tmp_path / "two.usdc")
    assert (tmp_path / "one.usdc").read_bytes() == (tmp_path / "two.usdc").read_bytes()
    assert (first.sigma, first.model, first.bytes) == (again.sigma, again.model, again.bytes)


@pytest.mark.system
def test_a_key_of_the_real_service_sees_its_own(models):
    one, two = api_keys.generate_key(), api_keys.generate_key()
    told = ";".join(
        [api_keys.line("one", ["read:*"], one), api_keys.line("two", ["read:walk"], two)]
    )
    cache = Memory()
    with serving.process(models, POSEFIELD_KEYS=told) as child:
        place = serving.address(child)
        with Client(place, one, cache=cache) as client:
            name = client.model("reach").card.identity
            client.model(name).read_card()
        with Client(place, two, cache=cache) as client:
            with pytest.raises(Exception, match="No model of that name"):
                client.model(name).read_card()


def test_moments_are_read_from_the_header():
    assert caches.until({"cache-control": "no-cache"}) == 0
    assert caches.until({"cache-control": "max-age=100, no-cache"}) == 0
    assert caches.until({}) == 0
    assert caches.until({"cache-control": "private, max-age=100"}) > time.time() + 90
