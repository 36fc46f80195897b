"""Handlers of the contract's operations: decode the request, evaluate the model, encode."""

from collections.abc import Iterator, Mapping
from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from posefield.batch import clip_archive as packing
from posefield.encode.archives import PACKS, Pack
from posefield.encode.formats import (
    CROWD_ENCODERS,
    CROWD_WRITERS,
    ENCODERS,
    GRID_ENCODERS,
    POSE_ENCODERS,
    CrowdWriter,
    Encoder,
    TableEncoder,
    poses_within,
)
from posefield.http import pose_operations, responses, trust_operations
from posefield.http.concurrency import worker_threads
from posefield.http.decoding import (
    clips_query,
    crowd_query,
    request_body,
    request_questions,
)
from posefield.http.service import Formatted, Handler, Service
from posefield.http.service import model as _model
from posefield.http.telemetry import metrics
from posefield.locomotion import crowd_order, gait
from posefield.locomotion.crowd_order import Order
from posefield.motion.crowd_clip import CrowdClip, CrowdPoses
from posefield.question.motion_question import FileQuestion
from posefield.question.walk_question import WalkQuestion
from posefield.synthesis import clips, crowd_synthesis
from posefield.synthesis.frame_times import MOST_POSES
from posefield.synthesis.synthesizer import Synthesizer

CrowdEncoder = TableEncoder[CrowdPoses]


async def list_models(service: Service, request: Request) -> Response:
    """Return the list of models."""
    return responses.document(responses.models(request.scope["library"]))


async def get_model(service: Service, request: Request) -> Response:
    """Return the card of a model."""
    return responses.document(responses.card(_model(request)))


async def get_clip(encoder: Encoder, service: Service, request: Request) -> Response:
    """Return a clip for the query parameters."""
    question = request_questions.of_url(FileQuestion, request)
    return await _clip(service, _model(request), question, encoder)


async def query_clip(encoder: Encoder, service: Service, request: Request) -> Response:
    """Return a clip for a JSON body."""
    question = await request_questions.of_body(
        FileQuestion, request, service.settings.body_limit, service.bodies
    )
    return await _clip(service, _model(request), question, encoder)


async def _clip(
    service: Service, model: Synthesizer, question: FileQuestion, encoder: Encoder
) -> Response:
    convention = encoder.convention(question.unit, question.up)
    joints = len(model.session.card.skeleton)
    most = poses_within(service.settings.output_limit, joints, encoder.per_joint)
    if model.keeper.measures or question.corrects:
        # A correction takes milliseconds, which would block the event loop.
        answer = await worker_threads.run(
            clips.clip, model, question, min(most, MOST_POSES), places=worker_threads.SOLVER
        )
    else:
        answer = clips.clip(model, question, min(most, MOST_POSES))
    if len(answer.clip) <= encoder.at_once:
        content = encoder.encode(answer, convention)
    else:
        content = await service.desk.file(encoder, convention, answer)
    return responses.file(content, encoder, answer.trust)


async def query_crowd(encoder: CrowdEncoder, service: Service, request: Request) -> Response:
    """Return the poses of a crowd for a JSON body."""
    model, settings = _model(request), service.settings
    content = await request_body.read(request, settings.crowd_body_limit, service.bodies)
    joints = len(model.session.card.skeleton)
    fits = poses_within(settings.output_limit, joints, encoder.per_joint)
    most = min(settings.crowd_limit, encoder.most, fits)
    made = await worker_threads.run(
        _crowd, model, encoder, content, most, places=worker_threads.CROWDS
    )
    return responses.attachment(made, encoder, model.name)


def _crowd(model: Synthesizer, encoder: CrowdEncoder, content: bytes, most: float) -> bytes:
    return encoder.encode(crowd_synthesis.poses(model, crowd_query.of_body(content, most)))


async def get_crowd(writer: CrowdWriter, service: Service, request: Request) -> Response:
    """Return a walking crowd for the query parameters, as a stream."""
    model, question = _model(request), request_questions.of_url(WalkQuestion, request)
    joints = len(model.session.card.skeleton)
    asked = crowd_query.walk_order(question, writer.extension, joints, service.settings)
    made, pieces = await worker_threads.run(
        _walking, model, asked, question.instancing, writer, places=worker_threads.CROWDS
    )
    warnings = _outside(float(made.facts["outside_share"]))
    return responses.streamed(
        responses.sent(pieces, worker_threads.CROWDS), writer, model, warnings
    )


def _walking(
    model: Synthesizer, asked: Order, instancing: str, writer: CrowdWriter
) -> tuple[CrowdClip, Iterator[bytes]]:
    made = crowd_order.crowd(model, gait.of(model.session), asked)
    return made, writer.stream(made, instancing)


def _outside(share: float) -> list[str]:
    said = f"{100 * share:.1f} % of the poses have some control outside what was sampled"
    return [said] if share else []


async def query_clips(
    encoders: Mapping[str, Encoder], pack: Pack, service: Service, request: Request
) -> Response:
    """Return an archive of many clips for a JSON body, as a stream."""
    model, settings = _model(request), service.settings
    content = await request_body.read(request, settings.clips_body_limit, service.bodies)
    order = await worker_threads.run(
        clips_query.order, model, encoders, content, settings, places=worker_threads.CLIPS
    )
    pieces = responses.gathered(pack.write(packing.members(order)))
    return responses.streamed(
        responses.sent(pieces, worker_threads.CLIPS), pack, model, order.warnings
    )


async def live(service: Service, request: Request) -> Response:
    """Return the liveness of the process."""
    return responses.document({"status": "live", "contract": service.contract})


async def ready(service: Service, request: Request) -> Response:
    """Return the readiness of the service, and the models that the client may read.

    Each model was tested within the last second. Raises RequestFault 503 if not ready.
    """
    return responses.document(service.readiness.document(request.scope["principal"].may_read))


async def get_metrics(service: Service, request: Request) -> Response:
    """Return the metrics in Prometheus' text format."""
    reloads = service.readiness.models.reloads
    counts = {"looks": reloads.looks, "opened": reloads.opened, "failed": reloads.failed}
    metrics.models(service.library.identities, {**counts, "faults": len(reloads.faults)})
    return Response(metrics.page(), headers={"Content-Type": metrics.MEDIA_TYPE})


async def get_page(name: str, service: Service, request: Request) -> Response:
    """Return a static document, by its operationId."""
    page = service.pages[name]
    return Response(page.content, headers=page.headers, media_type=page.media_type)


PAGES = ("getContract", "getContractJson", "getDocs", "getProblems", "getViewer")
# The default of Accept is binary USD.
_CLIP = {"usdc": ENCODERS["usdc"], **ENCODERS}
_WALK = {"usdc": CROWD_WRITERS["usdc"], **CROWD_WRITERS}
_FORMATTED: dict[str, Handler] = {
    "getPose": Formatted(POSE_ENCODERS, pose_operations.get_pose),
    "queryPose": Formatted(POSE_ENCODERS, pose_operations.query_pose),
    "getClip": Formatted(_CLIP, get_clip),
    "queryClip": Formatted(_CLIP, query_clip),
    "queryClips": Formatted(PACKS, partial(query_clips, ENCODERS)),
    "getCrowd": Formatted(_WALK, get_crowd),
    "queryCrowd": Formatted(CROWD_ENCODERS, query_crowd),
    "getSigma": Formatted(GRID_ENCODERS, trust_operations.get_sigma),
    "querySigma": Formatted(GRID_ENCODERS, trust_operations.query_sigma),
}
OPERATIONS: dict[str, Handler] = {
    "listModels": list_models,
    "getModel": get_model,
    "getWhy": trust_operations.get_why,
    "queryWhy": trust_operations.query_why,
    "getSuggestions": trust_operations.get_suggestions,
    "getMetrics": get_metrics,
    "getLiveness": live,
    "getReadiness": ready,
    **{name: partial(get_page, name) for name in PAGES},
    # The path without a format and the path with one have the same handler.
    **_FORMATTED,
    **{f"{name}InFormat": handler for name, handler in _FORMATTED.items()},
}
"""Handler of each operationId."""
