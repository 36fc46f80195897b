"""Writers of reference motions, one for each layout; velocities are central differences."""

import io
import json
import pickle
from collections.abc import Sequence
from pathlib import PurePosixPath
from typing import Annotated, Any

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat
from posefield.robots.robot import Order, Robot, angular_velocities, velocities
from posefield.robots.robot_motion import RobotMotion


def _xyzw(rotations: Annotated[Floats, "frames 4"]) -> Floats:
    return rotations[:, [1, 2, 3, 0]]


def _csv(values: Floats) -> bytes:
    buffer = io.StringIO()
    np.savetxt(buffer, values, fmt="%.9g", delimiter=",")
    return buffer.getvalue().encode()


def write_unitree(motion: RobotMotion, _: Robot) -> bytes:
    """Return rows with the quaternion as x y z w."""
    return _csv(np.hstack([motion.base_path, _xyzw(motion.base_rotations), motion.angles]))


def write_qpos(motion: RobotMotion, _: Robot) -> bytes:
    """Return rows with the quaternion as w x y z."""
    return _csv(_qpos(motion))


def _qpos(motion: RobotMotion) -> Floats:
    return np.hstack([motion.base_path, motion.base_rotations, motion.angles])


def _base_velocities(motion: RobotMotion) -> Floats:
    """Return velocities (F, 6) of the base: linear in the world, angular in its own frame."""
    turning = angular_velocities(motion.base_rotations, motion.rate)
    local = quat.rotate(quat.conj(motion.base_rotations), turning)
    return np.hstack([velocities(motion.base_path, motion.rate), local])


def _npz(**fields: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **fields)
    return buffer.getvalue()


BODY_FIELDS = ("body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w")


def _body_fields(
    motion: RobotMotion, robot: Robot, names: Sequence[str] = BODY_FIELDS, order: Order = "depth"
) -> dict[str, Floats]:
    """Return positions, rotations and velocities of all bodies in an order, by names of fields."""
    positions, rotations = motion.body_poses(robot)
    rates = velocities(positions, motion.rate), angular_velocities(rotations, motion.rate)
    arrays, bodies = (positions, rotations, *rates), robot.body_order(order)
    return {name: array[:, bodies] for name, array in zip(names, arrays, strict=True)}


def write_tracking(motion: RobotMotion, robot: Robot, order: Order) -> bytes:
    """Return poses and velocities of all bodies and unnamed joints, in an order."""
    hinges = robot.hinge_order(order)
    return _npz(
        fps=np.array([motion.rate]),
        joint_pos=motion.angles[:, hinges],
        joint_vel=velocities(motion.angles, motion.rate)[:, hinges],
        **_body_fields(motion, robot, order=order),
    )


def write_holosoma(motion: RobotMotion, robot: Robot) -> bytes:
    """Return MuJoCo's coordinates with poses and names of joints and bodies."""
    speeds = velocities(motion.angles, motion.rate)
    return _npz(
        fps=np.array([motion.rate]),
        joint_pos=_qpos(motion),
        joint_vel=np.hstack([_base_velocities(motion), speeds]),
        **_body_fields(motion, robot),
        joint_names=np.array(robot.hinges),
        body_names=np.array(robot.bodies),
    )


ISAACLAB_FIELDS = [
    f"body_{kind}" for kind in ("positions", "rotations", "linear_velocities", "angular_velocities")
]


def write_isaaclab(motion: RobotMotion, robot: Robot) -> bytes:
    """Return angles of named joints, and poses of named bodies."""
    return _npz(
        fps=np.array(motion.rate),
        dof_names=np.array(robot.hinges),
        body_names=np.array(robot.bodies),
        dof_positions=motion.angles,
        dof_velocities=velocities(motion.angles, motion.rate),
        **_body_fields(motion, robot, ISAACLAB_FIELDS),
    )


def write_loco(motion: RobotMotion, robot: Robot) -> bytes:
    """Return MuJoCo's coordinates as a trajectory of LocoMuJoCo."""
    speeds = velocities(motion.angles, motion.rate)
    return _npz(
        joint_names=np.array(["root", *robot.hinges]),
        njnt=np.array(1 + len(robot.hinges)),
        # MuJoCo's types of joints: free, and hinges.
        jnt_type=np.array([0] + [3] * len(robot.hinges)),
        frequency=np.array(motion.rate),
        qpos=_qpos(motion),
        qvel=np.hstack([_base_velocities(motion), speeds]),
        split_points=np.array([0, len(motion)]),
    )


def write_qpos_npz(motion: RobotMotion, _: Robot) -> bytes:
    """Return MuJoCo's coordinates with the rate."""
    return _npz(qpos=_qpos(motion), fps=np.array(motion.rate))


def _pickle(fields: dict[str, Any]) -> bytes:
    return pickle.dumps(fields, protocol=4)


def write_gmr(motion: RobotMotion, robot: Robot) -> bytes:
    """Return a pickle of base, angles, and bodies about the base."""
    positions, _ = motion.body_poses(robot)
    inverse = quat.conj(motion.base_rotations)[:, None]
    return _pickle(
        {
            "fps": motion.rate,
            "root_pos": motion.base_path,
            "root_rot": _xyzw(motion.base_rotations),
            "dof_pos": motion.angles,
            "local_body_pos": quat.rotate(inverse, positions - positions[:, :1]),
            "link_body_list": list(robot.bodies),
        }
    )


def write_mimickit(motion: RobotMotion, _: Robot) -> bytes:
    """Return a pickle of rows with rotation vectors."""
    frames = np.hstack([motion.base_path, quat.log(motion.base_rotations), motion.angles])
    loops = int(bool(motion.loops))
    return _pickle({"loop_mode": loops, "fps": motion.rate, "frames": frames.tolist()})


def write_asap(motion: RobotMotion, robot: Robot) -> bytes:
    """Return a pickle of base and angles, and rotation vectors of the hinges."""
    turns = motion.angles[..., None] * robot.axes
    return _pickle(
        {
            PurePosixPath(motion.source).stem: {
                "root_trans_offset": motion.base_path,
                "pose_aa": np.hstack([quat.log(motion.base_rotations)[:, None], turns]),
                "dof": motion.angles,
                "root_rot": _xyzw(motion.base_rotations),
                "fps": motion.rate,
            }
        }
    )


def write_awd(motion: RobotMotion, robot: Robot) -> bytes:
    """Return a JSON document that states its layout, with velocities."""
    columns = {
        "root_pos": motion.base_path,
        "root_quat": _xyzw(motion.base_rotations),
        "joints_pos": motion.angles,
        "world_linear_vel": velocities(motion.base_path, motion.rate),
        "world_angular_vel": angular_velocities(motion.base_rotations, motion.rate),
        "joints_vel": velocities(motion.angles, motion.rate),
    }
    sizes = {name: values.shape[1] for name, values in columns.items()}
    starts = dict(zip(sizes, np.cumsum([0, *sizes.values()]).tolist(), strict=False))
    return _amp_text(
        motion,
        np.hstack(list(columns.values())),
        FPS=motion.rate,
        Joints=list(robot.hinges),
        Frame_offset=[starts],
        Frame_size=[sizes],
    )


def _amp_text(motion: RobotMotion, rows: Floats, **fields: Any) -> bytes:
    document = {
        "LoopMode": "Wrap" if motion.loops else "Clamp",
        "FrameDuration": 1.0 / motion.rate,
        "EnableCycleOffsetPosition": True,
        "EnableCycleOffsetRotation": True,
        "MotionWeight": 1.0,
        **fields,
        "Frames": rows.tolist(),
    }
    return json.dumps(document).encode()


def write_amp(motion: RobotMotion, _: Robot) -> bytes:
    """Return a JSON document of rows with the quaternion as x y z w."""
    rows = np.hstack([motion.base_path, _xyzw(motion.base_rotations), motion.angles])
    return _amp_text(motion, rows)
