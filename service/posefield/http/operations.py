"""Operations on models, trust, health and pages, and the function of each operationId."""

from collections.abc import Mapping
from functools import partial

from starlette.responses import Response

from posefield.common.errors import InvalidField
from posefield.encode import glb, model_tables
from posefield.encode.archives import ARCHIVE_WRITERS, Format
from posefield.encode.formats import (
    CLIP_ENCODERS,
    CROWD_ENCODERS,
    GRID_ENCODERS,
    POSE_ENCODERS,
)
from posefield.http import metrics, responses
from posefield.http.archive_operations import answer_clips, answer_performances
from posefield.http.batching import POSE_LIMITER, run_in_thread
from posefield.http.crowd_operations import WALK_FORMATS, answer_crowd, answer_walk
from posefield.http.motion_operations import CLIP_FILES, CLIP_FORMATS, answer_clip, answer_pose
from posefield.http.performance_operations import PERFORMANCE_FORMATS, answer_performance
from posefield.http.request import ServiceRequest
from posefield.http.routing import Handler
from posefield.http.track_operations import TRACK_FORMATS, answer_tracks
from posefield.model_file import model_card
from posefield.question.model_question import SigmaQuestion, SuggestQuestion, WhyQuestion
from posefield.synthesis import trust


async def list_models(request: ServiceRequest) -> Response:
    """Answer with the ModelList (schema of the contract)."""
    library = request.library
    return responses.json_document(
        {
            "models": [
                {
                    "name": model.name,
                    "identity": model.identity,
                    "versions": [version.identity for version in library.versions(name)],
                    "description": model.session.card.description,
                }
                for name, model in library.models.items()
            ]
        }
    )


async def get_model(request: ServiceRequest) -> Response:
    """Answer with the ModelCard (schema of the contract)."""
    values = model_card.plain_values(request.model.session.card)
    return responses.json_document({"identity": request.model.identity, **values})


async def get_character(request: ServiceRequest) -> Response:
    """Answer with the character of a model at rest, which takes tenths of a second."""
    model = request.model
    content = await run_in_thread(glb.character_glb, model.session.card.skeleton, model.identity)
    return responses.attachment(content, CLIP_ENCODERS["glb"], model.name)


async def list_characters(request: ServiceRequest) -> Response:
    """Answer with the characters of users, and files that cannot be used."""
    return responses.json_document(request.service.characters.document())


async def answer_sigma(request: ServiceRequest) -> Response:
    """Answer with sigma and support on a grid of two controls."""
    model, encoder = request.model, GRID_ENCODERS[request.format]
    question = await request.decode(SigmaQuestion)
    limit = request.service.settings.grid_limit
    if len(question) > limit:
        detail = f"{len(question)} points of columns and rows, expected at most {limit}"
        raise InvalidField("rows", detail)
    content = await run_in_thread(
        lambda: encoder.encode(trust.grid(model, question)), limiter=POSE_LIMITER
    )
    return responses.attachment(content, encoder, model.name)


async def answer_why(request: ServiceRequest) -> Response:
    """Answer with the captured clips behind an answer."""
    question = await request.decode(WhyQuestion)
    answer = await run_in_thread(
        trust.explain_result, request.model, question, limiter=POSE_LIMITER
    )
    return responses.json_document(model_tables.explanation(answer))


async def answer_suggestions(request: ServiceRequest) -> Response:
    """Answer with the control points to capture next.

    A thousand candidates take a tenth of a second and more.
    """
    question = await request.decode(SuggestQuestion)
    answer = await run_in_thread(trust.suggest, request.model, question)
    return responses.json_document(model_tables.suggestions(answer))


async def get_liveness(request: ServiceRequest) -> Response:
    """Answer with the liveness of the process."""
    return responses.json_document({"status": "live", "contract": request.service.contract})


async def get_readiness(request: ServiceRequest) -> Response:
    """Answer with the readiness of the service, and the models that the client may read.

    Each model was tested within the last second. Raises RequestError 503 if not ready.
    """
    assert request.principal is not None
    return responses.json_document(request.service.readiness.document(request.principal.may_read))


async def get_metrics(request: ServiceRequest) -> Response:
    """Answer with the metrics in Prometheus' text format."""
    models = request.service.readiness.models
    reloads = models.reloads
    counts = {"looks": reloads.looks, "opened": reloads.opened, "failed": reloads.failed}
    metrics.set_models(models.registry.identities, {**counts, "faults": len(reloads.faults)})
    return Response(metrics.metrics_text(), headers={"Content-Type": metrics.MEDIA_TYPE})


async def get_page(name: str, request: ServiceRequest) -> Response:
    """Answer with a static document, by its operationId."""
    page = request.service.pages[name]
    return Response(page.content, headers=page.headers, media_type=page.media_type)


_FORMATTED: dict[str, tuple[Handler, Mapping[str, Format]]] = {
    "getPose": (answer_pose, POSE_ENCODERS),
    "queryPose": (answer_pose, POSE_ENCODERS),
    "getClip": (answer_clip, CLIP_FORMATS),
    "queryClip": (answer_clip, CLIP_FORMATS),
    "queryClips": (answer_clips, ARCHIVE_WRITERS),
    "getCrowd": (answer_walk, WALK_FORMATS),
    "queryCrowd": (answer_crowd, CROWD_ENCODERS),
    "queryPerformance": (answer_performance, PERFORMANCE_FORMATS),
    "queryPerformances": (answer_performances, ARCHIVE_WRITERS),
    "getSigma": (answer_sigma, GRID_ENCODERS),
    "querySigma": (answer_sigma, GRID_ENCODERS),
}
FORMATS = {name: formats for name, (_, formats) in _FORMATTED.items()}
# Endings of paths, where they are more than the formats of Accept.
FORMATS |= {"getClipInFormat": CLIP_FILES, "queryClipInFormat": CLIP_FILES}
FORMATS |= {"queryTracksInFormat": TRACK_FORMATS}
"""Encoders of the operations that have formats, the default of Accept first."""
PAGES = ("getContract", "getContractJson", "getDocs", "getProblems", "getViewer")
OPERATIONS: dict[str, Handler] = {
    "listModels": list_models,
    "getModel": get_model,
    "getCharacter": get_character,
    "listCharacters": list_characters,
    "getWhy": answer_why,
    "queryWhy": answer_why,
    "getSuggestions": answer_suggestions,
    "getMetrics": get_metrics,
    "getLiveness": get_liveness,
    "getReadiness": get_readiness,
    **{name: partial(get_page, name) for name in PAGES},
    # The path without a format and the path with one have the same function.
    **{name: answer for name, (answer, _) in _FORMATTED.items()},
    **{f"{name}InFormat": answer for name, (answer, _) in _FORMATTED.items()},
    "queryTracksInFormat": answer_tracks,
}
"""Function of each operationId."""
