"""Soles of a robot that stand: its legs are solved for them at every canonical frame of a cycle.

The frames in which each point of a sole stands are those that the captured cycles have in common,
known at training. In a run of them the point stays at the mean of its predicted positions, so that
its displacement is linear in them; from one run to the next the displacement changes smoothly. The
hinges of each leg follow by a fixed number of damped Gauss-Newton steps within their limits.
Nothing is searched or decided, and so NumPy, torch and JAX evaluate the same functions, which take
their module as `xp`, and gradients pass through them. Legs of one kind are solved at once.

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
        self, xp: Any, constant: Constant, robot: Robot, points: Points, group: list[Leg]
    ) -> None:
        chains = [_links(robot, leg.bodies) for leg in group]
        self._xp, self.rows = xp, [row for leg in group for row in leg.rows]
        self._turning = [chains[0][0].index(hinge) for hinge in group[0].hinges]
        self._links = constant(np.stack([links for _, links, _ in chains]))
        identity, turned = np.eye(len(robot.hinges)), [h for leg in group for h in leg.hinges]
        self._chains = constant(identity[[hinge for chain, _, _ in chains for hinge in chain]])
        self._columns, self._identity = (
            constant(identity[turned]),
            constant(np.eye(len(self._turning))[..., None]),
        )
        lines = np.stack([_homogeneous(robot.axes, 0.0), _homogeneous(robot.anchors, 1.0)], axis=-1)
        self._lines = constant(lines[turned].reshape(len(group), -1, 1, 4, 2).swapaxes(3, 4))
        corners = [
            _homogeneous(np.array([points[row].position for row in leg.rows]), 1.0) @ last.T
            for leg, (_, _, last) in zip(group, chains, strict=True)
        ]
        self._corners = constant(np.stack(corners)[:, None])

    def points(self, angles: Array) -> tuple[Array, list[Array]]:
        """Return sole points (L, 3, p, R), m, from the base, and slopes (L, p, h, R) of each axis.

        angles (R, H): of all hinges of the robot, rad.
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
        return points, [axes[i] * arms[j] - axes[j] * arms[i] for i, j in pairs]

    def turns(self, goals: Array, points: Array, slopes: Sequence[Array]) -> Array:
        """Return the turns (R, H), rad, of all hinges of a step from points to goals."""
        xp, gaps = self._xp, goals - points
        matrix = sum(xp.sum(slope[:, :, :, None] * slope[:, :, None], 1) for slope in slopes)
        vector = sum(xp.sum(slope * gaps[:, a, :, None], 1) for a, slope in enumerate(slopes))
        # By elimination over all systems at once: a library solves one after the other.
        system = xp.concatenate([matrix + DAMPING * self._identity, vector[:, :, None]], 2)
        for pivot, unit in enumerate(self._identity):
            row = system[:, pivot] / system[:, pivot, pivot, None]
            system = system - (system[:, :, pivot] - unit)[:, :, None] * row[:, None]
        solved = system[:, :, -1]
        return solved.reshape(-1, solved.shape[-1]).T @ self._columns


def _links(robot: Robot, bodies: Sequence[int]) -> tuple[list[int], Floats, Floats]:
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
        self._groups = [LegGroup(xp, constant, robot, points, group) for group in kinds.values()]
        runs = [
            _stance_matrices(points[row], steps) for group in self._groups for row in group.rows
        ]
        # Without sole points there are only limits.
        if runs:
            self._displace, self._smooth, self._when = (
                constant(np.stack(matrices)) for matrices in zip(*runs, strict=True)
            )
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
        path, turns = base_path[..., :steps, None, :], base_turns[..., :steps, :, :]
        rows = self.limited(angles[..., :steps, :]).reshape(-1, angles.shape[-1])
        reached = [group.points(rows) for group in self._groups]
        shape = (*path.shape[:-2], -1, 3)
        predicted = [
            xp.swapaxes(xp.swapaxes(points, 1, 3), 0, 1).reshape(shape) for points, _ in reached
        ]
        predicted = xp.concatenate(predicted, -2) @ xp.swapaxes(turns, -1, -2) + path
        # From the base, goals are where its motion leaves them.
        goals = (self._goals(base_path, base_turns, predicted) - path) @ turns
        goals, first = goals.reshape(len(rows), -1, 3), 0
        for group, (points, slopes) in zip(self._groups, reached, strict=True):
            goal = goals[:, first : first + len(group.rows)].reshape(len(rows), len(points), -1, 3)
            goal, first = xp.swapaxes(xp.swapaxes(goal, 0, 1), 1, 3), first + len(group.rows)
            for iteration in range(ITERATIONS):
                if iteration:
                    points, slopes = group.points(rows)
                rows = self.limited(rows + group.turns(goal, points, slopes))
        solved = rows.reshape(*angles.shape[:-2], steps, -1)
        return xp.concatenate([solved, solved[..., :1, :]], -2)

    def _goals(self, base_path: Array, base_turns: Array, predicted: Array) -> Array:
        """Return where sole points (..., N, P, 3), m, are that stand, of the predicted ones."""
        xp, steps = self._xp, self._steps
        x, y, z = (xp.swapaxes(predicted[..., axis], -1, -2) for axis in range(3))
        # The next cycle is this one turned about the vertical and moved on.
        closing = base_turns[..., steps, :, :] @ xp.swapaxes(base_turns[..., 0, :, :], -1, -2)
        turn = xp.arctan2(
            closing[..., 1, 0] - closing[..., 0, 1], closing[..., 0, 0] + closing[..., 1, 1]
        )[..., None, None]
        end, start = base_path[..., steps, :, None, None], base_path[..., 0, :, None, None]
        turned = _turned(xp, turn, x - start[..., 0, :, :], y - start[..., 1, :, :])
        x2 = xp.concatenate([x, turned[0] + end[..., 0, :, :]], -1)
        y2 = xp.concatenate([y, turned[1] + end[..., 1, :, :]], -1)
        displaced = [self._linear(self._displace, values) for values in (x2, y2)]
        # In a frame that turns with the cycle displacements repeat, and change smoothly in swings.
        displaced = _turned(xp, -turn * self._when, *displaced)
        displaced = [self._linear(self._smooth, values) for values in displaced]
        displaced = _turned(xp, turn * self._shares, *displaced)
        above = xp.clip(z, 0.0, None)
        goals = xp.stack([x + displaced[0], y + displaced[1], above], -1)
        return xp.swapaxes(goals, -2, -3)

    def _linear(self, functions: Array, values: Array) -> Array:
        return self._xp.einsum("...pj,pij->...pi", values, functions)


def _turned(xp: Any, angle: Array, x: Array, y: Array) -> list[Array]:
    """Return planar vectors turned by an angle, rad."""
    cosine, sine = xp.cos(angle), xp.sin(angle)
    return [cosine * x - sine * y, sine * x + cosine * y]


def _stance_matrices(point: SolePoint, steps: int) -> tuple[Floats, Floats, Floats]:
    """Return the linear functions that make a point stand in a cycle of N steps.

    The first (N, 2 N) takes positions in this cycle and the next to displacements of standing
    frames, the second (N, N) takes these to displacements of all frames, and the last (N,) is when
    each frame stands, as a share of the cycle, on beyond it.
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
    return displace, smooth, when
