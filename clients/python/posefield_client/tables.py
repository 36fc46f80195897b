"""Responses as Arrow tables, with the optional pyarrow."""

from typing import Any

from posefield_client.wire import Reply

try:
    import pyarrow
except ImportError:  # pragma: no cover
    pyarrow = None


def read(reply: Reply) -> Any:
    """Return the pyarrow.Table of a response.

    Raises ImportError without pyarrow, and ValueError for an invalid response.
    """
    if pyarrow is None:
        raise ImportError("tables need pyarrow: pip install posefield-client[arrow]")
    try:
        with pyarrow.ipc.open_stream(reply.content) as reader:
            return reader.read_all()
    except (pyarrow.ArrowException, OSError) as fault:
        raise ValueError(f"no Arrow stream, or one that breaks off: {fault}") from fault
