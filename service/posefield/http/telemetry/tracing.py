"""OpenTelemetry tracing, enabled by OTEL_EXPORTER_OTLP_ENDPOINT: one span per request.

OpenTelemetry's ASGI middleware takes as long as a pose request, sampled or not; this module costs
nothing without an endpoint and little with one. The SDK reads its own variables
(OTEL_SERVICE_NAME and others).
"""

import importlib
import os
from collections.abc import Mapping
from typing import Any

from posefield import __version__
from posefield.common.errors import InvalidField

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


def from_environment(environ: Mapping[str, str] = os.environ) -> Tracer | None:
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
