"""Requests to a service and to a model, shared by both clients.

Controls are keywords, or a mapping `controls` for names that Python reserves. Arguments that are
left out take the defaults of the service's contract.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeVar

import msgspec
import numpy.typing as npt

from posefield_client import asking, holding, numbers
from posefield_client.generated import (
    OPERATIONS,
    CharacterList,
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
Labels = Mapping[str, str | Mapping[str, float]]
"""Name, or weights of names, by label set: {"style": {"angry": 0.7, "happy": 0.3}}."""
Times = float | Sequence[float] | npt.NDArray[Any]


def models() -> Call[tuple[ModelSummary, ...]]:
    """Return the models of the service."""
    return Call(Request(OPERATIONS["listModels"], "/v1/models"), _models)


def characters() -> Call[CharacterList]:
    """Return the characters of users, to which motions are delivered."""
    return Call(Request(OPERATIONS["listCharacters"], "/v1/characters"), _CHARACTERS)


def live() -> Call[Liveness]:
    """Return the liveness of the process, with its contract version."""
    return Call(Request(OPERATIONS["getLiveness"], "/livez"), _LIVENESS)


def ready() -> Call[Readiness]:
    """Return the loaded models; NotReady if the service is not ready."""
    return Call(Request(OPERATIONS["getReadiness"], "/readyz"), _READINESS)


def card(model: str, /) -> Call[ModelCard]:
    """Return the model card."""
    return Call(asking.plain("getModel", model), _CARD)


def character(model: str, /) -> Call[bytes]:
    """Return the character at rest as binary glTF: joints and the body skinned to them."""
    return Call(asking.plain("getCharacter", model), _content)


def kernel(model: str, /) -> Call[bytes]:
    """Return the model's numbers for a graphics card, a safetensors file."""
    return Call(asking.plain("getKernel", model), _content)


def pose(
    model: str,
    /,
    times: Times,
    *,
    performer: str | None = None,
    labels: Labels | None = None,
    level: int | None = None,
    joint_sigma: bool | None = None,
    extrapolate: Extrapolate | None = None,
    exact: Exact | None = None,
    targets: Targets | None = None,
    take: int | None = None,
    variety: float | None = None,
    detail: bool | None = None,
    controls: Controls | None = None,
    **named: float,
) -> Call[Pose]:
    """Return poses at one or more times, s, with constraints if given."""
    question = PoseQuestion(
        controls=asking.controls(controls, named),
        times=asking.numbers("times", times),
        **asking.said(extrapolate=extrapolate, performer=performer, level=level),
        **asking.said(joint_sigma=joint_sigma, labels=labels),
        **asking.said(take=take, variety=variety, detail=detail),
        **holding.said(exact, targets),
    )
    return Call(asking.either("PoseInFormat", model, question, "msgpack"), numbers.pose)


def why(
    model: str,
    /,
    *,
    nearest: int | None = None,
    performer: str | None = None,
    labels: Labels | None = None,
    extrapolate: Extrapolate | None = None,
    controls: Controls | None = None,
    **named: float,
) -> Call[Reasons]:
    """Return the captured clips nearest to these controls, and their weights."""
    question = WhyQuestion(
        controls=asking.controls(controls, named),
        **asking.said(nearest=nearest, extrapolate=extrapolate),
        **asking.said(performer=performer, labels=labels),
    )
    return Call(asking.either("Why", model, question), _REASONS)


def suggest(
    model: str,
    /,
    *,
    count: int | None = None,
    performer: str | None = None,
    labels: Labels | None = None,
) -> Call[Suggestions]:
    """Return the clips to capture next. performer, labels: whose clips count as captured."""
    words = asking.said(count=count, performer=performer) | asking.label_words(labels or {})
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
    labels: Labels | None = None,
    controls: Controls | None = None,
    **named: float,
) -> Call[SigmaGrid]:
    """Return sigma over the ranges of two controls, extended by a share `margin`."""
    question = SigmaQuestion(
        across=across,
        along=along,
        controls=asking.controls(controls, named),
        **asking.said(columns=columns, rows=rows, margin=margin),
        **asking.said(performer=performer, labels=labels),
    )
    return Call(asking.either("SigmaInFormat", model, question, "msgpack"), numbers.grid)


class _Json:
    """Decoder of a schema of the contract from JSON."""

    def __init__(self, kind: type[T]) -> None:
        self._decoder = msgspec.json.Decoder(kind)

    def __call__(self, reply: Reply) -> Any:
        return self._decoder.decode(reply.content)


_LIVENESS, _READINESS = _Json(Liveness), _Json(Readiness)
_CHARACTERS = _Json(CharacterList)
_CARD, _REASONS, _LIST = _Json(ModelCard), _Json(Reasons), _Json(ModelList)
_SUGGESTIONS = _Json(Suggestions)


def _models(reply: Reply) -> tuple[ModelSummary, ...]:
    found: ModelList = _LIST(reply)
    return found.models


def _content(reply: Reply) -> bytes:
    return reply.content
