"""Operations that answer with one motion: poses, and a clip as a file."""

from typing import Any

from starlette.responses import Response

from posefield.characters import delivery
from posefield.constraints.targets import ConstraintSet
from posefield.encode.archives import JSON
from posefield.encode.formats import (
    ALL_ENCODERS,
    CLIP_ENCODERS,
    POSE_ENCODERS,
    ROBOT_ENCODERS,
    ClipEncoder,
    TableEncoder,
    max_poses,
)
from posefield.http import batching, responses
from posefield.http.batching import POSE_LIMITER, SYNTHESIS_LIMITER, run_in_thread
from posefield.http.request import ServiceRequest
from posefield.question.motion_question import FileQuestion, PoseQuestion
from posefield.question.results import ClipAnswer, PoseAnswer
from posefield.robots import robot_clip
from posefield.synthesis import clip_draft, clips, poses
from posefield.synthesis.poses import MAX_POSES, PreparedPoseQuestion
from posefield.synthesis.synthesizer import Synthesizer

# The default of Accept is binary USD.
CLIP_FORMATS = {"usdc": CLIP_ENCODERS["usdc"], **CLIP_ENCODERS}
CLIP_FILES = {**CLIP_FORMATS, **ROBOT_ENCODERS}
"""Formats that end a path; reference motions of robots have equal media types."""


async def answer_pose(request: ServiceRequest) -> Response:
    """Answer with poses: of the constraint solver, of the graph, or of a batch of requests."""
    model, encoder = request.model, POSE_ENCODERS[request.format]
    question = await request.decode(PoseQuestion)
    if question.targets:
        # Open controls are inferred from predictions of every captured clip, which takes time.
        prepared = await run_in_thread(poses.prepare, model, question, limiter=POSE_LIMITER)
    else:
        prepared = poses.prepare(model, question)
    constraints = model.constraints(prepared.validated, question)
    if constraints is not None or len(question.times) > encoder.inline_limit:
        content = await run_in_thread(
            _encode_poses, model, encoder, prepared, constraints, limiter=POSE_LIMITER
        )
    else:
        row = await request.service.pose_batcher.row(model, prepared)
        content = encoder.encode(poses.build_answer(model, prepared, row))
    if encoder.media_type == JSON:
        return Response(content, media_type=JSON)
    return responses.attachment(content, encoder, model.name)


def _encode_poses(
    model: Synthesizer,
    encoder: TableEncoder[PoseAnswer[Any]],
    prepared: PreparedPoseQuestion,
    constraints: ConstraintSet | None,
) -> bytes:
    if constraints is not None:
        return encoder.encode(poses.synthesize_constrained(model, prepared, constraints))
    (row,) = poses.run_batch(model, [prepared])
    return encoder.encode(poses.build_answer(model, prepared, row))


async def answer_clip(request: ServiceRequest) -> Response:
    """Answer with one clip as a file, and the facts of its trust in headers."""
    model, encoder = request.model, ALL_ENCODERS[request.format]
    if encoder.of_robots:
        robot_clip.require(model.session.card.robot, encoder.extension)
    question = await request.decode(FileQuestion)
    if question.character is not None:
        return await _answer_delivered_clip(request, encoder, question, question.character)
    convention = encoder.convention(question.unit, question.up, question.body)
    longest = _frame_limit(request, encoder, 0)
    batcher = request.service.clip_batcher
    if clip_draft.is_predicted(model, question):
        answer, content = await batcher.clip(model, question, longest, encoder, convention)
    else:
        # A correction takes milliseconds, which would block the event loop.
        async with SYNTHESIS_LIMITER:
            answer = await batching.within(clips.synthesize_clip, model, question, longest)
            content = await batcher.file(encoder, convention, answer)
    return responses.clip_file(content, encoder, encoder.noted(answer).trust)


async def _answer_delivered_clip(
    request: ServiceRequest, encoder: ClipEncoder, question: FileQuestion, character: str
) -> Response:
    model, card = request.model, request.model.session.card
    order = delivery.deliver(request.service.characters.find(character), encoder, question)
    order.check(question, card.skeleton, card.roles)
    longest = _frame_limit(request, encoder, order.joints)

    def work() -> tuple[ClipAnswer, bytes]:
        answer = clips.synthesize_clip(model, question, longest)
        delivered = order.clip(answer, question, card.roles)
        return delivered, order.encode(delivered)

    answer, content = await run_in_thread(work)
    return responses.clip_file(content, encoder, encoder.noted(answer).trust)


def _frame_limit(request: ServiceRequest, encoder: ClipEncoder, joints: int) -> int:
    """Return the largest number of frames of a clip; joints: of the character of a user."""
    card = request.model.session.card
    joints = max(joints, len(card.skeleton))
    limit = request.service.settings.output_limit
    return min(max_poses(limit, joints, encoder, len(card.curves)), MAX_POSES)
