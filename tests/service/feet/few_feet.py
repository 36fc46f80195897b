"""Rows of feet for tests, and the functions of many feet for one foot."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from posefield.common.frame_groups import FrameRows, of_lengths
from posefield.common.units import UP
from posefield.feet import ball_path, body_plans, smooth_change, stance_rows
from posefield.feet.footsteps import PlanRequest
from posefield.feet.stance_rows import NO_CYCLE, Cycle, FootRows
from posefield.locomotion import floor_plane
from posefield.motion import contact_detection


@dataclass(frozen=True)
class FootPath:
    """Predicted path of one foot (F, 3), m, at a rate; whether its motion walks (F,)."""

    positions: np.ndarray
    rate: float
    cycle: Cycle | None = None
    walking: np.ndarray | None = None

    def __len__(self):
        return len(self.positions)


class Motion(NamedTuple):
    """Rotations and roots at a rate."""

    rotations: np.ndarray
    roots: np.ndarray
    rate: float


class PlannedPath(NamedTuple):
    """Path of one foot (F, 3), m, its stances, and where it stands."""

    positions: np.ndarray
    stances: tuple[range, ...]
    anchors: np.ndarray


def plan_feet(character, motion, *contacts, **options):
    """Return the plan of the feet of one motion."""
    (plan,) = body_plans.plan_motions([PlanRequest(character, *motion, *contacts, **options)])
    return plan


def frame_rows(lengths, rate, cyclic=False):
    """Return rows with these arrays, or arrays of their lengths."""
    groups = of_lengths(lengths)
    return FrameRows(groups, np.full(len(groups), rate), np.full(len(groups), cyclic))


def foot_rows(paths, foot, arms=None, flat=0.0):
    """Return the rows of several feet with equal statistics; without arms they do not roll."""
    rows = FrameRows(
        of_lengths([own.positions for own in paths]),
        np.array([own.rate for own in paths], float),
        np.array([own.cycle is not None for own in paths]),
    )
    cycles = [own.cycle or NO_CYCLE for own in paths]
    places = np.concatenate([own.positions for own in paths])
    walking = [np.zeros(len(own), bool) if own.walking is None else own.walking for own in paths]
    every = (foot.height, foot.swing, foot.longest_swing, foot.clearance)
    return FootRows(
        rows,
        floor_plane.project(places),
        places @ UP,
        *(np.full(len(paths), own, float) for own in every),
        np.array([own.way for own in cycles], complex),
        np.array([own.factor for own in cycles], complex),
        np.concatenate(walking),
        np.zeros((len(places), 3)) if arms is None else arms,
        np.full(len(paths), flat),
    )


def discipline(stances, path, foot):
    """Return the stances of one foot whose swings are as captured ones."""
    found = stance_rows.discipline(stance_rows.from_intervals([stances]), foot_rows([path], foot))
    return list(found.by_row(1)[0])


def plan_path(path, found, foot, goal=None, feet=None):
    """Return the steps of one foot."""
    goal = np.full(path.positions.shape, np.nan) if goal is None else goal
    runs = stance_rows.from_intervals([found])
    positions = ball_path.plan_paths(feet or foot_rows([path], foot), runs, goal)
    anchors = positions[[own.start for own in found]].reshape(-1, 3)
    return PlannedPath(positions, tuple(found), anchors)


def change_smoothly(path, held, rate, foot, cycle=None):
    """Return the path of one foot over the floor that is constant in each stance."""
    whole = FootPath(floor_plane.at_height(path, np.zeros(len(path))), rate, cycle)
    feet = foot_rows([whole], foot)
    return smooth_change.smooth_change(feet, feet.floor, stance_rows.from_intervals([held]))


def runs_alone(down, cyclic):
    """Return the intervals of true frames of one row, in order."""
    runs = contact_detection.runs(down, cyclic)
    intervals = [range(int(run[0]), int(run[0]) + len(run)) for run in runs]
    return sorted(intervals, key=lambda interval: interval.start)
