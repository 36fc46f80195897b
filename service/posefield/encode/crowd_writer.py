"""Writers of crowds as USD, to a file or to a stream; large ones in a child process.

usd-core holds a layer in memory until it has been exported, and Python's lock while it writes it,
for seconds where the layer is large: all other threads of this process would stop meanwhile, and
the work could not be cancelled. It also never frees a path. A child has its own lock and memory,
and can be killed (decision 0029).
"""

import pickle
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO

from posefield.common import atomic_files
from posefield.common import cancellation as cancel
from posefield.common.cancellation import Cancellation, Cancelled
from posefield.common.errors import FileError, InvalidField, did_you_mean
from posefield.encode import archives, character, crowd_scene, crowd_size, layers
from posefield.encode.crowd_size import FILES, INSTANCING, STREAMS, CrowdCounts
from posefield.motion.clip import CrowdClip
from posefield.question.motion_question import DEFAULT_BODY, BodyKind

CHILD_MODULE = "posefield.encode.encoding_child"
POLL_INTERVAL = 0.1
"""Seconds between two checks of the cancellation."""


class EncoderDied(Exception):
    """Raised if the child process ended before it had written the whole crowd."""


def stream_from_child(
    crowd: CrowdClip, ending: str, instancing: str, body: BodyKind = DEFAULT_BODY
) -> Iterator[bytes]:
    """Yield the bytes of a crowd as usda, usdc or usdz, in chunks of a file made by a child.

    The child has ended when the first chunk is yielded: a client that reads slowly keeps a file
    open, but no process. Raises the errors of computing the motions, Cancelled, and EncoderDied.
    """
    with TemporaryDirectory() as folder:
        path = Path(folder, f"crowd.{ending}")
        words = [sys.executable, "-P", "-m", CHILD_MODULE, str(path), instancing, body]
        with subprocess.Popen(words, stdin=subprocess.PIPE) as child:
            assert child.stdin is not None
            with _running_feeder(_Feeder(crowd, child.stdin, Cancellation()), child) as feeder:
                _wait(child)
        if feeder.fault is not None:
            raise feeder.fault
        if child.returncode:
            raise EncoderDied(f"it ended with {child.returncode}")
        yield from atomic_files.read_chunks(path)


@dataclass
class _Feeder:
    """Thread that writes a crowd and its motions, as they are computed, to a child.

    cancellation: stops it within a moment. fault: the error of computing the motions.
    """

    crowd: CrowdClip
    pipe: IO[bytes]
    cancellation: Cancellation
    fault: Exception | None = None

    def run(self) -> None:
        """Write the crowd, unless the child has ended or the work is cancelled."""
        # A thread has a context of its own.
        cancel.current.set(self.cancellation)
        try:
            self._write(replace(self.crowd, batches=()))
            for batch in self.crowd.batches:
                self._write(batch)
            self._write(None)
        except (BrokenPipeError, Cancelled):
            pass
        except Exception as fault:
            self.fault = fault
        finally:
            # Without the None at the end the child fails, and writes no file.
            with suppress(BrokenPipeError):
                self.pipe.close()

    def _write(self, batch: object) -> None:
        cancel.check()
        pickle.dump(batch, self.pipe, protocol=pickle.HIGHEST_PROTOCOL)
        self.pipe.flush()


@contextmanager
def _running_feeder(feeder: _Feeder, child: subprocess.Popen[bytes]) -> Iterator[_Feeder]:
    """Run a feeder during the block; both it and the child have ended after the block."""
    thread = threading.Thread(target=feeder.run, name="crowd")
    thread.start()
    try:
        yield feeder
    finally:
        feeder.cancellation.cancel()
        # A write that waits for the child to read fails once the child has ended.
        child.kill()
        thread.join()


def _wait(child: subprocess.Popen[bytes]) -> None:
    while child.poll() is None:
        cancel.check()
        with suppress(subprocess.TimeoutExpired):
            child.wait(POLL_INTERVAL)


CHILD_PROCESS_SIZE = 32_000_000
"""Bytes of a layer that usd-core writes in about 0.2 s, in which no other thread runs."""


def write(
    crowd: CrowdClip,
    path: Path,
    instancing: str = "references",
    body: BodyKind = DEFAULT_BODY,
) -> None:
    """Write a crowd atomically, in the form of the path's extension.

    .usda and .usdc: one layer. .usd: an entry with a folder `<stem>_clips` beside it, with a layer
    for each motion. .usdz: the same in one archive. With "flatten" it is always one layer. The
    batches are iterated once. Raises InvalidField for an unknown extension or instancing and for a
    crowd too large for a usdz, and FileError if the file cannot be written.
    """
    ending = path.suffix.removeprefix(".")
    _validate(crowd, ending, FILES, instancing)
    if ending == "usdz":
        atomic_files.write_chunks(encode_here(crowd, ending, instancing, body), path)
    elif ending == "usd" and instancing != "flatten":
        _write_folder(crowd, path, instancing == "scenegraph", body)
    else:
        with atomic_files.replacing(path) as temporary:
            _export(crowd, temporary, instancing, body)


def stream(
    crowd: CrowdClip,
    ending: str,
    instancing: str = "references",
    body: BodyKind = DEFAULT_BODY,
) -> Iterator[bytes]:
    """Return an iterator over the bytes of a crowd as usda, usdc or usdz.

    A usdz is sent while its motions are computed; a single layer is first exported to a file on
    disk, which is removed when the stream is closed. Large layers are written by a child process.
    Raises InvalidField at once, as `write` does.
    """
    _validate(crowd, ending, STREAMS, instancing)
    counts = CrowdCounts(
        len(crowd.skeleton),
        len(crowd.motion),
        crowd_size.motion_count(crowd),
        crowd.frames,
        character.body_size(crowd.skeleton, body),
        len(crowd.curves),
    )
    in_child = (
        crowd_size.layer_size_bound(counts, ending, instancing == "flatten") > CHILD_PROCESS_SIZE
    )
    return (stream_from_child if in_child else encode_here)(crowd, ending, instancing, body)


def encode_here(
    crowd: CrowdClip, ending: str, instancing: str, body: BodyKind = DEFAULT_BODY
) -> Iterator[bytes]:
    """Yield the bytes of a crowd as `stream` does, encoded by this process whatever its size."""
    if ending == "usdz" and instancing != "flatten":
        yield from archives.zip_chunks(crowd_scene.members(crowd, instancing == "scenegraph", body))
        return
    with TemporaryDirectory() as folder:
        path = Path(folder, "crowd.usda" if ending == "usda" else "crowd.usdc")
        _export(crowd, path, instancing, body)
        if ending == "usdz":
            yield from archives.zip_chunks([archives.member_of_file(path.name, path)])
        else:
            yield from atomic_files.read_chunks(path)


def _export(crowd: CrowdClip, path: Path, instancing: str, body: BodyKind) -> None:
    """Write a crowd of one layer: as text if the path ends in .usda, else in binary form."""
    form = "usda" if path.suffix == ".usda" else "usdc"
    if instancing == "flatten":
        layer = crowd_scene.flat_layer(crowd, form, body)
    else:
        layer = crowd_scene.referencing_layer(crowd, form, instancing == "scenegraph", body)
    layers.export_layer(layer, path)


def _validate(crowd: CrowdClip, ending: str, endings: tuple[str, ...], instancing: str) -> None:
    for field, value, expected in (
        ("format", ending, endings),
        ("instancing", instancing, INSTANCING),
    ):
        if value not in expected:
            hint = did_you_mean(value, expected)
            raise InvalidField(field, f"{value!r}{hint}, expected one of {', '.join(expected)}")
    if ending == "usdz":
        crowd_size.check_archive_size(crowd)


CROWD_LAYER_NAME = re.compile(r"(m\d{5,}|character|summary)\.usdc")


def _write_folder(crowd: CrowdClip, path: Path, instanced: bool, body: BodyKind) -> None:
    """Write a crowd's file and folder atomically, replacing an earlier crowd.

    Raises FileError if the folder contains other files than a crowd's layers, which would be lost.
    """
    folder = path.with_name(f"{path.stem}_clips")
    for file in [folder] if folder.is_file() else sorted(folder.glob("*")):
        if not CROWD_LAYER_NAME.fullmatch(file.name):
            raise FileError(file, "in the way; expected nothing here but an earlier crowd's layers")
    with atomic_files.replacing_pair(path, folder) as (entry, inside):
        entry.write_bytes(crowd_scene.root_layer(crowd, instanced, folder.name))
        for name, content in crowd_scene.referenced_layers(crowd, body):
            (inside / name).write_bytes(content)
