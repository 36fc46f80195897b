"""Tests of OpenTelemetry spans: one per request, in the client's trace, sent to the endpoint."""

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlencode

import httpx
import pytest
from asking import asker
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from serving import address, process

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.http.telemetry import Telemetry, Tracer

PARENT = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"


@pytest.fixture
def spans(loaded):
    """Ask a service, and get the spans that it made."""
    held = InMemorySpanExporter()
    provider = TracerProvider()
    provider.add_span_processor(SimpleSpanProcessor(held))
    ask = asker(create_app(loaded, Settings(), Telemetry(tracer=Tracer(provider))))

    def asked(*args, **given):
        held.clear()
        ask(*args, **given)
        return held.get_finished_spans()

    return asked


def test_a_request_is_one_span_of_the_clients_trace(spans, loaded, controls):
    url = f"/v1/models/reach/clip.usdc?{urlencode(controls)}"
    (span,) = spans("GET", url, headers={"traceparent": PARENT})
    assert span.name == "GET getClipInFormat"
    assert span.attributes["posefield.format"] == "usdc"
    assert f"{span.context.trace_id:032x}" == PARENT.split("-")[1]
    assert f"{span.parent.span_id:016x}" == PARENT.split("-")[2]
    assert span.attributes["http.response.status_code"] == 200
    assert span.attributes["posefield.model"] == loaded.find("reach").identity


@pytest.fixture
def collector():
    """Address of a collector, and the names of the spans that it was sent."""
    names = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            content = self.rfile.read(int(self.headers["content-length"]))
            for resource in ExportTraceServiceRequest.FromString(content).resource_spans:
                names.extend(s.name for scope in resource.scope_spans for s in scope.spans)
            self.send_response(200)
            self.end_headers()

        def log_message(self, *args):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}", names
        server.shutdown()


@pytest.mark.system
def test_spans_reach_the_endpoint_that_is_set(models, collector):
    url, names = collector
    environ = {"OTEL_EXPORTER_OTLP_ENDPOINT": url, "OTEL_EXPORTER_OTLP_COMPRESSION": "none"}
    with process(models, **environ) as child:
        assert httpx.get(address(child) + "/livez").status_code == 200
        child.terminate()
        assert child.wait(20) == 0
    assert names == ["GET getLiveness"]
