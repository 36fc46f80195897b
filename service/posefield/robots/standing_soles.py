"""Soles of a robot that stand: its legs are solved for them at every canonical frame of a cycle.

The frames in which each point of a sole stands are those that the captured cycles have in common,
known at training. In a run of them the point stays at the mean of its predicted positions, so that
its displacement is linear in them; from one run to the next the displacement changes smoothly. The
hinges of each leg follow by a fixed number of damped Gauss-Newton steps within their limits. A foot
below the floor is raised. Nothing is searched or decided, and so NumPy, torch and JAX evaluate the
same functions, which take their module as `xp`, and gradients pass through them. Legs of one kind
are solved at once.

Positions are metres, Z up. A cycle of N steps has frames 0 to N, and frame N is frame 0 moved on.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from posefield.common.bounded_types import Index, Number
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.robots.robot import Robot

ITERATIONS = 2
"""Gauss-Newton steps. From predictions two centimetres off, a third moves no angle by 1e-4 rad."""
DAMPING = 1e-6
"""Added to the squares of the lever arms, m²: bounds the steps of a straight leg."""

Array = Any
"""Array of NumPy, torch or JAX."""
Constant = Callable[[Floats], Array]
"""Function from NumPy's arrays to arrays of the right kind, precision and device."""


@dataclass(frozen=True)
class SolePoint:
    """A point of a sole, and when it stands.

    body: index in the robot. position: in the body's frame, m. stances: first and last canonical
    frame of each in order; one that goes on in the next cycle counts on beyond this one's frames.
    """

    body: Index
    position: tuple[Number, Number, Number]
    stances: tuple[tuple[Index, Index], ...]


Points = Sequence[SolePoint]


class Leg(NamedTuple):
    """Chain from the base to a foot.

    bodies: after the base, down to the foot. hinges: on the way, of this leg alone. rows: of the
    sole points of the foot.
    """

    bodies: tuple[int, ...]
    hinges: tuple[int, ...]
    rows: tuple[int, ...]


def legs(robot: Robot, points: Points) -> list[Leg]:
    """Return the legs of the feet that have sole points, in the order of the points.

    A hinge above two feet, as in a waist, belongs to neither.
    """
    feet = list(dict.fromkeys(point.body for point in points))
    chains = [_chain(robot, foot) for foot in feet]
    legs_of_bodies = Counter(body for chain in chains for body in chain)
    return [
        Leg(
            chain,
            tuple(
                hinge
                for hinge, body in enumerate(robot.hinge_bodies)
                if body in chain and legs_of_bodies[body] == 1
            ),
            tuple(row for row, point in enumerate(points) if point.body == foot),
        )
        for foot, chain in zip(feet, chains, strict=True)
    ]


def _chain(robot: Robot, foot: int) -> tuple[int, ...]:
    chain = [foot]
    while robot.parents[chain[0]] > 0:
        chain.insert(0, robot.parents[chain[0]])
    return tuple(chain)


class LegGroup:
    """L legs of c hinges from the base to the foot, of which each turns h alone, and of p points.

    Each is a chain of transforms (4, 4), linear in one, the sine, and one less the cosine of an
    angle. All R frames of all commands are rows of few products of matrices.
    """

    def __init__(
        self,
        xp: Any,
        constant: Constant,
        robot: Robot,
        points: Points,
        steps: int,
        group: list[Leg],
    ) -> None:
        chains, self._xp = [links(robot, leg.bodies) for leg in group], xp
        self._turning = [chains[0][0].index(hinge) for hinge in group[0].hinges]
        self._links = constant(np.stack([links for _, links, _ in chains]))
        identity, turned = np.eye(len(robot.hinges)), [h for leg in group for h in leg.hinges]
        self._chains = constant(identity[[hinge for chain, _, _ in chains for hinge in chain]])
        self._columns, self._identity = (
            constant(identity[turned]),
            constant(np.eye(len(self._turning), len(self._turning) + 1)[..., None]),
        )
        lines = np.stack([_homogeneous(robot.axes, 0.0), _homogeneous(robot.anchors, 1.0)], axis=-1)
        self._lines = constant(lines[turned].reshape(len(group), -1, 1, 4, 2).swapaxes(3, 4))
        feet = {foot.body: foot.points for foot in robot.feet}
        # Corners, and behind them the surface; of a foot of fewer points some are there twice.
        corners, shape = len(group[0].rows), (max(len(foot) for foot in feet.values()), 3)
        soles = [
            np.vstack(
                [
                    *(points[row].position for row in leg.rows),
                    np.resize(feet[leg.bodies[-1]], shape),
                ]
            )
            for leg in group
        ]
        ends = zip(soles, chains, strict=True)
        self._soles = constant(np.stack([_homogeneous(p, 1.0) @ last.T for p, (*_, last) in ends]))
        self._corners = self._soles[:, None, :corners]
        # Matrices of stances, from the frames of two cycles and of one, and when frames stand.
        stances = [_stance_matrices(points[row], steps) for leg in group for row in leg.rows]
        self.displace, self.smooth, self.when = (
            constant(np.stack(values).reshape(len(group), -1, *values[0].shape))
            for values in zip(*stances, strict=True)
        )

    def points(self, angles: Array) -> tuple[Array, list[Array], Array]:
        """Return sole points (L, 3, p, R), m, from the base, and slopes (L, p, h, R) of each axis.

        The last are poses (L, 3, 4, R) of the feet. angles (R, H): of all hinges of the robot, rad.
        """
        xp, (legs, hinges) = self._xp, self._links.shape[:2]
        turned = (self._chains @ angles.T).reshape(legs, hinges, -1)
        shares = xp.stack([turned * 0.0 + 1.0, xp.sin(turned), 1.0 - xp.cos(turned)], 2)
        links = (self._links @ shares).reshape(legs, hinges, 4, 4, -1)
        poses = [links[:, 0, :3]]
        for hinge in range(1, hinges):
            poses.append(xp.sum(poses[-1][:, :, :, None] * links[:, hinge, None], 2))
        points = self._corners @ poses[-1]
        lines = self._lines @ xp.stack([poses[hinge] for hinge in self._turning], 1)
        axes = [lines[:, None, :, axis, 0] for axis in range(3)]
        arms = [points[:, a, :, None] - lines[:, None, :, a, 1] for a in range(3)]
        pairs = ((1, 2), (2, 0), (0, 1))
        return points, [axes[i] * arms[j] - axes[j] * arms[i] for i, j in pairs], poses[-1]

    def lowest(self, poses: Array, ups: Array) -> Array:
        """Return the height (L, R), m, of the lowest point of each foot over the base.

        ups (3, R): the vertical in the frame of the base.
        """
        return self._xp.amin(self._soles @ sum(poses[:, a] * ups[a] for a in range(3)), 1)

    def turns(self, goals: Array, points: Array, slopes: Sequence[Array]) -> Array:
        """Return the turns (R, H), rad, of all hinges of a step from points to goals."""
        xp, gaps, system = self._xp, goals - points, DAMPING * self._identity
        for axis, slope in enumerate(slopes):
            columns = xp.concatenate([slope, gaps[:, axis, :, None]], 2)
            system = system + xp.sum(slope[:, :, :, None] * columns[:, :, None], 1)
        # By elimination over all systems at once: a library solves one after the other.
        for pivot, unit in enumerate(self._identity[:, :-1]):
            row = system[:, pivot, 1:] / system[:, pivot, :1]
            system = system[:, :, 1:] - (system[:, :, 0] - unit)[:, :, None] * row[:, None]
        return system.reshape(-1, system.shape[-1]).T @ self._columns


def links(robot: Robot, bodies: Sequence[int]) -> tuple[list[int], Floats, Floats]:
    """Return the hinges of a chain, their links (c, 16, 3), and the transform behind the last.

    A link is its first matrix, the second times the sine, and the third by one less the cosine.
    """
    hinges, links, fixed = list[int](), [], np.eye(4)
    for body in bodies:
        fixed = fixed @ _transform(quat.to_matrix(robot.turns[body]), robot.offsets[body], 1.0)
        for hinge in (h for h, hinged in enumerate(robot.hinge_bodies) if hinged == body):
            cross = np.cross(np.eye(3), robot.axes[hinge])
            turned = [_transform(k, -k @ robot.anchors[hinge], 0.0) for k in (cross, cross @ cross)]
            links.append([fixed, *(fixed @ matrix for matrix in turned)])
            hinges, fixed = [*hinges, hinge], np.eye(4)
    return hinges, np.array(links).reshape(len(links), 3, 16).swapaxes(1, 2), fixed


def _transform(matrix: Floats, offset: Floats, corner: float) -> Floats:
    return np.vstack([np.column_stack([matrix, offset]), [0.0, 0.0, 0.0, corner]])


def _homogeneous(vectors: Floats, last: float) -> Floats:
    return np.column_stack([vectors, np.full(len(vectors), last)])


class StandingSoles:
    """Solver of the legs of a robot for its sole points.

    constant: makes arrays of `xp` of NumPy's. steps: N of a cycle.
    """

    def __init__(
        self, xp: Any, constant: Constant, robot: Robot, points: Points, steps: int
    ) -> None:
        self._xp, self._steps = xp, steps
        kinds: dict[tuple[object, ...], list[Leg]] = {}
        for leg in legs(robot, points):
            hinges = [h for h, body in enumerate(robot.hinge_bodies) if body in leg.bodies]
            alone = tuple(hinge in leg.hinges for hinge in hinges)
            kinds.setdefault((alone, len(leg.rows)), []).append(leg)
        self._groups = [
            LegGroup(xp, constant, robot, points, steps, group) for group in kinds.values()
        ]
        self._shares = constant(np.arange(steps) / steps)
        self._low, self._high = (constant(robot.ranges[:, side]) for side in range(2))

    def limited(self, angles: Array) -> Array:
        """Return angles (..., H), rad, within the robot's limits."""
        return self._xp.clip(angles, self._low, self._high)

    def corrected(self, base_path: Array, base_turns: Array, angles: Array) -> Array:
        """Return the angles (..., N + 1, H), rad, of a cycle in which the soles stand.

        base_path (..., N + 1, 3), m. base_turns (..., N + 1, 3, 3): matrices. angles
        (..., N + 1, H), rad. All are within the limits.
        """
        xp, steps = self._xp, self._steps
        # All frames of all cycles come last.
        path = base_path[..., :steps, :].reshape(-1, 3).T
        turns = base_turns[..., :steps, :, :].reshape(-1, 9).T.reshape(3, 3, -1)
        rows = self.limited(angles[..., :steps, :]).reshape(-1, angles.shape[-1])
        for group in self._groups:
            points, slopes, feet = group.points(rows)
            predicted = sum(turns[:, a, None] * points[:, None, a] for a in range(3))
            predicted = predicted + path[:, None]
            # Soles bulge below their corners, and so the whole foot is raised.
            sunk = xp.clip(group.lowest(feet, turns[2]) + path[2], None, 0.0)
            level = self._level_goals(group, base_path, base_turns, predicted)
            goals = xp.concatenate([level, predicted[:, 2:] - sunk[:, None, None]], 1)
            goals = goals - path[:, None]
            # From the base, goals are where its motion leaves them.
            goals = sum(turns[axis, :, None] * goals[:, axis, None] for axis in range(3))
            for iteration in range(ITERATIONS):
                if iteration:
                    points, slopes, _ = group.points(rows)
                rows = self.limited(rows + group.turns(goals, points, slopes))
        solved = rows.reshape(*angles.shape[:-2], steps, -1)
        return xp.concatenate([solved, solved[..., :1, :]], -2)

    def _level_goals(
        self, group: LegGroup, base_path: Array, base_turns: Array, predicted: Array
    ) -> Array:
        """Return where over the floor sole points (L, 2, p, R), m, are that stand."""
        xp, steps = self._xp, self._steps
        legs, _, corners, count = predicted.shape
        level = xp.swapaxes(predicted[:, :2].reshape(legs, 2, corners, -1, steps), 1, 2)
        # The next cycle is this one turned about the vertical and moved on.
        closing = base_turns[..., steps, :, :] @ xp.swapaxes(base_turns[..., 0, :, :], -1, -2)
        turn = xp.arctan2(
            closing[..., 1, 0] - closing[..., 0, 1], closing[..., 0, 0] + closing[..., 1, 1]
        ).reshape(-1, 1)
        start, end = (base_path[..., at, :2].reshape(-1, 2).T[..., None] for at in (0, steps))
        following = _turned(xp, turn, level - start) + end
        displaced = xp.concatenate([level, following], -1).reshape(legs, corners, -1, 2 * steps)
        displaced = (displaced @ group.displace).reshape(level.shape)
        # In a frame that turns with the cycle displacements repeat, and change smoothly in swings.
        displaced = _turned(xp, -turn * group.when[:, :, None], displaced)
        displaced = displaced.reshape(legs, corners, -1, steps) @ group.smooth
        goals = level + _turned(xp, turn * self._shares, displaced.reshape(level.shape))
        return xp.swapaxes(goals, 1, 2).reshape(legs, 2, corners, count)


def _turned(xp: Any, angle: Array, level: Array) -> Array:
    """Return planar vectors (L, p, 2, E, n) turned by angles, rad."""
    cosine, sine, x, y = xp.cos(angle), xp.sin(angle), level[:, :, 0], level[:, :, 1]
    return xp.stack([cosine * x - sine * y, sine * x + cosine * y], 2)


def _stance_matrices(point: SolePoint, steps: int) -> tuple[Floats, Floats, Floats]:
    """Return the linear functions that make a point stand in a cycle of N steps.

    The first (2 N, N) takes positions in this cycle and the next to displacements of standing
    frames, the second (N, N) takes these to displacements of all frames, both from the left, and
    the last (N,) is when each frame stands, as a share of the cycle, on beyond it.
    """
    displace, smooth = np.zeros((steps, 2 * steps)), np.zeros((steps, steps))
    when = np.arange(steps) / steps
    for first, last in point.stances:
        frames = np.arange(first, last + 1)
        rows = frames % steps
        displace[rows, first : last + 1] = 1.0 / len(frames)
        displace[rows, frames] -= 1.0
        smooth[rows, rows], when[rows] = 1.0, frames / steps
    following = [*point.stances[1:], (point.stances[0][0] + steps, 0)]
    for (_, last), (first, _) in zip(point.stances, following, strict=True):
        frames = np.arange(last + 1, first)
        shares = quat.smoothstep((frames - last) / (first - last))
        np.add.at(smooth, (frames % steps, np.full(len(frames), last % steps)), 1.0 - shares)
        np.add.at(smooth, (frames % steps, np.full(len(frames), first % steps)), shares)
    return displace.T, smooth.T, when
