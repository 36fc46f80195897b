"""The question of an inference request: its tensors by name, as the graph takes them."""

import numpy as np

from service.motion.card import ModelCard
from service.motion.conventions import Singles
from service.motion.errors import InvalidField, QueryError
from service.synthesis import ports
from service.synthesis.ports import LEVEL, PERFORMER
from service.synthesis.synthesizer import Synthesizer
from service.synthesis.tensors import TensorQuestion
from service.web import problems
from service.web.problems import RequestFault, pointer
from service.web.tensors import Received, Tensor, unfit


def check_model(model: Synthesizer, asked: Received) -> None:
    """RequestFault where the body names another model than the path."""
    named = {
        "model_name": (asked.body.model_name, (model.name, model.identity)),
        "model_version": (asked.body.model_version, (model.session.digest,)),
    }
    for member, (given, known) in named.items():
        if isinstance(given, str) and given not in known:
            raise unfit(f"{given!r}, expected {known[0]!r} as in the path", pointer(member))


def question(card: ModelCard, asked: Received) -> TensorQuestion:
    """Question of the inputs; RequestFault for one that is missing, unknown, given twice, or of
    another kind than the graph takes."""
    names = [given.name for given in asked.body.inputs]
    known = [*ports.INPUTS, *([PERFORMER] if card.performers else []), LEVEL]
    for index, name in enumerate(names):
        if name not in known or name in names[:index]:
            detail = f"{name!r}, expected each of {', '.join(known)} at most once"
            raise unfit(detail, pointer("inputs", str(index), "name"))
    tensors = dict(zip(names, asked.tensors, strict=True))
    try:
        controls, times = (_table(tensors, name) for name in ports.INPUTS)
        labels = _table(tensors, PERFORMER) if PERFORMER in tensors else None
        return TensorQuestion(controls, times, labels, _level(tensors))
    except QueryError as error:
        raise at_input(asked, error) from None


def outputs(asked: Received) -> dict[str, bool]:
    """Whether each output is sent as bytes, by name, in the order asked for; all where none was."""
    usual = asked.body.parameters.binary_data_output
    if not asked.body.outputs:
        return dict.fromkeys(ports.OUTPUTS, usual)
    found: dict[str, bool] = {}
    for index, output in enumerate(asked.body.outputs):
        if output.name not in ports.OUTPUTS or output.name in found:
            detail = f"{output.name!r}, expected each of {', '.join(ports.OUTPUTS)} at most once"
            raise unfit(detail, pointer("outputs", str(index), "name"))
        own = output.parameters.binary_data
        found[output.name] = own if isinstance(own, bool) else usual
    return found


def check_size(asked: TensorQuestion, most: int) -> None:
    """RequestFault for more poses than are answered at once."""
    if asked.times.size > most:
        raise unfit(f"{asked.times.size} poses in all, expected at most {most}", "/inputs")


def at_input(asked: Received, error: QueryError) -> RequestFault:
    """The same fault of the input that it names."""
    names = [given.name for given in asked.body.inputs]
    where = ["inputs", *([str(names.index(error.field))] if error.field in names else [])]
    return RequestFault(problems.TABLE[type(error)], str(error), {"pointer": pointer(*where)})


def _table(tensors: dict[str, Tensor], name: str) -> Singles:
    """Rows of float32; InvalidField where there are none."""
    if name not in tensors:
        raise InvalidField(name, "missing, expected FP32 of two axes")
    found = tensors[name]
    if found.ndim != 2 or found.dtype.kind != "f":
        shown = f"{found.dtype.name} of shape {list(found.shape)}"
        raise InvalidField(name, f"{shown}, expected FP32 or FP64 of two axes")
    with np.errstate(over="ignore"):
        return found.astype(np.float32, copy=False)


def _level(tensors: dict[str, Tensor]) -> int:
    found = tensors.get(LEVEL)
    if found is None:
        return 0
    if found.size != 1 or found.dtype.kind != "i":
        shown = f"{found.dtype.name} of shape {list(found.shape)}"
        raise InvalidField(LEVEL, f"{shown}, expected one INT64")
    return int(found.item())
