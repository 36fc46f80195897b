"""Answers as Arrow tables, for those who have pyarrow."""

from typing import Any

from posefield_client.wire import Reply

try:
    import pyarrow
except ImportError:  # pragma: no cover
    pyarrow = None


def read(reply: Reply) -> Any:
    """A pyarrow.Table of an answer; ImportError where pyarrow is not installed.

    ValueError where it is none.
    """
    if pyarrow is None:
        raise ImportError("tables need pyarrow: pip install posefield-client[arrow]")
    try:
        with pyarrow.ipc.open_stream(reply.content) as reader:
            return reader.read_all()
    except (pyarrow.ArrowException, OSError) as fault:
        raise ValueError(f"no Arrow stream, or one that breaks off: {fault}") from fault
