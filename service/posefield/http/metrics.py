"""Metrics in Prometheus' text format.

Worker processes write files in one folder, PROMETHEUS_MULTIPROC_DIR, and each can report the
metrics of all; prometheus_client reads that variable when it is imported.
"""

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import prometheus_client as prometheus
from prometheus_client import multiprocess

from posefield import __version__

MEDIA_TYPE = prometheus.CONTENT_TYPE_LATEST
FOLDER_VARIABLE = "PROMETHEUS_MULTIPROC_DIR"

LATENCY_BUCKETS = (
    1e-4,
    2e-4,
    5e-4,
    1e-3,
    2e-3,
    5e-3,
    0.01,
    0.02,
    0.05,
    0.1,
    0.2,
    0.5,
    1.0,
    2.0,
    5.0,
    10.0,
)
BATCH_BUCKETS = (1, 2, 4, 8, 16, 32, 64)

_LATENCY = prometheus.Histogram(
    "posefield_request_seconds",
    "Time from a request's head to the end of its answer",
    ("operation", "format", "status"),
    buckets=LATENCY_BUCKETS,
)
_BYTES = prometheus.Counter(
    "posefield_sent_bytes", "Bytes of bodies of answers", ("operation", "format")
)
_NOT_MODIFIED = prometheus.Counter(
    "posefield_not_modified",
    "Answers that clients had already: no model was asked",
    ("operation", "format"),
)
_BATCH = prometheus.Histogram(
    "posefield_batch_rows",
    "Poses that one call of a graph answered together",
    buckets=BATCH_BUCKETS,
)
_OPEN = prometheus.Gauge(
    "posefield_open_requests",
    "Requests that were being answered when last looked at, ten times a second",
    multiprocess_mode="livesum",
)
_MODEL = prometheus.Gauge(
    "posefield_model",
    "1 for each version that answers, 0 for one that did",
    ("model", "hash"),
    multiprocess_mode="mostrecent",
)
_RELOADS = prometheus.Gauge(
    "posefield_reloads",
    "Looks for new models, versions opened, attempts that failed, and faults there are now",
    ("what",),
    multiprocess_mode="mostrecent",
)
_BUILD = prometheus.Gauge(
    "posefield_build", "1; which version serves", ("version",), multiprocess_mode="max"
)
_BUILD.labels(__version__).set(1)

# Cached since labels() takes a lock and builds a tuple; there are some hundred label sets.
latency = lru_cache(None)(_LATENCY.labels)
sent_bytes = lru_cache(None)(_BYTES.labels)
not_modified = lru_cache(None)(_NOT_MODIFIED.labels)


def count_inference(rows: int) -> None:
    """Count an inference call.

    rows: poses of its batch.
    """
    _BATCH.observe(rows)


def set_open_requests(count: int) -> None:
    """Set the number of open requests."""
    _OPEN.set(count)


def set_models(identities: Iterable[str], reloads: Mapping[str, int]) -> None:
    """Set the versions of models in service and the counts of their reloads.

    identities: as name@hash.
    """
    now = {tuple(identity.split("@")) for identity in identities}
    for labels in now | _known:
        _MODEL.labels(*labels).set(labels in now)
    _known.update(now)
    for what, number in reloads.items():
        _RELOADS.labels(what).set(number)


_known: set[tuple[str, ...]] = set()


def metrics_text() -> bytes:
    """Return all metrics as text, aggregated over the processes that share a folder."""
    if FOLDER_VARIABLE not in os.environ:
        return prometheus.generate_latest()
    registry = prometheus.CollectorRegistry()
    multiprocess.MultiProcessCollector(registry)
    return prometheus.generate_latest(registry)


@contextmanager
def shared_folder() -> Iterator[str]:
    """Yield a temporary folder for the metrics of several processes, set in FOLDER_VARIABLE."""
    with TemporaryDirectory(prefix="posefield-metrics-") as folder:
        os.environ[FOLDER_VARIABLE] = folder
        yield folder


def remove_process(process: int) -> None:
    """Remove the live gauges of a process that has ended.

    process: its id.
    """
    if Path(os.environ.get(FOLDER_VARIABLE, "")).is_dir():
        multiprocess.mark_process_dead(process)
