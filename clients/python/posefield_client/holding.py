"""Constraints of poses and clips: exact measured controls, and target positions of joints."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import msgspec
from msgspec import UNSET

from posefield_client import asking
from posefield_client.errors import WrongQuestion
from posefield_client.generated import Floor, Target

Exact = Literal["auto", "none"] | str | Sequence[str]
"""The service's default, none, or the names of measured controls."""

FloorValue = float | Floor | Mapping[str, float]
"""Height of a level floor, m, or a plane."""

Targets = Iterable[Target | Mapping[str, Any]]


def said(exact: Exact | None, targets: Targets | None) -> dict[str, Any]:
    """Return the arguments that are not None, as fields of a question."""
    found: dict[str, Any] = {}
    if exact is not None:
        found["exact"] = _exact(exact)
    if targets is not None:
        found["targets"] = tuple(_target(place, each) for place, each in enumerate(targets))
    return found


def floor(given: FloorValue | None) -> dict[str, Any]:
    """Return a floor as a field of a question; WrongQuestion if it is invalid."""
    if given is None:
        return {}
    try:
        return {"floor": msgspec.convert(asking.sayable("floor", given), float | Floor)}
    except msgspec.ValidationError as fault:
        raise WrongQuestion(
            f"floor: {fault}, expected a height or {', '.join(Floor.__struct_fields__)}"
        ) from None


def _exact(given: Exact) -> Any:
    if isinstance(given, str):
        return given if given in ("auto", "none") else (given,)
    return tuple(given)


def _target(place: int, given: Target | Mapping[str, Any]) -> Target:
    """Return the target; WrongQuestion if it is invalid, or has not exactly one of time and at."""
    name = f"target {place}"
    try:
        found = msgspec.convert(asking.sayable(name, given), Target)
    except msgspec.ValidationError as fault:
        raise WrongQuestion(f"{name}: {fault}{_known_keys(given)}") from None
    if (found.time is UNSET) == (found.at is UNSET):
        raise WrongQuestion(f"{name}: expected one of time and at")
    return found


def _known_keys(given: Target | Mapping[str, Any]) -> str:
    """Return the keys of a target after a message, if an unknown one was given."""
    known = Target.__struct_fields__
    unknown = [] if isinstance(given, Target) else [key for key in given if key not in known]
    if not unknown:
        return ""
    return f"{asking.did_you_mean(str(unknown[0]), known)}, expected some of {', '.join(known)}"
