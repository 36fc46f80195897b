"""Tests of archives with other readers: the standard library, GNU tar and Info-ZIP."""

import io
import shutil
import subprocess
import zipfile

import pytest

from posefield.encode import archives
from posefield.encode.archives import ARCHIVE_WRITERS

CONTENTS = {
    "clip-000000.usdc": b"first" * 1000,
    "empty.bvh": b"",
    "block.json": b"{" * 512,
    "00/clip.name_1.usdz": b"z" * 513,
    "manifest.jsonl": b"{}\n",
}
LONG = {f"{'folder/' * 5}{'n' * 100}.usdc": b"one", f"{'d' * 90}/{'n' * 100}.usdc": b"two"}


def packed(kind, contents):
    return b"".join(ARCHIVE_WRITERS[kind].write(contents.items()))


@pytest.mark.parametrize("kind", ARCHIVE_WRITERS)
def test_a_name_that_readers_differ_on_is_refused(kind):
    with pytest.raises(ValueError, match="ascii"):
        packed(kind, {"größe.usdc": b"three"})


COMMANDS = {"tar": ("tar", "-xf"), "zip": ("unzip", "-q")}


@pytest.mark.parametrize("contents", [CONTENTS, LONG], ids=["plain", "long"])
@pytest.mark.parametrize("kind", ARCHIVE_WRITERS)
def test_command_lines_unpack_it_without_a_word(kind, contents, tmp_path):
    program, option = COMMANDS[kind]
    if shutil.which(program) is None:
        pytest.skip(f"no {program} here")
    path = tmp_path / f"clips.{kind}"
    path.write_bytes(packed(kind, contents))
    command = [program, option, str(path)]
    environ = {"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8"}
    done = subprocess.run(command, cwd=tmp_path, env=environ, capture_output=True, check=True)
    assert done.stdout == done.stderr == b""
    for name, content in contents.items():
        assert (tmp_path / name).read_bytes() == content


@pytest.mark.parametrize("kind", ARCHIVE_WRITERS)
def test_pieces_come_before_the_next_file_is_made(kind):
    made = []

    def members():
        for number in range(3):
            made.append(number)
            yield f"{number}", b"content"

    pieces = ARCHIVE_WRITERS[kind].write(members())
    sent = b""
    while b"content" not in sent:
        sent += next(pieces)
    assert made == [0]


@pytest.mark.parametrize("count", [65_534, 65_535])
def test_a_zip_may_have_more_files_than_sixteen_bits_count(count):
    data = packed("zip", {f"{number}": b"" for number in range(count)})
    assert (b"PK\6\6" in data) == (count >= 65_535)
    with zipfile.ZipFile(io.BytesIO(data)) as found:
        assert len(found.namelist()) == count
        assert found.read(f"{count - 1}") == b""


def test_a_zip_may_be_larger_than_thirty_two_bits_count(tmp_path):
    path, gap = tmp_path / "large.zip", 2200 * 1024 * 1024
    # Gaps in the file stand for two members of 2.2 GiB, whose checksums nobody looks at here.
    holes = [archives.ZipMember(f"hole{i}", gap, 0, (None,)) for i in range(2)]
    members = [archives.whole("first", b"start"), *holes, archives.whole("last", b"beyond")]
    with path.open("wb") as out:
        for piece in archives.zip_chunks(members):
            out.seek(gap, 1) if piece is None else out.write(piece)
    with zipfile.ZipFile(path) as found:
        assert [e.header_offset > 2**32 for e in found.infolist()] == [False, False, False, True]
        assert (found.read("first"), found.read("last")) == (b"start", b"beyond")
    if shutil.which("unzip"):
        shown = subprocess.run(["unzip", "-p", path, "last"], capture_output=True, check=True)
        assert shown.stdout == b"beyond" and shown.stderr == b""
