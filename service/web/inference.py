"""The Open Inference Protocol, version 2: models as other engines serve them."""

from functools import partial
from typing import Any

from anyio import to_thread
from starlette.requests import Request
from starlette.responses import Response

import service as package
from service.motion.errors import QueryError
from service.synthesis import ports, tensors
from service.synthesis.ports import LEVEL, PERFORMER
from service.synthesis.synthesizer import Synthesizer
from service.synthesis.tensors import TensorQuestion
from service.web import answers, body, inference_query, problems
from service.web import tensors as wire
from service.web.problems import RequestFault
from service.web.service import CROWDS, Handler, Service
from service.web.service import model as _model
from service.web.tensors import Received

HEADER = "Inference-Header-Content-Length"
JSON, BINARY = "application/json", "application/octet-stream"
# A question so short is for a few hundred poses at most, which hold nobody up.
INLINE_BYTES = 1024
# As JSON a pose takes ten kilobytes.
JSON_POSES = 10_000


async def get_server(service: Service, request: Request) -> Response:
    """What answers here."""
    extensions = ["binary_tensor_data"]
    return answers.document(
        {"name": "posefield", "version": package.__version__, "extensions": extensions}
    )


async def get_live(service: Service, request: Request) -> Response:
    """That the process answers."""
    return answers.document({"live": True})


async def get_ready(service: Service, request: Request) -> Response:
    """That its models answer."""
    service.readiness.document(request.scope["principal"].may_read)
    return answers.document({"ready": True})


async def get_model(service: Service, request: Request) -> Response:
    """A model's inputs and outputs; its versions are the hashes of its files."""
    model = _model(request)
    card, versions = model.session.card, request.scope["library"].versions(model.name)
    inputs = [
        _port("controls", "FP32", [-1, len(card.controls)]),
        _port("time", "FP32", [-1, -1]),
        *([_port(PERFORMER, "FP32", [-1, len(card.performers)])] if card.performers else []),
        _port(LEVEL, "INT64", []),
    ]
    return answers.document(
        {
            "name": model.name,
            "versions": [each.session.digest for each in versions],
            "platform": "onnxruntime_onnx",
            "inputs": inputs,
            "outputs": [_port(name, "FP32", s) for name, s in _outputs(len(card.skeleton)).items()],
        }
    )


async def get_model_ready(service: Service, request: Request) -> Response:
    """That a model answers."""
    return answers.document({"name": _model(request).name, "ready": True})


async def infer(service: Service, request: Request) -> Response:
    """Outputs of a model's graph for tensors."""
    model = _model(request)
    length = _length(request)
    content = await _content(request, service.settings.inference_body_limit)
    make = partial(_inferred, model, content, length, service.settings.inference_poses)
    if len(content) <= INLINE_BYTES:
        made, head = make()
    else:
        made, head = await to_thread.run_sync(make, limiter=CROWDS)
    if head is None:
        return Response(made, media_type=JSON)
    return Response(made, headers={HEADER: str(head)}, media_type=BINARY)


OPERATIONS: dict[str, Handler] = {
    "getInferenceServer": get_server,
    "getInferenceLiveness": get_live,
    "getInferenceReadiness": get_ready,
    "getInferenceModel": get_model,
    "getInferenceModelReadiness": get_model_ready,
    "infer": infer,
    "getInferenceVersion": get_model,
    "getInferenceVersionReadiness": get_model_ready,
    "inferVersion": infer,
}
"""Handler of each operationId."""


def _port(name: str, datatype: str, shape: list[int]) -> dict[str, Any]:
    return {"name": name, "datatype": datatype, "shape": shape}


def _outputs(joints: int) -> dict[str, list[int]]:
    """Shapes of the graph's outputs; -1 where they are the question's."""
    inner = {"rotations": [joints, 4], "root_position": [3], "bone_offsets": [joints, 3]}
    timed = ("rotations", "root_position", "travel")
    inner["travel"] = [3]
    return {
        name: [-1, *([-1] if name in timed else []), *inner.get(name, [])] for name in ports.OUTPUTS
    }


def _length(request: Request) -> int | None:
    """Bytes of the body's JSON, where the client says that there are others after it."""
    given = request.headers.get(HEADER)
    if given is None:
        return None
    if not (given.isascii() and given.isdigit() and len(given) < 10):
        detail = f"{HEADER} {given!r}, expected a whole number"
        raise RequestFault(problems.BAD_PARAMETER, detail, {"parameter": HEADER})
    return int(given)


async def _content(request: Request, limit: int) -> bytes:
    # The protocol names no media type, and clients of Triton send none.
    given = request.headers.get("content-type")
    if given is not None and given.partition(";")[0].strip().lower() not in (JSON, BINARY):
        detail = f"Content-Type {given!r}, expected {JSON!r} or {BINARY!r}"
        raise RequestFault(problems.NOT_JSON, detail)
    return await body.content(request, limit)


def _inferred(
    model: Synthesizer, content: bytes, length: int | None, most: int
) -> tuple[bytes, int | None]:
    asked = wire.received(content, length)
    inference_query.check_model(model, asked)
    binary = inference_query.outputs(asked)
    question = inference_query.question(model.session.card, asked)
    inference_query.check_size(question, most if all(binary.values()) else min(most, JSON_POSES))
    try:
        found = tensors.ask(model.session, question, tuple(binary))
    except QueryError as error:
        raise inference_query.at_input(asked, error) from None
    named = [(name, tensor, binary[name]) for name, tensor in zip(binary, found, strict=True)]
    return wire.answered(_head(model, asked, question), named)


def _head(model: Synthesizer, asked: Received, question: TensorQuestion) -> dict[str, Any]:
    """What an answer says before its outputs."""
    head: dict[str, Any] = {"model_name": model.name, "model_version": model.session.digest}
    if isinstance(asked.body.id, str):
        head["id"] = asked.body.id
    if said := tensors.outside(model.session.card, question.controls):
        head["parameters"] = {"warnings": "; ".join(said)}
    return head
