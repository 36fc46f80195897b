"""Walkers of a crowd that walk through each other, with walks as drawn as the control."""

import time

from rows import Row

from posefield.locomotion import collision_avoidance, locomotion_plan, walking_crowd
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.gait import Gait

SECONDS, RATE = 20.0, 30.0
COUNTS = (50, 1_000)


def rows(walks: dict[str, Gait]) -> list[Row]:
    """Return the pairs of characters that overlap, of each model and number of characters."""
    return [_row(name, gait, count) for name, gait in walks.items() for count in COUNTS]


def _row(name: str, gait: Gait, count: int) -> Row:
    start = time.process_time()
    plan = walking_crowd.plan_random(gait, count, SECONDS, RATE, seed=0)
    seconds = time.process_time() - start
    drawn = len(collision_avoidance.find_overlaps(_as_drawn(gait, count), RATE))
    found = len(collision_avoidance.find_overlaps(plan.places, RATE))
    words = (
        f"circles of {collision_avoidance.RADIUS:g} m; walks as drawn: {drawn}; planned in "
        f"{seconds:.2g} s of processor time"
    )
    return Row(
        f"{name}, {count} walkers for {SECONDS:g} s: pairs that overlap",
        found,
        "",
        words,
        None,
        0.0,
    )


def _as_drawn(gait: Gait, count: int) -> FloorVectors:
    """Return the places of walks that keep no distances."""
    cells, collision_avoidance.MOST_CELLS = collision_avoidance.MOST_CELLS, 0
    try:
        characters = collision_avoidance.draw_characters(gait, count, 0)
        ways = collision_avoidance.draw_paths(gait, characters, SECONDS)
    finally:
        collision_avoidance.MOST_CELLS = cells
    frames = int(SECONDS * RATE) + 1
    return locomotion_plan.plan_along_paths(
        gait, ways, characters.who, characters.phases, frames, RATE
    ).places
