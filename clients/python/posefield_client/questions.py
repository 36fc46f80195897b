"""What can be asked of a service and of a model: each question once, for both kinds of client.

Controls are keywords, or a mapping `controls` where Python keeps their names. What is left
out is left to the service, whose contract says what it then is.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeVar

import msgspec
import numpy.typing as npt

from posefield_client import asking, holding, numbers
from posefield_client.generated import (
    OPERATIONS,
    Liveness,
    ModelCard,
    ModelList,
    ModelSummary,
    PoseQuestion,
    Readiness,
    Reasons,
    SigmaQuestion,
    Suggestions,
    WhyQuestion,
)
from posefield_client.holding import Exact, Targets
from posefield_client.numbers import Pose, SigmaGrid
from posefield_client.wire import Call, Reply, Request

T = TypeVar("T")

Extrapolate = Literal["ok", "warn", "refuse"]
Controls = Mapping[str, float]
Times = float | Sequence[float] | npt.NDArray[Any]


def models() -> Call[tuple[ModelSummary, ...]]:
    """The models that the service answers for."""
    return Call(Request(OPERATIONS["listModels"], "/v1/models"), _models)


def live() -> Call[Liveness]:
    """That the process answers, and what contract it speaks."""
    return Call(Request(OPERATIONS["getLiveness"], "/livez"), _LIVENESS)


def ready() -> Call[Readiness]:
    """What the service has loaded; NotReady where it should not be asked now."""
    return Call(Request(OPERATIONS["getReadiness"], "/readyz"), _READINESS)


def card(model: str, /) -> Call[ModelCard]:
    """What the model says of itself."""
    return Call(asking.plain("getModel", model), _CARD)


def pose(
    model: str,
    /,
    times: Times,
    *,
    performer: str | None = None,
    level: int | None = None,
    joint_sigma: bool | None = None,
    extrapolate: Extrapolate | None = None,
    exact: Exact | None = None,
    targets: Targets | None = None,
    pin_feet: bool | None = None,
    controls: Controls | None = None,
    **named: float,
) -> Call[Pose]:
    """Poses at one or more times, s, of a motion that is held to targets, if some are given."""
    question = PoseQuestion(
        controls=asking.controls(controls, named),
        times=asking.numbers("times", times),
        **asking.said(extrapolate=extrapolate, performer=performer, level=level),
        **asking.said(joint_sigma=joint_sigma),
        **holding.said(exact, targets, pin_feet),
    )
    return Call(asking.either("PoseMsgpack", model, question), numbers.pose)


def why(
    model: str,
    /,
    *,
    nearest: int | None = None,
    performer: str | None = None,
    extrapolate: Extrapolate | None = None,
    controls: Controls | None = None,
    **named: float,
) -> Call[Reasons]:
    """The captured clips nearest to these controls, and what each counts for."""
    question = WhyQuestion(
        controls=asking.controls(controls, named),
        **asking.said(nearest=nearest, extrapolate=extrapolate, performer=performer),
    )
    return Call(asking.either("Why", model, question), _REASONS)


def suggest(
    model: str, /, *, count: int | None = None, performer: str | None = None
) -> Call[Suggestions]:
    """Which clips to capture next; performer: whose alone count as captured."""
    words = asking.said(count=count, performer=performer)
    return Call(asking.plain("getSuggestions", model, words), _SUGGESTIONS)


def sigma(
    model: str,
    /,
    across: str,
    along: str,
    *,
    columns: int | None = None,
    rows: int | None = None,
    margin: float | None = None,
    performer: str | None = None,
    controls: Controls | None = None,
    **named: float,
) -> Call[SigmaGrid]:
    """Sigma over all values of two controls, and beyond by a share (margin) of their ranges."""
    question = SigmaQuestion(
        across=across,
        along=along,
        controls=asking.controls(controls, named),
        **asking.said(columns=columns, rows=rows, margin=margin, performer=performer),
    )
    return Call(asking.either("SigmaMsgpack", model, question), numbers.grid)


class _Json:
    """Reads a schema of the contract from JSON."""

    def __init__(self, kind: type[T]) -> None:
        self._decoder = msgspec.json.Decoder(kind)

    def __call__(self, reply: Reply) -> Any:
        return self._decoder.decode(reply.content)


_LIVENESS, _READINESS = _Json(Liveness), _Json(Readiness)
_CARD, _REASONS, _LIST = _Json(ModelCard), _Json(Reasons), _Json(ModelList)
_SUGGESTIONS = _Json(Suggestions)


def _models(reply: Reply) -> tuple[ModelSummary, ...]:
    found: ModelList = _LIST(reply)
    return found.models
