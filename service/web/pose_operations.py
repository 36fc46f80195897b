"""Poses in the formats that programs read; as JSON they are answered in `operations`."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.encode import POSE_ENCODERS, PoseEncoder
from service.synthesis.synthesizer import Synthesizer
from service.web import answers, body, query, service
from service.web.query import PoseQuestion
from service.web.service import Handler, Service

# 2,000 poses of 33 joints take a millisecond: mostly the graph's, not the encoder's.
AT_ONCE = 2000


async def get_pose(encoder: PoseEncoder, served: Service, request: Request) -> Response:
    """Poses in the encoder's format, asked for by query parameters."""
    model = service.model(request)
    question = query.pose_of_pairs(query.pairs(request.scope["query_string"]))
    return await _pose(model, question, encoder)


async def query_pose(encoder: PoseEncoder, served: Service, request: Request) -> Response:
    """Poses in the encoder's format, asked for by a body."""
    model = service.model(request)
    content = await body.read(request, served.settings.body_limit)
    return await _pose(model, query.pose_of_body(content), encoder)


async def _pose(model: Synthesizer, question: PoseQuestion, encoder: PoseEncoder) -> Response:
    quick = len(question.times) <= AT_ONCE
    content = await service.made(quick, partial(_answered, model, question, encoder))
    return answers.attachment(content, encoder.media_type, f"{model.name}.{encoder.extension}")


def _answered(model: Synthesizer, question: PoseQuestion, encoder: PoseEncoder) -> bytes:
    asked = question.controls, question.times, question.extrapolate
    return encoder.encode(model.pose(*asked, question.performer, question.level))


BINARY = {name: found for name, found in POSE_ENCODERS.items() if name != "json"}
OPERATIONS: dict[str, Handler] = {
    **{f"getPose{name.capitalize()}": partial(get_pose, e) for name, e in BINARY.items()},
    **{f"queryPose{name.capitalize()}": partial(query_pose, e) for name, e in BINARY.items()},
}
