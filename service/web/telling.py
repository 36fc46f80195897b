"""What is told of requests: a line in the log, a span in a trace, or neither."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from service.web.log import Lines
from service.web.tracing import Tracer

# Of the W3C's Trace Context, version 00.
_PARENT = re.compile(rb"00-([0-9a-f]{32})-[0-9a-f]{16}-[0-9a-f]{2}")


@dataclass(frozen=True)
class Telling:
    """Where to, if anywhere."""

    lines: Lines | None = None
    tracer: Tracer | None = None

    @property
    def wanted(self) -> bool:
        """Whether there is anybody to tell."""
        return self.lines is not None or self.tracer is not None

    def begin(self, headers: Mapping[bytes, bytes]) -> Any:
        """Span of a request with these headers; none where nobody traces."""
        return None if self.tracer is None else self.tracer.begin(headers)

    def end(self, span: Any, line: Mapping[str, Any]) -> None:
        """Tell of a request that has been answered."""
        if self.lines is not None:
            self.lines.add(line)
        if self.tracer is not None:
            self.tracer.end(span, line)

    def close(self) -> None:
        """Tell what is still held, before the process ends."""
        if self.lines is not None:
            self.lines.flush()
        if self.tracer is not None:
            self.tracer.close()


SILENT = Telling()


def trace(headers: Mapping[bytes, bytes]) -> str | None:
    """The trace that a request's headers say it is part of."""
    found = _PARENT.fullmatch(headers.get(b"traceparent", b""))
    return found[1].decode() if found else None
