"""Answers as Arrow tables, for those who have pyarrow."""

from typing import Any

from posefield_client.wire import Reply

try:
    import pyarrow
except ImportError:  # pragma: no cover
    pyarrow = None


def read(reply: Reply) -> Any:
    """A pyarrow.Table of an answer; ImportError where pyarrow is not installed."""
    if pyarrow is None:
        raise ImportError("tables need pyarrow: pip install posefield-client[arrow]")
    with pyarrow.ipc.open_stream(reply.content) as reader:
        return reader.read_all()
