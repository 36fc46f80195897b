"""Soles of a robot that stand: its legs are solved for them at every canonical frame of a cycle.

The frames in which each point of a sole stands are those that the captured cycles have in common,
known at training. In a run of them the point stays at the mean of its predicted positions, so that
its displacement is linear in them; from one run to the next the displacement changes smoothly. The
hinges of each leg follow by a fixed number of damped Gauss-Newton steps within their limits.
Nothing is searched or decided, and so NumPy, torch and JAX evaluate the same functions, which take
their module as `xp`, and gradients pass through them.

Positions are metres, Z up. A cycle of N steps has frames 0 to N, and frame N is frame 0 moved on.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from posefield.common.bounded_types import Index, Number
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.robots.robot import Robot

ITERATIONS = 3
"""Gauss-Newton steps. From predictions two centimetres off, the third moves nothing by 1e-6 m."""
DAMPING = 1e-6
"""Added to the squares of the lever arms, m²: bounds the steps of a straight leg."""

Array = Any
"""Array of NumPy, torch or JAX."""
Repeat = Callable[[Callable[[list[Array]], list[Array]], list[Array]], list[Array]]
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


class Leg(NamedTuple):
    """Chain from the base to a foot.

    bodies: after the base, down to the foot. hinges: on the way, of this leg alone. rows: of the
    sole points of the foot.
    """

    bodies: tuple[int, ...]
    hinges: tuple[int, ...]
    rows: tuple[int, ...]


def legs(robot: Robot, points: Sequence[SolePoint]) -> list[Leg]:
    """Return the legs of the feet that have sole points, in the order of the points.

    A hinge above two feet, as in a waist, belongs to neither.
    """
    feet = list(dict.fromkeys(point.body for point in points))
    chains = {foot: _chain(robot, foot) for foot in feet}
    shared = [body for body in range(len(robot.bodies)) if _count(chains.values(), body) > 1]
    return [
        Leg(
            chains[foot],
            tuple(
                hinge
                for hinge, body in enumerate(robot.hinge_bodies)
                if body in chains[foot] and body not in shared
            ),
            tuple(row for row, point in enumerate(points) if point.body == foot),
        )
        for foot in feet
    ]


def _chain(robot: Robot, foot: int) -> tuple[int, ...]:
    chain = [foot]
    while robot.parents[chain[0]] > 0:
        chain.insert(0, robot.parents[chain[0]])
    return tuple(chain)


def _count(chains: Iterable[tuple[int, ...]], body: int) -> int:
    return sum(body in chain for chain in chains)


def repeated(step: Callable[[list[Array]], list[Array]], columns: list[Array]) -> list[Array]:
    """Return the columns after ITERATIONS steps."""
    for _ in range(ITERATIONS):
        columns = step(columns)
    return columns


class StandingSoles:
    """Solver of the legs of a robot for its sole points.

    constant: makes arrays of `xp` of NumPy's. steps: N of a cycle. repeat: as `repeated`, for a
    module that compiles loops.
    """

    def __init__(
        self,
        xp: Any,
        constant: Constant,
        robot: Robot,
        points: Sequence[SolePoint],
        steps: int,
        repeat: Repeat = repeated,
    ) -> None:
        self._xp, self._robot, self._steps, self._repeat = xp, robot, steps, repeat
        self._legs = legs(robot, points)
        order = [row for leg in self._legs for row in leg.rows]
        runs = [_stance_matrices(points[row], steps) for row in order]
        self._positions = [
            constant(np.array([points[row].position for row in leg.rows])) for leg in self._legs
        ]
        # Without sole points there are only limits.
        if runs:
            self._displace, self._smooth, self._when = (
                constant(np.stack(matrices)) for matrices in zip(*runs, strict=True)
            )
        self._shares = constant(np.arange(steps) / steps)
        self._low, self._high = (constant(robot.ranges[:, side]) for side in range(2))
        self._turns = [constant(turn) for turn in quat.to_matrix(robot.turns)]
        self._offsets = [constant(offset) for offset in robot.offsets]
        self._axes = [constant(axis) for axis in robot.axes]
        self._anchors = [constant(anchor) for anchor in robot.anchors]
        crosses = [_cross_matrix(axis) for axis in robot.axes]
        self._crosses = [(constant(k), constant(k @ k)) for k in crosses]
        self._identity = constant(np.eye(3))

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
        limited = self.limited(angles[..., :steps, :])
        columns = [limited[..., hinge] for hinge in range(limited.shape[-1])]
        legs_points = [self._points(leg, columns)[0] for leg in range(len(self._legs))]
        predicted = xp.concatenate(legs_points, -2) @ xp.swapaxes(turns, -1, -2) + path
        # From the base, goals are where its motion leaves them.
        goals = (self._goals(base_path, base_turns, predicted) - path) @ turns
        first = 0
        for leg, (_, hinges, rows) in enumerate(self._legs):
            goal, first = goals[..., first : first + len(rows), :], first + len(rows)

            def step(
                columns: list[Array],
                leg: int = leg,
                hinges: tuple[int, ...] = hinges,
                goal: Array = goal,
            ) -> list[Array]:
                points, slopes = self._points(leg, columns)
                across = xp.swapaxes(slopes, -1, -2)
                gaps = (goal - points).reshape(*slopes.shape[:-1], 1)
                turns = _solution(across @ slopes, (across @ gaps)[..., 0])
                solved = list(columns)
                for turn, hinge in zip(turns, hinges, strict=True):
                    angle = columns[hinge] + turn
                    solved[hinge] = xp.clip(angle, self._low[hinge], self._high[hinge])
                return solved

            columns = self._repeat(step, columns)
        solved = xp.stack(columns, -1)
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

    def _points(self, leg: int, columns: Sequence[Array]) -> tuple[Array, Array]:
        """Return a leg's sole points (..., p, 3), m, from the base, and slopes (..., 3 p, h).

        columns: angles (...) of each hinge, rad.
        """
        xp, robot, chain = self._xp, self._robot, self._legs[leg]
        turn = columns[0][..., None, None] * 0.0 + self._identity
        origin = turn[..., 0] * 0.0
        axes, fixed_points = list[Array](), list[Array]()
        for body in chain.bodies:
            origin = origin + turn @ self._offsets[body]
            turn = turn @ self._turns[body]
            for hinge in [h for h, hinged in enumerate(robot.hinge_bodies) if hinged == body]:
                angle = columns[hinge][..., None, None]
                first, second = self._crosses[hinge]
                fixed = origin + turn @ self._anchors[hinge]
                if hinge in chain.hinges:
                    axes.append(turn @ self._axes[hinge])
                    fixed_points.append(fixed)
                spin = self._identity + xp.sin(angle) * first + (1.0 - xp.cos(angle)) * second
                turn = turn @ spin
                origin = fixed - turn @ self._anchors[hinge]
        points = self._positions[leg] @ xp.swapaxes(turn, -1, -2) + origin[..., None, :]
        arms = points[..., None, :] - xp.stack(fixed_points, -2)[..., None, :, :]
        slopes = xp.stack(_cross(xp.stack(axes, -2)[..., None, :, :], arms), -2)
        return points, slopes.reshape(*slopes.shape[:-3], -1, len(axes))


def _solution(matrix: Array, vector: Array) -> list[Array]:
    """Return the n numbers (...) that solve damped symmetric systems (..., n, n), (..., n).

    By elimination over all systems at once, which for legs takes a tenth of the time of a library's
    solver of one after the other.
    """
    size = matrix.shape[-1]
    rows = [[matrix[..., i, j] for j in range(i + 1)] for i in range(size)]
    sides = [vector[..., i] for i in range(size)]
    for pivot in range(size):
        inverse = 1.0 / (rows[pivot][pivot] + DAMPING)
        for i in range(pivot + 1, size):
            share = rows[i][pivot] * inverse
            for j in range(pivot + 1, i + 1):
                rows[i][j] = rows[i][j] - share * rows[j][pivot]
            sides[i] = sides[i] - share * sides[pivot]
        sides[pivot] = sides[pivot] * inverse
    for i in reversed(range(size)):
        for j in range(i + 1, size):
            # Of an eliminated column its own pivot's share is left.
            sides[i] = sides[i] - rows[j][i] * sides[j] / (rows[i][i] + DAMPING)
    return sides


def _turned(xp: Any, angle: Array, x: Array, y: Array) -> list[Array]:
    """Return planar vectors turned by an angle, rad."""
    cosine, sine = xp.cos(angle), xp.sin(angle)
    return [cosine * x - sine * y, sine * x + cosine * y]


def _cross(a: Array, b: Array) -> list[Array]:
    return [a[..., i] * b[..., j] - a[..., j] * b[..., i] for i, j in ((1, 2), (2, 0), (0, 1))]


def _cross_matrix(axis: Floats) -> Floats:
    """Return the matrix (3, 3) of the vector product with an axis from the left."""
    x, y, z = axis
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


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
