"""Bounds of the numbers of a script, as the schema says them, and of its levels of detail."""

from collections.abc import Iterator, Sequence

from posefield.common.errors import InvalidField
from posefield.question.performance_question import (
    Act,
    Curve,
    Hold,
    PerformanceQuestion,
    Segment,
    Walk,
)
from posefield.question.value_validation import check_number, check_range
from posefield.synthesis.synthesizer import Synthesizer

MOST_PLACE, MOST_ANGLE, MOST_RADIUS, MOST_RATE = 1e4, 1e3, 1e3, 1e3
"""Largest coordinates, m, angles, rad, radii, m, and speeds, m/s or rad/s."""
MOST_TAKE = 999_999_999

Bounded = tuple[str, float, float, float, str]
"""Field, value, least, most and unit."""


def check_bounds(question: PerformanceQuestion) -> None:
    """Raise InvalidField for a number out of bounds, with a pointer into the script."""
    for field, value, low, high, unit in _numbers(question):
        check_range(field, check_number(field, value), low, high, unit)
    if not 0.0 <= question.variety <= 1.0:
        raise InvalidField("variety", f"{question.variety:g}, expected 0 to 1")
    if not 0 <= question.take <= MOST_TAKE:
        raise InvalidField("take", f"{question.take}, expected 0 to {MOST_TAKE}")


def check_level(level: int, models: Sequence[Synthesizer | None]) -> None:
    """Raise InvalidField for a level of detail that a model does not have."""
    for model in models:
        count = 0 if model is None else len(model.session.card.levels)
        if model is not None and not 0 <= level < count:
            name = model.session.card.name
            raise InvalidField("level", f"{level}, expected 0 to {count - 1}, as {name} has")


def _numbers(question: PerformanceQuestion) -> Iterator[Bounded]:
    yield from _places("start/position", question.start.position)
    yield "start/heading", question.start.heading, -MOST_ANGLE, MOST_ANGLE, "rad"
    for index, disc in enumerate(question.obstacles):
        yield from _places(f"obstacles/{index}/position", disc.position)
        # The least radius has a message of its own.
        yield f"obstacles/{index}/radius", disc.radius, -MOST_RADIUS, MOST_RADIUS, "m"
    for index, own in enumerate(question.segments):
        yield from _of_segment(f"segments/{index}", own)


def _of_segment(field: str, own: Segment) -> Iterator[Bounded]:
    if isinstance(own, Walk):
        yield from _curve(f"{field}/turn", own.turn, "rad/s")
        yield from _curve(f"{field}/speed", own.speed, "m/s")
        for index, point in enumerate(own.along or ()):
            yield from _places(f"{field}/along/{index}", point)
        yield from _places(f"{field}/to", own.to or ())
    if isinstance(own, Act):
        yield from _places(f"{field}/at", own.at or ())
        if own.facing is not None:
            yield f"{field}/facing", own.facing, -MOST_ANGLE, MOST_ANGLE, "rad"
    if isinstance(own, Hold):
        yield from _places(f"{field}/look_at", own.look_at or ())


def _curve(field: str, curve: float | Curve | None, unit: str) -> Iterator[Bounded]:
    if isinstance(curve, int | float):
        yield field, curve, -MOST_RATE, MOST_RATE, unit
        return
    for index, (place, value) in enumerate(curve or ()):
        yield f"{field}/{index}/0", place, -MOST_PLACE, MOST_PLACE, ""
        yield f"{field}/{index}/1", value, -MOST_RATE, MOST_RATE, unit


def _places(field: str, values: Sequence[float]) -> Iterator[Bounded]:
    for axis, value in enumerate(values):
        yield f"{field}/{axis}", value, -MOST_PLACE, MOST_PLACE, "m"
