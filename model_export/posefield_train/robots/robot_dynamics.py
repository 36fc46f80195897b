"""Forces of a robot's motion by inverse dynamics, which MuJoCo computes.

The whole robot's motion asks for a wrench at its base, which the floor gives to the soles that
stand, within their friction. Of all forces of the floor that give it, the smallest at the soles'
points are taken; hinges have the torques that are left.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull, QhullError

from posefield.common.units import Booleans, Floats
from posefield.motion import quat
from posefield.robots.robot import UNLIMITED, HingeAngles
from posefield.robots.robot_motion import RobotMotion
from posefield_train.robots import robot_file

if TYPE_CHECKING:
    import mujoco

FRICTION = 0.8
"""Coefficient of friction of soles."""
CORNERS = 8
"""Largest number of points of a sole at which the floor presses."""
SMALL = 1e-3
"""Weight of the forces themselves beside the wrench that they should give."""


@dataclass(frozen=True)
class Loads:
    """Forces of a motion.

    torques (F, H): of the hinges, N m. limits (H,): largest that the actuators give; UNLIMITED
    where the robot's file states none. zero_moment (F,): distance of the zero-moment point beyond
    the support polygon, m, negative within it; nan in flight. lacking (F,): force that the soles
    cannot give, as a share of the weight.
    """

    torques: HingeAngles
    limits: Annotated[Floats, "hinges"]
    zero_moment: Annotated[Floats, "frames"]
    lacking: Annotated[Floats, "frames"]

    @property
    def shares(self) -> HingeAngles:
        """Return torques as shares of their limits (F, H)."""
        return np.abs(self.torques) / self.limits


class Dynamics:
    """A robot with masses, whose motions have forces."""

    def __init__(self, path: Path) -> None:
        import mujoco

        self.robot = robot_file.read(path)
        self._model = model = robot_file.model_of(path)
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        free = int(np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)[0])
        hinges = [model.joint(name).id for name in self.robot.hinges]
        self._base = slice(int(model.jnt_dofadr[free]), int(model.jnt_dofadr[free]) + 6)
        self._dofs = model.jnt_dofadr[hinges]
        self._numbers = np.concatenate(
            [model.jnt_qposadr[free] + np.arange(7), model.jnt_qposadr[hinges]]
        )
        base = int(model.jnt_bodyid[free])
        self._bodies = [i for i in range(1, model.nbody) if model.body_rootid[i] == base]
        self._weight = float(model.body_subtreemass[base] * np.linalg.norm(model.opt.gravity))
        self._limits = _torque_limits(model, hinges)

    def loads(self, motion: RobotMotion, contacts: Annotated[Booleans, "frames feet"]) -> Loads:
        """Return the forces of a motion whose feet stand as told.

        A motion that loops, and whose last frame is the first of the next cycle, has those of a
        cycle among others; else the first and last frames have those of their neighbours.
        """
        import mujoco

        model, state = self._model, mujoco.MjData(self._model)
        rows, first = _among_cycles(motion)
        positions = np.tile(model.qpos0, (len(rows), 1))
        positions[:, self._numbers] = rows
        rates = np.empty((len(rows) - 1, model.nv))
        for frame, rate in enumerate(rates):
            mujoco.mj_differentiatePos(
                model, rate, 1.0 / motion.rate, positions[frame], positions[frame + 1]
            )
        points, rotations = motion.body_poses(self.robot)
        soles = self.robot.foot_points(points, rotations)
        results = []
        for frame in range(len(motion)):
            row = min(max(first + frame, 1), len(rates) - 1)
            state.qpos[:] = positions[row]
            state.qvel[:] = 0.5 * (rates[row - 1] + rates[row])
            state.qacc[:] = (rates[row] - rates[row - 1]) * motion.rate
            mujoco.mj_inverse(model, state)
            standing = [
                (foot.body, sole[frame])
                for foot, sole, stands in zip(self.robot.feet, soles, contacts[frame], strict=True)
                if stands
            ]
            results.append(self._frame(state, standing))
        torques, zero_moment, lacking = zip(*results, strict=True)
        return Loads(np.array(torques), self._limits, np.array(zero_moment), np.array(lacking))

    def _frame(
        self, state: "mujoco.MjData", standing: list[tuple[int, Floats]]
    ) -> tuple[Floats, float, float]:
        """Return torques (H,), the zero-moment point's distance, m, and the share of weight."""
        import mujoco

        forces = state.qfrc_inverse.copy()
        needed = forces[self._base]
        columns, pressed = [], []
        for body, sole in standing:
            for point in sole[np.argsort(sole[:, 2])[:CORNERS]]:
                jacobian = np.zeros((3, self._model.nv))
                mujoco.mj_jac(self._model, state, jacobian, None, point, self._bodies[body])
                columns.append(_cone() @ jacobian)
                pressed.append(point)
        if not columns:
            return forces[self._dofs], np.nan, float(np.linalg.norm(needed[:3]) / self._weight)
        edges = np.concatenate(columns)
        # Moments count as at a tenth of a metre.
        scale = np.array([1.0, 1.0, 1.0, 10.0, 10.0, 10.0]) / self._weight
        matrix = np.vstack([scale[:, None] * edges[:, self._base].T, SMALL * np.eye(len(edges))])
        sizes, _ = nnls(matrix, np.concatenate([scale * needed, np.zeros(len(edges))]))
        floor = sizes @ edges
        lack = float(np.linalg.norm(needed[:3] - floor[self._base][:3]) / self._weight)
        distance = _beyond(self._zero_moment_point(state, needed), np.array(pressed)[:, :2])
        return (forces - floor)[self._dofs], distance, lack

    def _zero_moment_point(self, state: "mujoco.MjData", needed: Floats) -> Floats:
        """Return the point (2,) of the floor about which the needed wrench has no level moment."""
        rows = state.qpos[self._numbers[:7]]
        force = needed[:3]
        moment = quat.rotate(rows[3:7], needed[3:]) + np.cross(rows[:3], force)
        return np.array([-moment[1], moment[0]]) / force[2]


def _cone() -> Floats:
    """Return edges (4, 3) of the cone of forces that the floor gives without sliding."""
    across = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    return np.hstack([FRICTION * across, np.ones((4, 1))])


def _among_cycles(motion: RobotMotion) -> tuple[Floats, int]:
    """Return rows of base and hinges, and the index of the motion's first frame.

    A cycle stands between the one before it and the one after.
    """
    rows = np.hstack([motion.base_path, motion.base_rotations, motion.angles])
    if not motion.loops:
        return rows, 0
    turn = quat.mul(motion.base_rotations[-1], quat.conj(motion.base_rotations[0]))
    # A cycle turns about the vertical alone.
    turn = quat.normalize(turn * np.array([1.0, 0.0, 0.0, 1.0]))
    after = _moved(rows[1:], turn, rows[0, :3], rows[-1, :3])
    before = _moved(rows[:-1], quat.conj(turn), rows[-1, :3], rows[0, :3])
    return np.concatenate([before, rows, after]), len(before)


def _moved(rows: Floats, turn: Floats, centre: Floats, target: Floats) -> Floats:
    """Return rows turned about a point that is moved to another, heights kept."""
    path = quat.rotate(turn, rows[:, :3] - centre) + target
    path[:, 2] = rows[:, 2]
    return np.hstack([path, quat.mul(turn, rows[:, 3:7]), rows[:, 7:]])


def _beyond(point: Floats, corners: Floats) -> float:
    """Return the distance, m, of a point (2,) beyond the hull of corners; negative within it."""
    try:
        hull = ConvexHull(corners)
    except QhullError:
        return float(np.linalg.norm(corners - point, axis=1).min())
    return float((hull.equations[:, :2] @ point + hull.equations[:, 2]).max())


def _torque_limits(model: "mujoco.MjModel", hinges: list[int]) -> Floats:
    """Return the largest torque (H,), N m, that actuators and joints allow."""
    limits = np.full(model.njnt, UNLIMITED)
    for actuator in range(model.nu):
        joint, gear = int(model.actuator_trnid[actuator, 0]), model.actuator_gear[actuator, 0]
        largest = UNLIMITED
        if model.actuator_forcelimited[actuator]:
            largest = np.abs(model.actuator_forcerange[actuator]).max() * abs(gear)
        elif model.actuator_ctrllimited[actuator] and not model.actuator_biastype[actuator]:
            # A motor, whose control is its torque.
            gain = model.actuator_gainprm[actuator, 0]
            largest = np.abs(model.actuator_ctrlrange[actuator]).max() * abs(gain * gear)
        limits[joint] = min(limits[joint], largest)
    by_joint = np.abs(model.jnt_actfrcrange).max(axis=1)
    limited = np.asarray(model.jnt_actfrclimited, dtype=bool)
    limits[limited] = np.minimum(limits[limited], by_joint[limited])
    return limits[hinges]
