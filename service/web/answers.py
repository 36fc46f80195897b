"""Answers as they travel: JSON documents, and the headers that say how far a clip is trusted."""

import json
from collections.abc import AsyncIterator, Sequence
from typing import Any

import orjson
from starlette.responses import Response, StreamingResponse

from service.encode import Encoder
from service.motion import card as cards
from service.motion.answer import Trust
from service.synthesis.library import Library
from service.synthesis.synthesizer import Synthesizer


def document(content: Any) -> Response:
    """JSON answer of plain values."""
    return Response(orjson.dumps(content), media_type="application/json")


def models(library: Library) -> dict[str, Any]:
    """Schema ModelList of the contract."""
    return {"models": [_summary(library.versions(name)) for name in library.models]}


def _summary(versions: Sequence[Synthesizer]) -> dict[str, Any]:
    newest = versions[0]
    return {
        "name": newest.name,
        "identity": newest.identity,
        "versions": [model.identity for model in versions],
        "description": newest.session.card.description,
    }


def card(model: Synthesizer) -> dict[str, Any]:
    """Schema ModelCard of the contract."""
    return {"identity": model.identity, **cards.plain_values(model.session.card)}


def attachment(content: bytes, media_type: str, name: str) -> Response:
    """A file to save."""
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return Response(content, headers=headers, media_type=media_type)


def streamed(
    pieces: AsyncIterator[bytes], media_type: str, name: str, model: str, warnings: Sequence[str]
) -> Response:
    """A file to save, sent while it is made."""
    headers = {
        "Content-Disposition": f'attachment; filename="{name}"',
        "Posefield-Model": model,
    }
    return _warning(StreamingResponse(pieces, headers=headers, media_type=media_type), warnings)


def file(content: bytes, encoder: Encoder, trust: Trust) -> Response:
    """A clip as a file to save; what its format cannot carry travels in headers."""
    name = trust.model.partition("@")[0]
    headers = {
        "Content-Disposition": f'attachment; filename="{name}.{encoder.extension}"',
        "Posefield-Model": trust.model,
        "Posefield-Sigma": repr(trust.sigma),
        "Posefield-Duration": repr(trust.duration),
        "Posefield-Supported": "true" if trust.supported else "false",
    }
    if trust.inferred:
        chosen = {name: trust.controls[name] for name in trust.inferred}
        headers["Posefield-Inferred"] = json.dumps(chosen)
    made = Response(content, headers=headers, media_type=encoder.media_type)
    for met in trust.targets:
        if not met.reached:
            said = {"what": met.what, "miss": met.miss, "unit": met.unit}
            made.headers.append("Posefield-Missed", json.dumps(said))
    return _warning(made, trust.warnings)


def _warning(response: Response, warnings: Sequence[str]) -> Response:
    for warning in warnings:
        # A JSON string is plain ASCII and can hold the commas that join header lines.
        response.headers.append("Posefield-Warning", json.dumps(warning))
    return response
