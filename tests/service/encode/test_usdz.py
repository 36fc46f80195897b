import io
import struct
import zipfile

import pytest

from posefield.encode import archives
from posefield.encode.formats import CLIP_ENCODERS


@pytest.fixture(scope="module")
def archive(walk):
    return CLIP_ENCODERS["usdz"].encode(walk)


def test_the_archive_holds_the_binary_layer_alone(archive, walk):
    with zipfile.ZipFile(io.BytesIO(archive)) as found:
        assert found.testzip() is None
        (entry,) = found.infolist()
        assert (entry.filename, entry.compress_type) == ("clip.usdc", zipfile.ZIP_STORED)
        assert entry.date_time == (1980, 1, 1, 0, 0, 0)
        assert found.read(entry) == CLIP_ENCODERS["usdc"].encode(walk)


def test_an_archive_of_many_members_is_aligned_and_whole(tmp_path):
    contents = {"root.usdc": b"r" * 1000, "folder/a.usdc": b"", "folder/long name.usdc": b"z" * 65}
    lying = tmp_path / "lying"
    lying.write_bytes(b"on disk" * 300_000)
    members = [archives.whole(name, data) for name, data in contents.items()]
    data = b"".join(archives.zip_chunks([*members, archives.member_of_file("last.usdc", lying)]))
    with zipfile.ZipFile(io.BytesIO(data)) as found:
        assert found.testzip() is None
        assert found.namelist() == [*contents, "last.usdc"]
        assert [found.read(name) for name in contents] == list(contents.values())
        assert found.read("last.usdc") == lying.read_bytes()
        assert {starts(data, entry) % 64 for entry in found.infolist()} == {0}


def starts(data, entry):
    """Return a member's data offset: its header's last two fields are the lengths in between."""
    name, extra = struct.unpack_from("<2H", data, entry.header_offset + 26)
    return entry.header_offset + 30 + name + extra
