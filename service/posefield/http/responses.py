"""Responses of operations: JSON documents, and files with headers for the facts of trust."""

import json
from collections.abc import AsyncIterator, Iterable, Iterator, Sequence
from typing import Any

import orjson
from anyio import CapacityLimiter
from starlette.responses import Response, StreamingResponse

from posefield.encode.conventions import Format
from posefield.http import worker_threads
from posefield.model_file import model_card as cards
from posefield.question.performance_report import PerformanceReport
from posefield.question.results import Trust
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis.synthesizer import Synthesizer


def json_document(content: Any) -> Response:
    """Return a JSON response of plain values."""
    return Response(orjson.dumps(content), media_type="application/json")


def model_list(library: ModelRegistry) -> dict[str, Any]:
    """Return the ModelList (schema of the contract) of a library."""
    return {"models": [_model_summary(library.versions(name)) for name in library.models]}


def _model_summary(versions: Sequence[Synthesizer]) -> dict[str, Any]:
    newest = versions[0]
    return {
        "name": newest.name,
        "identity": newest.identity,
        "versions": [model.identity for model in versions],
        "description": newest.session.card.description,
    }


def card_document(model: Synthesizer) -> dict[str, Any]:
    """Return the ModelCard (schema of the contract) of a model."""
    return {"identity": model.identity, **cards.plain_values(model.session.card)}


def attachment(content: bytes, form: Format, model: str) -> Response:
    """Return a response with a file to download, named after the model."""
    return Response(content, headers=_disposition(form, model), media_type=form.media_type)


def stream(
    pieces: AsyncIterator[bytes], form: Format, model: Synthesizer, warnings: Sequence[str]
) -> Response:
    """Return a response that streams a file to download.

    warnings: sent as headers.
    """
    headers = {**_disposition(form, model.name), "Posefield-Model": model.identity}
    sent = StreamingResponse(pieces, headers=headers, media_type=form.media_type)
    return _add_warnings(sent, warnings)


def _disposition(form: Format, model: str) -> dict[str, str]:
    return {"Content-Disposition": f'attachment; filename="{model}.{form.extension}"'}


def clip_file(content: bytes, form: Format, trust: Trust) -> Response:
    """Return a response with a clip to download; headers hold its trust for all formats."""
    headers = {
        **_disposition(form, trust.model.partition("@")[0]),
        "Posefield-Model": trust.model,
        "Posefield-Sigma": repr(trust.sigma),
        "Posefield-Duration": repr(trust.duration),
        "Posefield-Supported": "true" if trust.supported else "false",
    }
    if trust.inferred:
        chosen = {name: trust.controls[name] for name in trust.inferred}
        headers["Posefield-Inferred"] = json.dumps(chosen)
    made = Response(content, headers=headers, media_type=form.media_type)
    for met in trust.targets:
        if not met.reached:
            said = {"what": met.what, "miss": met.miss, "unit": met.unit}
            made.headers.append("Posefield-Missed", json.dumps(said))
    return _add_warnings(made, trust.warnings)


def performance_file(content: bytes, form: Format, report: PerformanceReport) -> Response:
    """Return a response with a performance, or its plan; headers hold facts of its report."""
    headers = {
        **_disposition(form, "performance"),
        "Posefield-Model": report.model,
        "Posefield-Sigma": repr(report.sigma),
        "Posefield-Duration": repr(report.duration),
        "Posefield-Supported": "true" if report.supported else "false",
    }
    made = Response(content, headers=headers, media_type=form.media_type)
    return _add_warnings(made, report.warnings)


def performance_archive(
    pieces: AsyncIterator[bytes], form: Format, warnings: Sequence[str]
) -> Response:
    """Return a response that streams an archive of performances; warnings: sent as headers."""
    headers = _disposition(form, "performances")
    return _add_warnings(
        StreamingResponse(pieces, headers=headers, media_type=form.media_type), warnings
    )


def _add_warnings(response: Response, warnings: Sequence[str]) -> Response:
    for warning in warnings:
        # A JSON string is ASCII, and its quotes protect commas, which separate joined headers.
        response.headers.append("Posefield-Warning", json.dumps(warning))
    return response


MIN_CHUNK_SIZE = 1 << 18
"""Minimum bytes of a piece, since a thread switch per piece takes a tenth of a millisecond."""


def merged_chunks(pieces: Iterable[bytes]) -> Iterator[bytes]:
    """Yield the same bytes in pieces of at least ENOUGH bytes, except the last; none is empty."""
    held, size = [], 0
    for piece in pieces:
        held.append(piece)
        size += len(piece)
        if size >= MIN_CHUNK_SIZE:
            yield b"".join(held)
            held, size = [], 0
    if size:
        yield b"".join(held)


async def sent(pieces: Iterator[bytes], places: CapacityLimiter) -> AsyncIterator[bytes]:
    """Yield the pieces, each generated in a thread after the previous one was sent.

    pieces: none may be empty. When the client disconnects, generation stops after the current
    piece.
    """
    while piece := await worker_threads.run_in_thread(next, pieces, b"", places=places):
        yield piece
