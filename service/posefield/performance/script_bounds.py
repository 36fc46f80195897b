"""Bounds of the numbers of a script, as the schema says them, and of its levels of detail."""

import math
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
from posefield.question.value_validation import check_number, check_range, check_take
from posefield.synthesis.synthesizer import Synthesizer

MOST_PLACE, MOST_ANGLE, MOST_RADIUS, MOST_RATE = 1e4, 1e3, 1e3, 1e3
"""Largest coordinates, m, angles, rad, radii, m, and speeds, m/s or rad/s."""
MIN_SECONDS, MAX_SECONDS = 0.1, 600.0
"""Shortest segment with a duration of its own, and longest performance, s."""
MIN_FPS, MAX_FPS = 1.0, 240.0
MAX_BLEND = 5.0
"""Longest time of a blend, s."""

Bounded = tuple[str, float, float, float, str]
"""Field, value, least, most and unit."""


def check_bounds(question: PerformanceQuestion) -> None:
    """Raise InvalidField for a number out of bounds, with a pointer into the script."""
    for field, value, low, high, unit in _numbers(question):
        check_range(field, check_number(field, value), low, high, unit)
    for field, value, unit in _positive(question):
        if not value > 0.0:
            raise InvalidField(field, f"{value:.9g} {unit}, expected more than 0 {unit}")
    check_take(question.take, question.variety)
    if isinstance(question.segments[0], Hold) and not question.start.poses:
        raise InvalidField("segments/0", "a hold, expected a walk or an act before it")


def check_level(level: int, models: Sequence[Synthesizer | None]) -> None:
    """Raise InvalidField for a level of detail that a model does not have."""
    for model in models:
        count = 0 if model is None else len(model.session.card.levels)
        if model is not None and not 0 <= level < count:
            name = model.session.card.name
            raise InvalidField("level", f"{level}, expected 0 to {count - 1}, as {name} has")


def _numbers(question: PerformanceQuestion) -> Iterator[Bounded]:
    yield "fps", question.fps, MIN_FPS, MAX_FPS, "frames/s"
    yield from _places("start/position", question.start.position)
    yield "start/heading", question.start.heading, -MOST_ANGLE, MOST_ANGLE, "rad"
    for index, disc in enumerate(question.obstacles):
        yield from _places(f"obstacles/{index}/position", disc.position)
        yield f"obstacles/{index}/radius", disc.radius, -MOST_RADIUS, MOST_RADIUS, "m"
    for index, own in enumerate(question.segments):
        yield from _of_segment(f"segments/{index}", own)


def _positive(question: PerformanceQuestion) -> Iterator[tuple[str, float, str]]:
    """Yield field, value and unit of what is more than 0."""
    for index, disc in enumerate(question.obstacles):
        yield f"obstacles/{index}/radius", disc.radius, "m"
    for index, own in enumerate(question.segments):
        if not isinstance(own, Hold):
            field, join = f"segments/{index}/join", own.join
            yield f"{field}/seconds", math.inf if join.seconds is None else join.seconds, "s"
            yield f"{field}/most", math.inf if join.most is None else join.most, "m"


def _of_segment(field: str, own: Segment) -> Iterator[Bounded]:
    if not isinstance(own, Act) and own.seconds is not None:
        yield f"{field}/seconds", own.seconds, MIN_SECONDS, MAX_SECONDS, "s"
    if not isinstance(own, Hold) and own.join.seconds is not None:
        yield f"{field}/join/seconds", own.join.seconds, -MAX_BLEND, MAX_BLEND, "s"
    if not isinstance(own, Hold) and own.join.most is not None:
        yield f"{field}/join/most", own.join.most, -MOST_PLACE, MOST_PLACE, "m"
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
