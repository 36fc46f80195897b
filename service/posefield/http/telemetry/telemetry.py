"""Telemetry of requests: log lines and trace spans, both optional."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from posefield.http.telemetry.log import LogBuffer
from posefield.http.telemetry.tracing import Tracer

# Header traceparent of the W3C Trace Context, version 00.
_PARENT = re.compile(rb"00-([0-9a-f]{32})-[0-9a-f]{16}-[0-9a-f]{2}")


@dataclass(frozen=True)
class Telemetry:
    """Telemetry outputs.

    lines: request log. tracer: of spans. Each is None if disabled.
    """

    lines: LogBuffer | None = None
    tracer: Tracer | None = None

    @property
    def enabled(self) -> bool:
        """True if the log or tracing is enabled."""
        return self.lines is not None or self.tracer is not None

    def begin(self, headers: Mapping[bytes, bytes]) -> Any:
        """Return the span of a request with these headers; None without tracing."""
        return None if self.tracer is None else self.tracer.begin(headers)

    def end(self, span: Any, line: Mapping[str, Any]) -> None:
        """Log a request and end its span.

        line: facts of the request.
        """
        if self.lines is not None:
            self.lines.add(line)
        if self.tracer is not None:
            self.tracer.end(span, line)

    def close(self) -> None:
        """Write buffered lines and spans, before the process ends."""
        if self.lines is not None:
            self.lines.flush()
        if self.tracer is not None:
            self.tracer.close()


NO_TELEMETRY = Telemetry()


def trace_id(headers: Mapping[bytes, bytes]) -> str | None:
    """Return the trace id in a request's headers; None without a valid one."""
    found = _PARENT.fullmatch(headers.get(b"traceparent", b""))
    return found[1].decode() if found else None
