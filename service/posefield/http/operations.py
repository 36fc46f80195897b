"""Handlers of the contract's operations: steps for questions about models, else functions."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from posefield.encode import glb
from posefield.encode.formats import CLIP_ENCODERS
from posefield.http import (
    clip_operations,
    crowd_operations,
    metrics,
    performance_operations,
    pose_operations,
    responses,
    trust_operations,
    worker_threads,
)
from posefield.http.steps import Handler, Service


async def list_models(service: Service, request: Request) -> Response:
    """Return the list of models."""
    return responses.json_document(responses.model_list(request.scope["library"]))


async def get_model(service: Service, request: Request) -> Response:
    """Return the card of a model."""
    return responses.json_document(responses.card_document(request.scope["model"]))


async def get_character(service: Service, request: Request) -> Response:
    """Return the character of a model at rest, made in a thread: that takes tenths of a second."""
    model = request.scope["model"]
    content = await worker_threads.run_in_thread(
        glb.character_glb, model.session.card.skeleton, model.identity
    )
    return responses.attachment(content, CLIP_ENCODERS["glb"], model.name)


async def list_characters(service: Service, request: Request) -> Response:
    """Return the characters of users, and files that cannot be used."""
    return responses.json_document(service.characters.document())


async def live(service: Service, request: Request) -> Response:
    """Return the liveness of the process."""
    return responses.json_document({"status": "live", "contract": service.contract})


async def ready(service: Service, request: Request) -> Response:
    """Return the readiness of the service, and the models that the client may read.

    Each model was tested within the last second. Raises RequestError 503 if not ready.
    """
    return responses.json_document(service.readiness.document(request.scope["principal"].may_read))


async def get_metrics(service: Service, request: Request) -> Response:
    """Return the metrics in Prometheus' text format."""
    reloads = service.readiness.models.reloads
    counts = {"looks": reloads.looks, "opened": reloads.opened, "failed": reloads.failed}
    metrics.set_models(service.registry.identities, {**counts, "faults": len(reloads.faults)})
    return Response(metrics.metrics_text(), headers={"Content-Type": metrics.MEDIA_TYPE})


async def get_page(name: str, service: Service, request: Request) -> Response:
    """Return a static document, by its operationId."""
    page = service.pages[name]
    return Response(page.content, headers=page.headers, media_type=page.media_type)


PAGES = (
    "getContract",
    "getContractJson",
    "getDocs",
    "getProblems",
    "getViewer",
)
_FORMATTED: dict[str, Handler] = {
    "getPose": pose_operations.GET_POSE,
    "queryPose": pose_operations.QUERY_POSE,
    "getClip": clip_operations.GET_CLIP,
    "queryClip": clip_operations.QUERY_CLIP,
    "queryClips": clip_operations.query_clips(CLIP_ENCODERS),
    "getCrowd": crowd_operations.GET_CROWD,
    "queryCrowd": crowd_operations.QUERY_CROWD,
    "queryPerformance": performance_operations.QUERY_PERFORMANCE,
    "queryPerformances": performance_operations.QUERY_PERFORMANCES,
    "getSigma": trust_operations.GET_SIGMA,
    "querySigma": trust_operations.QUERY_SIGMA,
}
OPERATIONS: dict[str, Handler] = {
    "listModels": list_models,
    "getModel": get_model,
    "getCharacter": get_character,
    "listCharacters": list_characters,
    "getWhy": trust_operations.GET_WHY,
    "queryWhy": trust_operations.QUERY_WHY,
    "getSuggestions": trust_operations.GET_SUGGESTIONS,
    "getMetrics": get_metrics,
    "getLiveness": live,
    "getReadiness": ready,
    **{name: partial(get_page, name) for name in PAGES},
    # The path without a format and the path with one have the same handler.
    **_FORMATTED,
    **{f"{name}InFormat": handler for name, handler in _FORMATTED.items()},
}
"""Handler of each operationId."""
