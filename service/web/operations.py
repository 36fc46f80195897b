"""Handlers of the contract's operations: decode the request, evaluate the model, encode."""

from collections.abc import Iterator, Mapping
from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.encode import (
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
from service.encode.packs import PACKS, Pack
from service.export import pack as packing
from service.motion.crowd import CrowdClip, CrowdPoses
from service.question.motion_question import FileQuestion
from service.question.walk_question import WalkQuestion
from service.synthesis import clips, crowd
from service.synthesis.course import MOST_POSES
from service.synthesis.synthesizer import Synthesizer
from service.synthesis.walk import gait, order
from service.synthesis.walk.order import Order
from service.web import (
    answers,
    body,
    clips_query,
    crowd_query,
    metrics,
    pages,
    pose_operations,
    questions,
    sending,
    threads,
    trust_operations,
    walk_query,
)
from service.web.service import Formatted, Handler, Service
from service.web.service import model as _model

CrowdEncoder = TableEncoder[CrowdPoses]


async def list_models(service: Service, request: Request) -> Response:
    """Return the list of models."""
    return answers.document(answers.models(request.scope["library"]))


async def get_model(service: Service, request: Request) -> Response:
    """Return the card of a model."""
    return answers.document(answers.card(_model(request)))


async def get_clip(encoder: Encoder, service: Service, request: Request) -> Response:
    """Return a clip for the query parameters."""
    question = questions.of_url(FileQuestion, request)
    return await _clip(service, _model(request), question, encoder)


async def query_clip(encoder: Encoder, service: Service, request: Request) -> Response:
    """Return a clip for a JSON body."""
    question = await questions.of_body(FileQuestion, service, request)
    return await _clip(service, _model(request), question, encoder)


async def _clip(
    service: Service, model: Synthesizer, question: FileQuestion, encoder: Encoder
) -> Response:
    convention = encoder.convention(question.unit, question.up)
    joints = len(model.session.card.skeleton)
    most = poses_within(service.settings.output_limit, joints, encoder.per_joint)
    if model.keeper.measures or question.corrects:
        # A correction takes milliseconds, which would block the event loop.
        answer = await threads.run(
            clips.clip, model, question, min(most, MOST_POSES), places=threads.SOLVER
        )
    else:
        answer = clips.clip(model, question, min(most, MOST_POSES))
    if len(answer.clip) <= encoder.at_once:
        content = encoder.encode(answer, convention)
    else:
        content = await service.desk.file(encoder, convention, answer)
    return answers.file(content, encoder, answer.trust)


async def query_crowd(encoder: CrowdEncoder, service: Service, request: Request) -> Response:
    """Return the poses of a crowd for a JSON body."""
    model, settings = _model(request), service.settings
    content = await body.read(request, settings.crowd_body_limit, service.bodies)
    joints = len(model.session.card.skeleton)
    fits = poses_within(settings.output_limit, joints, encoder.per_joint)
    most = min(settings.crowd_limit, encoder.most, fits)
    made = await threads.run(_crowd, model, encoder, content, most, places=threads.CROWDS)
    return answers.attachment(made, encoder, model.name)


def _crowd(model: Synthesizer, encoder: CrowdEncoder, content: bytes, most: float) -> bytes:
    return encoder.encode(crowd.poses(model, crowd_query.of_body(content, most)))


async def get_crowd(writer: CrowdWriter, service: Service, request: Request) -> Response:
    """Return a walking crowd for the query parameters, as a stream."""
    model, question = _model(request), questions.of_url(WalkQuestion, request)
    joints = len(model.session.card.skeleton)
    asked = walk_query.order(question, writer.extension, joints, service.settings)
    made, pieces = await threads.run(
        _walking, model, asked, question.instancing, writer, places=threads.CROWDS
    )
    warnings = _outside(float(made.facts["outside_share"]))
    return answers.streamed(sending.sent(pieces, threads.CROWDS), writer, model, warnings)


def _walking(
    model: Synthesizer, asked: Order, instancing: str, writer: CrowdWriter
) -> tuple[CrowdClip, Iterator[bytes]]:
    made = order.crowd(model, gait.of(model.session), asked)
    return made, writer.stream(made, instancing)


def _outside(share: float) -> list[str]:
    said = f"{100 * share:.1f} % of the poses have some control outside what was sampled"
    return [said] if share else []


async def query_clips(
    encoders: Mapping[str, Encoder], pack: Pack, service: Service, request: Request
) -> Response:
    """Return an archive of many clips for a JSON body, as a stream."""
    model, settings = _model(request), service.settings
    content = await body.read(request, settings.clips_body_limit, service.bodies)
    order = await threads.run(
        clips_query.order, model, encoders, content, settings, places=threads.CLIPS
    )
    pieces = sending.gathered(pack.write(packing.members(order)))
    return answers.streamed(sending.sent(pieces, threads.CLIPS), pack, model, order.warnings)


async def live(service: Service, request: Request) -> Response:
    """Return the liveness of the process."""
    return answers.document({"status": "live", "contract": service.contract})


async def ready(service: Service, request: Request) -> Response:
    """Return the readiness of the service, and the models that the client may read.

    Each model was tested within the last second. Raises RequestFault 503 if not ready.
    """
    return answers.document(service.readiness.document(request.scope["principal"].may_read))


async def get_metrics(service: Service, request: Request) -> Response:
    """Return the metrics in Prometheus' text format."""
    reloads = service.readiness.models.reloads
    counts = {"looks": reloads.looks, "opened": reloads.opened, "failed": reloads.failed}
    metrics.models(service.library.identities, {**counts, "faults": len(reloads.faults)})
    return Response(metrics.page(), headers={"Content-Type": metrics.MEDIA_TYPE})


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
    **pages.OPERATIONS,
    # The path without a format and the path with one have the same handler.
    **_FORMATTED,
    **{f"{name}InFormat": handler for name, handler in _FORMATTED.items()},
}
"""Handler of each operationId."""
