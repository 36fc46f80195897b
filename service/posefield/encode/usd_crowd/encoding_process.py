"""Encoding of crowds in a child process.

usd-core holds Python's lock while it writes a layer, for seconds where the layer is large: all
other threads of this process would stop meanwhile, and the work could not be cancelled. It also
never frees a path. A child has its own lock and memory, and can be killed (decision 0029).
"""

import pickle
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
from posefield.motion.crowd_clip import CrowdClip
from posefield.question.body_kind import DEFAULT_BODY, BodyKind

CHILD_MODULE = "posefield.encode.usd_crowd.encoding_child"
POLL_INTERVAL = 0.1
"""Seconds between two checks of the cancellation."""


class EncoderDied(Exception):
    """Raised if the child process ended before it had written the whole crowd."""


def stream(
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

    def _write(self, part: object) -> None:
        cancel.check()
        pickle.dump(part, self.pipe, protocol=pickle.HIGHEST_PROTOCOL)
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
