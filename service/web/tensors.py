"""Tensors as the Open Inference Protocol sends them: JSON, and after it the bytes of those that
are binary, in their order."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
import numpy.typing as npt
import orjson
from msgspec import UNSET, Meta, Struct, UnsetType

from service.motion.conventions import Singles
from service.motion.errors import InvalidField
from service.web import decoding, problems
from service.web.problems import RequestFault, pointer

Tensor = npt.NDArray[Any]
# As they travel: little-endian, row by row.
TYPES = {"FP32": "<f4", "FP64": "<f8", "INT64": "<i8"}
# JSON has one kind of number: 1.0 is a whole one, and beyond this one it may have been rounded.
EXACT = 2**53
Size = Annotated[float, Meta(ge=0, le=EXACT, multiple_of=1)]


class InputParameters(Struct, frozen=True):
    """What is read of a tensor's parameters; the protocol leaves others open."""

    binary_data_size: Size | UnsetType = UNSET


class InputBody(Struct, frozen=True, forbid_unknown_fields=True):
    """Schema InferenceInput of the contract."""

    name: str
    shape: list[Size]
    datatype: Literal["FP32", "FP64", "INT64"]
    data: list[float | list[float]] | UnsetType = UNSET
    parameters: InputParameters = InputParameters()


class OutputParameters(Struct, frozen=True):
    """What is read of an output's parameters."""

    binary_data: bool | UnsetType = UNSET


class OutputBody(Struct, frozen=True, forbid_unknown_fields=True):
    """Schema InferenceOutputQuestion of the contract."""

    name: str
    parameters: OutputParameters = OutputParameters()


class InferenceParameters(Struct, frozen=True):
    """What is read of a request's parameters."""

    binary_data_output: bool = False


class InferenceBody(Struct, frozen=True, forbid_unknown_fields=True):
    """Schema InferenceQuestion of the contract."""

    inputs: list[InputBody]
    outputs: list[OutputBody] = []
    id: str | UnsetType = UNSET
    # The path says both; clients of KServe say the first once more.
    model_name: str | UnsetType = UNSET
    model_version: str | UnsetType = UNSET
    parameters: InferenceParameters = InferenceParameters()


_BODY = msgspec.json.Decoder(InferenceBody)


@dataclass(frozen=True)
class Received:
    """What was asked, and its inputs as arrays of the shapes that they were given."""

    body: InferenceBody
    tensors: tuple[Tensor, ...]


def received(content: bytes, length: int | None) -> Received:
    """Question of a body whose JSON takes so many bytes, or all of them.

    RequestFault where the body breaks the contract's form, or its parts do not fit each other.
    """
    split = len(content) if length is None else length
    if split > len(content):
        raise decoding.bad_body(f"{len(content)} bytes, expected {split} of JSON", "")
    body = decoding.decoded(_BODY, content[:split])
    return Received(body, tuple(_tensors(body, memoryview(content)[split:])))


def _tensors(body: InferenceBody, rest: memoryview) -> Iterator[Tensor]:
    for index, given in enumerate(body.inputs):
        where = pointer("inputs", str(index))
        shape, size = [int(axis) for axis in given.shape], given.parameters.binary_data_size
        if (size is UNSET) == (given.data is UNSET):
            raise unfit("expected either data or binary_data_size", where)
        if isinstance(size, float):
            yield _binary(given, shape, rest[: int(size)], where)
            rest = rest[int(size) :]
        else:
            yield _listed(given, shape, where + "/data")
    if rest:
        raise unfit(f"{len(rest)} bytes more than binary_data_size of all inputs", "/inputs")


def _binary(given: InputBody, shape: list[int], content: memoryview, where: str) -> Tensor:
    kind = np.dtype(TYPES[given.datatype])
    expected = math.prod(shape) * kind.itemsize
    if not len(content) == given.parameters.binary_data_size == expected:
        raise unfit(f"{len(content)} bytes, expected {expected} for shape {shape}", where)
    return np.frombuffer(content, kind).reshape(shape)


def _listed(given: InputBody, shape: list[int], where: str) -> Tensor:
    """Numbers of one list, row by row, or of one of lists."""
    try:
        found = np.array(given.data, dtype=np.float64)
    except ValueError:
        raise unfit("lists of several lengths, expected one", where) from None
    flat = found.ndim == 1 and found.size == math.prod(shape)
    if not flat and list(found.shape) != shape:
        raise unfit(f"data of shape {list(found.shape)}, expected {shape}", where)
    if given.datatype == "INT64" and ((found % 1 != 0) | (abs(found) > EXACT)).any():
        raise unfit("expected whole numbers that a double can hold", where)
    # What a float32 cannot hold is infinite, and refused with all that is out of reach.
    with np.errstate(over="ignore"):
        return found.astype(TYPES[given.datatype]).reshape(shape)


def unfit(detail: str, where: str) -> RequestFault:
    """Refusal of what keeps the contract's form, but of which no tensor can be made."""
    return RequestFault(problems.TABLE[InvalidField], detail, {"pointer": where})


def answered(
    head: Mapping[str, Any], named: Sequence[tuple[str, Singles, bool]]
) -> tuple[bytes, int | None]:
    """Body of an answer of tensors (name, values, whether binary), and bytes of its JSON where not
    all of it is."""
    outputs, rest = [], []
    for name, tensor, binary in named:
        shown: dict[str, Any] = {"name": name, "datatype": "FP32", "shape": tensor.shape}
        if binary:
            rest.append(tensor.astype(TYPES["FP32"], copy=False).tobytes())
            shown["parameters"] = {"binary_data_size": len(rest[-1])}
        else:
            shown["data"] = np.ascontiguousarray(tensor).ravel()
        outputs.append(shown)
    text = orjson.dumps({**head, "outputs": outputs}, option=orjson.OPT_SERIALIZE_NUMPY)
    return b"".join([text, *rest]), len(text) if rest else None
