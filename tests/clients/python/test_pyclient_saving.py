"""Tests of saving files: complete or absent after network errors, with progress."""

import asyncio
import io

import pytest
import scripted
from posefield_client import NEVER, AsyncClient, Client, Progress, Retry, errors, saving
from posefield_client.generated import OPERATIONS
from scripted import Pause, answer, chunked

CLIP = OPERATIONS["getClipInFormat"].formats
USDC = "model/vnd.usdc"
EAGER = Retry(first=0.001)


def save(address, path, ask=lambda model: model.clip(turn=1), retry=NEVER, **given):
    with Client(address, retry=retry, checks=False) as client:
        return ask(client.model("reach")).save(path, **given)


CUT = answer(bytes(100_000), USDC)[:-1]


def test_what_was_there_stays_until_the_new_file_is_whole(tmp_path):
    path = tmp_path / "clip.usdc"
    path.write_bytes(b"before")
    with scripted.serving(CUT, answer(b"after", USDC)) as server:
        with pytest.raises(errors.Broken):
            save(server.address, path)
        assert path.read_bytes() == b"before"
        save(server.address, path)
    assert path.read_bytes() == b"after"
    assert list(tmp_path.iterdir()) == [path]


def test_a_cut_clip_is_asked_for_again_from_its_beginning(tmp_path):
    seen = []
    with scripted.serving(CUT, answer(b"whole", USDC)) as server:
        saved = save(server.address, tmp_path / "clip.usdc", retry=EAGER, progress=seen.append)
    assert (tmp_path / "clip.usdc").read_bytes() == b"whole"
    assert saved.bytes == 5
    assert seen[0].received > 5
    assert seen[-1] == Progress(5, 5)


def test_whoever_is_cancelled_leaves_nothing(tmp_path):
    async def begin(address):
        async with AsyncClient(address) as client:
            clip = client.model("reach").clip(turn=1)
            task = asyncio.create_task(clip.save(tmp_path / "clip.usdc", progress=seen.append))
            while not seen:
                await asyncio.sleep(0.01)
            assert len(list(tmp_path.iterdir())) == 1
            task.cancel()
            await asyncio.wait([task])
            assert task.cancelled()

    seen = []
    with scripted.serving([answer(bytes(100_000), USDC)[:-1], Pause(0.3)]) as server:
        asyncio.run(begin(server.address))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["clip.fbx", "clip", ".usdc"])
def test_another_ending_names_those_that_there_are(name, tmp_path):
    with pytest.raises(errors.WrongQuestion) as caught:
        save("http://127.0.0.1:1", tmp_path / name)
    assert str(caught.value).endswith(f", expected one of {', '.join(CLIP)}")


def test_what_was_chosen_and_what_is_missed_come_with_the_file(address, controls, tmp_path):
    given = {name: value for name, value in controls.items() if name != "hip_height"}
    far = {"joint": "RightHand", "position": (0, 1, 9), "at": "end"}
    high = {"joint": "Head", "position": (0, 9, 0), "at": "start"}
    held = {**given, "targets": [far, high]}
    saved = save(address, tmp_path / "clip.bvh", lambda model: model.clip(**held))
    with Client(address) as client:
        trust = client.model("reach").pose(0, **held).trust
    assert saved.inferred == {"hip_height": trust.controls["hip_height"]}
    assert [(each.what, each.unit) for each in saved.missed] == [
        (met.what, met.unit) for met in trust.targets
    ]
    assert [each.miss for each in saved.missed] == pytest.approx([m.miss for m in trust.targets])
    plain = save(address, tmp_path / "plain.bvh", lambda model: model.clip(**controls))
    assert (plain.inferred, plain.missed) == ({}, ())
    assert len({saved, plain}) == 2


@pytest.fixture(scope="module", params=["zip", "tar"])
def archive(request, address, controls):
    """An archive of three clips, and its kind."""
    clips = [{"controls": controls, "fps": fps} for fps in (5, 10, 15)]
    with Client(address) as client:
        content = client.model("reach").clips(clips, "bvh").content(request.param)
    return request.param, content


def test_an_archive_that_breaks_off_anywhere_is_seen(archive, rng):
    ending, content = archive
    with Client("http://127.0.0.1:1", checks=False) as client:
        files = client.model("reach").clips([{}] * 3, "bvh").files
        more = client.model("reach").clips([{}] * 4, "bvh").files
    assert len(saving.entries(io.BytesIO(content), ending, files)) == 3
    with pytest.raises(errors.IncompleteAnswer, match="holds 4 files, expected 5"):
        saving.entries(io.BytesIO(content), ending, more)
    # After its last file a tar is but zeros.
    last = len(content) if ending == "zip" else content.rindex(b"}\n")
    for end in [0, 1, last - 1, *rng.integers(0, last, 40)]:
        with pytest.raises(errors.IncompleteAnswer):
            saving.entries(io.BytesIO(content[:end]), ending, files)


def test_an_archive_that_is_not_whole_is_asked_for_again(archive, controls, tmp_path):
    ending, content = archive
    media_type = {"zip": "application/zip", "tar": "application/x-tar"}[ending]
    cut = content[: content.index(b"manifest.jsonl") - (30 if ending == "zip" else 0)]
    path = tmp_path / f"x.{ending}"
    said = [chunked(cut, kind=media_type), chunked(content, kind=media_type)]
    with scripted.serving(*said) as server:
        ask = lambda model: model.clips([{"controls": controls}] * 3, "bvh")  # noqa: E731
        saved = save(server.address, path, ask, EAGER)
    assert path.read_bytes() == content
    assert (len(saved.entries), len(server.asked)) == (3, 2)


@pytest.mark.parametrize("said", [{"Posefield_Warning": '"half'}, {"Posefield_Sigma": "much"}])
def test_headers_that_cannot_be_read_leave_nothing(said, tmp_path):
    said = answer(b"whole", USDC, **said), answer(b"{}")
    with (
        scripted.serving(*said) as server,
        pytest.raises(errors.Unexpected, match="cannot be read"),
    ):
        save(server.address, tmp_path / "clip.usdc")
    assert list(tmp_path.iterdir()) == []
