"""Telemetry of requests, both optional: JSON lines on standard error, and OpenTelemetry spans.

Lines are buffered briefly and written together: a system call per line would take a tenth of a pose
request's time. OpenTelemetry's ASGI middleware takes as long as a pose request, sampled or not;
tracing here costs nothing without OTEL_EXPORTER_OTLP_ENDPOINT and little with it. The SDK reads its
own variables (OTEL_SERVICE_NAME and others).
"""

import asyncio
import importlib
import os
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any

import orjson

from posefield import __version__
from posefield.common.errors import InvalidField

FLUSH_DELAY = 0.05
"""Maximum time of a line in the buffer, s."""

WRITE_SIZE = 4096
"""Bytes that a pipe accepts atomically, so that lines of several processes do not interleave."""


class LogBuffer:
    """Buffer of log lines for a file descriptor."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._buffer: list[bytes] = []

    def add(self, content: Mapping[str, Any]) -> None:
        """Buffer a line of JSON; a flush follows within MOMENT. Needs a running event loop."""
        if not self._buffer:
            asyncio.get_running_loop().call_later(FLUSH_DELAY, self.flush)
        self._buffer.append(orjson.dumps(content, option=orjson.OPT_APPEND_NEWLINE))

    def flush(self) -> None:
        """Write the buffer."""
        held, self._buffer = self._buffer, []
        for piece in _pieces(held):
            _write(self._target, piece)


def _write(target: int, piece: bytes) -> None:
    while piece:
        piece = piece[os.write(target, piece) :]


def _pieces(lines: list[bytes]) -> list[bytes]:
    """Return the lines joined to pieces of at most PIECE bytes; a longer line is a piece."""
    pieces, size = [[]], 0  # type: list[list[bytes]], int
    for line in lines:
        if size + len(line) > WRITE_SIZE and pieces[-1]:
            pieces.append([])
            size = 0
        pieces[-1].append(line)
        size += len(line)
    return [b"".join(own) for own in pieces if own]


def to_standard_error() -> LogBuffer:
    """Return a log buffer for standard error."""
    return LogBuffer(sys.stderr.fileno())


def timestamp(seconds: float) -> str:
    """Return a time in RFC 3339 form, UTC.

    seconds: since 1970.
    """
    whole = int(seconds)
    return f"{_whole_second(whole)}.{int(1000 * (seconds - whole)):03d}Z"


@lru_cache(1)
def _whole_second(whole: int) -> str:
    return datetime.fromtimestamp(whole, UTC).strftime("%Y-%m-%dT%H:%M:%S")


ENDPOINTS = ("OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT")
_CONTEXT = (b"traceparent", b"tracestate")


class Tracer:
    """Tracer of requests with a provider of OpenTelemetry's SDK."""

    def __init__(self, provider: Any) -> None:
        self._provider = provider
        self._tracer = provider.get_tracer("posefield", __version__)
        self._trace = importlib.import_module("opentelemetry.trace")
        context = importlib.import_module("opentelemetry.trace.propagation.tracecontext")
        self._propagator = context.TraceContextTextMapPropagator()

    def begin(self, headers: Mapping[bytes, bytes]) -> Any:
        """Return a new span of a request, a child of the span that its headers name."""
        carrier = {n.decode(): headers[n].decode("latin-1") for n in _CONTEXT if n in headers}
        context = self._propagator.extract(carrier)
        return self._tracer.start_span("request", context, self._trace.SpanKind.SERVER)

    def end(self, span: Any, line: Mapping[str, Any]) -> None:
        """End a span, with attributes from the facts of the request."""
        span.update_name(f"{line['method']} {line['operation']}")
        for name, field in _ATTRIBUTES.items():
            if line[field] is not None:
                span.set_attribute(name, line[field])
        if line["status"] >= 500:
            span.set_status(self._trace.StatusCode.ERROR)
        span.end()

    def close(self) -> None:
        """Export buffered spans."""
        self._provider.shutdown()


_ATTRIBUTES = {
    "http.request.method": "method",
    "http.response.status_code": "status",
    "http.response.body.size": "bytes",
    "posefield.operation": "operation",
    "posefield.format": "format",
    "posefield.model": "model",
    "posefield.request": "request",
}


def environment_tracer(environ: Mapping[str, str] = os.environ) -> Tracer | None:
    """Return the tracer of the configured endpoint; None without an endpoint.

    Raises InvalidField for an endpoint without the SDK installed.
    """
    named = [name for name in ENDPOINTS if environ.get(name)]
    if not named:
        return None
    try:
        sdk = importlib.import_module("opentelemetry.sdk.trace")
        export = importlib.import_module("opentelemetry.sdk.trace.export")
        otlp = importlib.import_module("opentelemetry.exporter.otlp.proto.http.trace_exporter")
    except ModuleNotFoundError as fault:
        said = f"is set, and {fault.name} is missing; expected posefield[trace]"
        raise InvalidField(named[0], said) from fault
    provider = sdk.TracerProvider()
    provider.add_span_processor(export.BatchSpanProcessor(otlp.OTLPSpanExporter()))
    return Tracer(provider)


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
