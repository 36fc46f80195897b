"""What each operation of the contract does: decode, ask, encode."""

from collections.abc import Iterator, Mapping
from functools import partial

from anyio import to_thread
from starlette.requests import Request
from starlette.responses import Response

from service.encode import (
    CROWD_ENCODERS,
    ENCODERS,
    POSE_ENCODERS,
    CrowdEncoder,
    Encoder,
    poses_within,
)
from service.encode import crowd as crowd_usd
from service.encode.grids import GRID_ENCODERS
from service.encode.packs import PACKS, Pack
from service.export import pack as packing
from service.motion.crowd import CrowdClip
from service.synthesis import clips, crowd
from service.synthesis.course import MOST_POSES
from service.synthesis.question import HOLD
from service.synthesis.synthesizer import Synthesizer
from service.synthesis.walk import gait, order
from service.web import (
    answers,
    body,
    clips_query,
    crowd_query,
    inference,
    metrics,
    pages,
    pose_operations,
    query,
    sending,
    sigma_operations,
    suggestion_operations,
    walk_query,
    why_operations,
)
from service.web.negotiation import Format, Negotiated
from service.web.query import FileQuestion
from service.web.service import CLIPS, CROWDS, Handler, Service
from service.web.service import model as _model
from service.web.walk_query import WalkQuestion


async def list_models(service: Service, request: Request) -> Response:
    """Which models there are."""
    return answers.document(answers.models(request.scope["library"]))


async def get_model(service: Service, request: Request) -> Response:
    """What a model says of itself."""
    return answers.document(answers.card(_model(request)))


async def get_clip(encoder: Encoder, service: Service, request: Request) -> Response:
    """A clip in the encoder's format, asked for by query parameters."""
    model = _model(request)
    question = query.file_of_pairs(query.pairs(request.scope["query_string"]))
    return await _clip(service, model, question, encoder)


async def query_clip(encoder: Encoder, service: Service, request: Request) -> Response:
    """A clip in the encoder's format, asked for by a body."""
    model = _model(request)
    content = await body.read(request, service.settings.body_limit)
    return await _clip(service, model, query.file_of_body(content), encoder)


async def query_crowd(encoder: CrowdEncoder, service: Service, request: Request) -> Response:
    """Poses of a crowd in the encoder's format, asked for by a body."""
    model, settings = _model(request), service.settings
    content = await body.read(request, settings.crowd_body_limit)
    joints = len(model.session.card.skeleton)
    fits = poses_within(settings.output_limit, joints, encoder.per_joint)
    most = min(settings.crowd_limit, encoder.most, fits)
    made = await to_thread.run_sync(_crowd, model, encoder, content, most, limiter=CROWDS)
    return answers.attachment(made, encoder.media_type, f"{model.name}.{encoder.extension}")


def _crowd(model: Synthesizer, encoder: CrowdEncoder, content: bytes, most: float) -> bytes:
    return encoder.encode(crowd.poses(model, crowd_query.of_body(content, most)))


async def get_crowd(ending: str, service: Service, request: Request) -> Response:
    """A crowd that walks, as USD that is sent while it is made."""
    model, pairs = _model(request), query.pairs(request.scope["query_string"])
    question = walk_query.of_pairs(pairs, service.settings)
    made, pieces = await to_thread.run_sync(_walking, model, question, ending, limiter=CROWDS)
    name, media_type = f"{model.name}.{ending}", ENCODERS[ending].media_type
    sent, warnings = sending.sent(pieces, CROWDS), _outside(float(made.facts["outside_share"]))
    return answers.streamed(sent, media_type, name, model.identity, warnings)


def _walking(
    model: Synthesizer, question: WalkQuestion, ending: str
) -> tuple[CrowdClip, Iterator[bytes]]:
    made = order.crowd(model, gait.of(model.session), question.order)
    return made, crowd_usd.stream(made, ending, question.instancing)


def _outside(share: float) -> list[str]:
    said = f"{100 * share:.1f} % of the poses have some control outside what was sampled"
    return [said] if share else []


async def query_clips(
    encoders: Mapping[str, Encoder], pack: Pack, service: Service, request: Request
) -> Response:
    """Many clips in an archive that is sent while they are made, asked for by a body."""
    model, settings = _model(request), service.settings
    content = await body.read(request, settings.clips_body_limit)
    order = await to_thread.run_sync(
        clips_query.order, model, encoders, content, settings, limiter=CLIPS
    )
    pieces = sending.gathered(pack.write(packing.members(order)))
    name = f"{model.name}.{pack.extension}"
    return answers.streamed(
        sending.sent(pieces, CLIPS), pack.media_type, name, model.identity, order.warnings
    )


async def live(service: Service, request: Request) -> Response:
    """That the process answers."""
    return answers.document({"status": "live", "contract": service.contract})


async def ready(service: Service, request: Request) -> Response:
    """Which models answer, each having been asked just now.

    Whoever is not known hears that they do, and no names.
    """
    return answers.document(service.readiness.document(request.scope["principal"].may_read))


async def get_metrics(service: Service, request: Request) -> Response:
    """What is counted, for Prometheus."""
    reloads = service.readiness.models.reloads
    counts = {"looks": reloads.looks, "opened": reloads.opened, "failed": reloads.failed}
    metrics.models(service.library.identities, {**counts, "faults": len(reloads.faults)})
    return Response(metrics.page(), headers={"Content-Type": metrics.MEDIA_TYPE})


_FIXED: dict[str, Handler] = {
    "listModels": list_models,
    "getModel": get_model,
    **pose_operations.OPERATIONS,
    **sigma_operations.OPERATIONS,
    **why_operations.OPERATIONS,
    **suggestion_operations.OPERATIONS,
    **inference.OPERATIONS,
    **{f"getClip{name.capitalize()}": partial(get_clip, e) for name, e in ENCODERS.items()},
    **{f"queryClip{name.capitalize()}": partial(query_clip, e) for name, e in ENCODERS.items()},
    **{f"queryCrowd{n.capitalize()}": partial(query_crowd, e) for n, e in CROWD_ENCODERS.items()},
    **{f"getCrowd{n.capitalize()}": partial(get_crowd, n) for n in crowd_usd.STREAMS},
    **{f"queryClips{n.capitalize()}": partial(query_clips, ENCODERS, p) for n, p in PACKS.items()},
    "getMetrics": get_metrics,
    "getLiveness": live,
    "getReadiness": ready,
    **pages.OPERATIONS,
}


def _negotiated(stem: str, formats: Mapping[str, Format]) -> Handler:
    """Handler of an operation whose formats, the usual one first, have operations of their own."""
    offers = tuple((name, found.media_type) for name, found in formats.items())
    return Negotiated(offers, {name: _FIXED[f"{stem}{name.capitalize()}"] for name in formats})


_USD = {name: ENCODERS[name] for name in ("usdc", "usda", "usdz")}
_CLIP = _USD | ENCODERS
OPERATIONS: dict[str, Handler] = {
    **_FIXED,
    "getPose": _negotiated("getPose", POSE_ENCODERS),
    "queryPose": _negotiated("queryPose", POSE_ENCODERS),
    "getClip": _negotiated("getClip", _CLIP),
    "queryClip": _negotiated("queryClip", _CLIP),
    "queryClips": _negotiated("queryClips", PACKS),
    "getCrowd": _negotiated("getCrowd", _USD),
    "queryCrowd": _negotiated("queryCrowd", CROWD_ENCODERS),
    "getSigma": _negotiated("getSigma", GRID_ENCODERS),
    "querySigma": _negotiated("querySigma", GRID_ENCODERS),
}
"""Handler of each operationId."""


async def _clip(
    service: Service, model: Synthesizer, question: FileQuestion, encoder: Encoder
) -> Response:
    convention = encoder.convention(question.unit, question.up)
    joints = len(model.session.card.skeleton)
    most = poses_within(service.settings.output_limit, joints, encoder.per_joint)
    if model.keeper.measures or question.clip.hold != HOLD:
        # A correction takes some milliseconds, in which others would wait.
        answer = await to_thread.run_sync(clips.clip, model, question.clip, min(most, MOST_POSES))
    else:
        answer = clips.clip(model, question.clip, min(most, MOST_POSES))
    if len(answer.clip) <= encoder.at_once:
        content = encoder.encode(answer, convention)
    else:
        content = await service.desk.file(encoder, convention, answer)
    return answers.file(content, encoder, answer.trust)
