"""Trial of model files: a child process with limits on time and memory opens each of them first.

The check of operators (onnx_file) does not bound the sizes of their results: a few constants can
take any amount of time or memory, when the file is opened or at the first question.

Memory is limited where the system enforces RLIMIT_AS and has /proc, as Linux does; elsewhere, as on
macOS, only time is limited. docs/decisions/0023-trial-of-model-files.md has the figures.
"""

import math
import multiprocessing
import resource
import signal
import sys
import threading
import time
import warnings
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from posefield.common.errors import ModelError
from posefield.inference import onnx_runtime
from posefield.model_file import checked_file

MAX_MESSAGE = 1_000
"""Longest message, characters."""
OUT_OF_MEMORY = ("bad_alloc", "Failed to allocate memory")
"""Texts of onnxruntime's out-of-memory errors."""


@dataclass(frozen=True)
class TrialLimits:
    """Limits on opening one file.

    cpu: CPU time, s. wall: wall time, s. memory: bytes beyond those of the process. passed: digests
    of files that have passed already. A model of 110 kB takes 0.02 s and 10 MB.
    """

    cpu: int = 10
    wall: float = 60.0
    memory: int = 512 << 20
    passed: frozenset[str] = frozenset()

    def check(self, content: bytes, source: str) -> None:
        """Raise ModelError for a file that cannot be served; OSError if no process can be started.

        source: path or URL of the file, for messages.
        """
        message = "" if checked_file.digest(content) in self.passed else _run_trial(content, self)
        if message:
            raise ModelError(source, message)


DEFAULT_LIMITS = TrialLimits()


def _run_trial(content: bytes, limits: TrialLimits) -> str:
    """Return the reason for which a child process cannot open a file, or an empty text."""
    context = _context()
    receiver, other = context.Pipe()
    child = context.Process(target=_run_child, args=(other, limits), daemon=True)
    # Python warns of a fork in a process with threads of libraries. OpenBLAS ends its own before a
    # fork.
    with receiver, other, warnings.catch_warnings(action="ignore", category=DeprecationWarning):
        child.start()
        other.close()
        return _message(child, receiver, content, limits)


def _context() -> Any:
    """Return the multiprocessing context: fork where it is safe, else spawn.

    A forked process has all modules imported. Locks that other threads hold stay locked in it, and
    many libraries of macOS fail after a fork.
    """
    copied = sys.platform == "linux" and threading.active_count() == 1
    return multiprocessing.get_context("fork" if copied else "spawn")


def _message(child: BaseProcess, receiver: Connection, content: bytes, limits: TrialLimits) -> str:
    """Return the reason for which the child cannot open a file, or an empty text."""
    alarm = threading.Timer(limits.wall, child.kill)
    alarm.start()
    try:
        # Sent after the start: as an argument, it would block for ever on a child that ends at
        # once.
        receiver.send_bytes(content)
        # Bytes, not pickle, which runs code: a malicious file may control the child process.
        return receiver.recv_bytes(4 * MAX_MESSAGE).decode()
    except (EOFError, OSError, UnicodeDecodeError):
        late = alarm.finished.is_set()
        child.join()
        return (
            f"was not open after {limits.wall:g} s"
            if late
            else _exit_reason(child.exitcode, limits)
        )
    finally:
        alarm.cancel()
        alarm.join()
        child.kill()
        child.join()
        child.close()


def _exit_reason(code: int | None, limits: TrialLimits) -> str:
    code = code or 0
    if code == -signal.SIGXCPU:
        return f"takes more than {limits.cpu} s of CPU time to open"
    how = f"by {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
    return f"ended the process that opened it {how}"


def _run_child(other: Connection, limits: TrialLimits) -> None:
    """Receive a file, open it in this process, and send the reason of a failure or ""."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    content = other.recv_bytes()
    _set_limits(limits)
    message = ""
    try:
        card = checked_file.load_card(content, "")
        onnx_runtime.check(onnx_runtime.open_session(content, ""), card, "")
    except ModelError as fault:
        message = fault.message
    except MemoryError:
        message = OUT_OF_MEMORY[0]
    if any(sign in message for sign in OUT_OF_MEMORY):
        message = f"takes more than {limits.memory >> 20} MB of memory to open"
    other.send_bytes(message[:MAX_MESSAGE].encode())


def _set_limits(limits: TrialLimits) -> None:
    """Limit CPU time and memory of this process, in addition to its present use."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    _set_soft_limit(resource.RLIMIT_CPU, math.ceil(time.process_time()) + limits.cpu)
    with suppress(FileNotFoundError):
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        _set_soft_limit(resource.RLIMIT_AS, pages * resource.getpagesize() + limits.memory)


def _set_soft_limit(kind: int, limit: int) -> None:
    hard = resource.getrlimit(kind)[1]
    lower = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
    resource.setrlimit(kind, (lower, hard))
