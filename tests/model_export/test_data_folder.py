"""Tests of finding motion files in folders and zip files."""

import pickle
import struct
import tracemalloc
import zipfile
import zlib

import pytest

from posefield.common.errors import BvhError, RecipeError
from posefield_train.source import bvh, data_folder

NAME = "takes/bvh/walk.bvh"


def write_zip(path, entries):
    with zipfile.ZipFile(path, "w") as archive:
        for name in entries:
            archive.writestr(name, f"content of {name}")


def text(place):
    return data_folder.read(place, 1000, "a file").decode()


@pytest.fixture(params=["folder", "zip with the top folder", "zip without the top folder"])
def filled(request, tmp_path):
    """A data folder that holds NAME in one of the three ways, and what the file says."""
    if request.param == "folder":
        (tmp_path / NAME).parent.mkdir(parents=True)
        (tmp_path / NAME).write_text("content of a folder")
        return tmp_path, "content of a folder"
    entry = NAME if "without" not in request.param else NAME.partition("/")[2]
    write_zip(tmp_path / "takes.zip", [entry])
    return tmp_path, f"content of {entry}"


def test_a_file_is_found(filled):
    folder, content = filled
    assert text(data_folder.find(folder, NAME)) == content


def test_a_place_can_be_sent_to_another_process(filled):
    folder, content = filled
    place = data_folder.find(folder, NAME)
    sent = pickle.loads(pickle.dumps(place))
    assert (sent, str(sent), sent.name) == (place, str(place), "walk.bvh")
    assert text(sent) == content


def test_what_is_not_there_is_refused_with_every_place_that_was_tried(tmp_path):
    write_zip(tmp_path / "takes.zip", ["bvh/run.bvh"])
    with pytest.raises(RecipeError, match=r"no file 'takes/bvh/walk\.bvh'") as caught:
        data_folder.find(tmp_path, NAME)
    tried = caught.value.message.partition("tried ")[2].split(", ")
    archive = tmp_path / "takes.zip"
    assert tried == [f"{tmp_path / NAME}", f"{archive}/{NAME}", f"{archive}/bvh/walk.bvh"]


@pytest.mark.parametrize("name", ["takes/../../secret.bvh", "/etc/hostname", ""])
def test_paths_that_leave_the_folder_are_refused(tmp_path, name):
    (tmp_path / "data").mkdir()
    (tmp_path / "secret.bvh").write_text("secret")
    with pytest.raises(RecipeError, match="expected a path below the data folder") as caught:
        data_folder.find(tmp_path / "data", name)
    assert repr(name) in caught.value.message


def test_a_zip_entry_cannot_be_reached_by_a_path_that_leaves(tmp_path):
    write_zip(tmp_path / "takes.zip", ["../secret.bvh", "bvh/walk.bvh"])
    with pytest.raises(RecipeError, match="expected a path below"):
        data_folder.find(tmp_path, "takes/../secret.bvh")
    assert text(data_folder.find(tmp_path, NAME)) == "content of bvh/walk.bvh"


def test_members_of_every_method_are_read(tmp_path, method):
    content = b"many words " * 50_000
    with zipfile.ZipFile(tmp_path / "takes.zip", "w", method) as archive:
        archive.writestr(NAME, content)
    place = data_folder.find(tmp_path, NAME)
    assert data_folder.read(place, len(content), "a file") == content
    with pytest.raises(RecipeError, match=r"found more than 549 kB, expected a file of at most"):
        data_folder.read(place, len(content) - 1, "a file")


@pytest.fixture(
    params=data_folder.COMPRESSION_METHODS, ids=data_folder.COMPRESSION_METHODS.values()
)
def method(request):
    return request.param


def raw(folder, content, entry=NAME, **changed):
    """Zip of one deflated member whose headers say what is `changed`, and its place.

    content: the deflated bytes. Sizes are the header's own and need not be true.
    """
    header = {"flags": 0, "method": 8, "crc": 0, "size": 100, "packed": len(content)} | changed
    name = entry.encode()
    fields = struct.pack(
        "<5H3I2H",
        *(20, header["flags"], header["method"], 0, 0),
        *(header["crc"], header["packed"], header["size"]),
        *(len(name), 0),
    )
    local = b"PK\3\4" + fields + name + content
    rest = struct.pack("<3H2I", 0, 0, 0, 0, 0)
    central = b"PK\1\2" + struct.pack("<H", 20) + fields + rest + name
    end = b"PK\5\6" + struct.pack("<4H2IH", 0, 0, 1, 1, len(central), len(local), 0)
    (folder / "takes.zip").write_bytes(local + central + end)
    return data_folder.find(folder, entry)


def deflated(content):
    packer = zlib.compressobj(wbits=-15)
    return packer.compress(content) + packer.flush()


PLAIN = b"content of a member"
CANNOT = "found data that cannot be unpacked"
STORED_OR_DEFLATED = "expected 0 (stored) or 8 (deflate)"


def plainly(folder, **changed):
    true = {"crc": zlib.crc32(PLAIN), "size": len(PLAIN)}
    return raw(folder, deflated(PLAIN), **true | changed)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"method": 99}, f"found compression method 99, {STORED_OR_DEFLATED}"),
        ({"flags": 1}, "found an encrypted member, expected no password"),
        ({"crc": 1}, f"{CANNOT} (Bad CRC-32 for file 'takes/bvh/walk.bvh'), expected a whole"),
        ({"packed": 5}, f"{CANNOT} ("),
    ],
    ids=str,
)
def test_a_member_that_cannot_be_unpacked_is_refused_by_name(tmp_path, changed, said):
    with pytest.raises(RecipeError) as refused:
        text(plainly(tmp_path, **changed))
    assert str(refused.value).startswith(f"{tmp_path}/takes.zip/{NAME}: {said}")


def bomb(folder, piece, times, entry=NAME):
    """Place of a member of many times a piece, in a zip of a thousandth of its size.

    A deflated block is written again and again: no byte of what it holds is ever made here.
    """
    packer = zlib.compressobj(9, wbits=-15)
    block = packer.compress(piece) + packer.flush(zlib.Z_FULL_FLUSH)
    return raw(folder, block * times + packer.flush(), entry, size=0xFFFFFFFE)


def peak(run):
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_a_table_that_unpacks_to_gigabytes_is_refused_before_it_is_held(tmp_path):
    place = bomb(tmp_path, b"\0" * 1_000_000, 5_000)
    assert place.archive.stat().st_size < 6_000_000

    def run():
        with pytest.raises(RecipeError, match="found more than 16000 kB, expected a table of at"):
            data_folder.read(place, 16_000_000, "a table")

    assert peak(run) < 40_000_000


@pytest.mark.parametrize(
    ("piece", "said"),
    [
        (b"\0" * 1_000_000, "walk.bvh:1: found 256000 characters in a line"),
        (b"\n" * 1_000_000, "walk.bvh:4000001: found 4 MB without a line MOTION, expected"),
    ],
    ids=["zeros", "blank lines"],
)
def test_a_motion_file_that_unpacks_to_gigabytes_is_refused_before_it_is_held(
    tmp_path, piece, said
):
    place = bomb(tmp_path, piece, 5_000)

    def run():
        with pytest.raises(BvhError) as refused:
            bvh.read(place)
        assert said in str(refused.value)

    assert peak(run) < 60_000_000
