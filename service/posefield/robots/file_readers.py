"""Readers of reference motions, one for each layout of fields."""

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat
from posefield.robots.file_conventions import File, Poses, tell_order, tell_quaternions, wxyz
from posefield.robots.robot import Robot
from posefield.robots.robot_motion import RobotMotion

NAMED, UNNAMED = "names in the file", "order of the robot's file"
WXYZ, XYZW = "wxyz: the format's", "xyzw: the format's"


def from_rows(file: File) -> RobotMotion:
    """Return the motion of rows of a CSV file: base position, quaternion, joint angles."""
    rows = file.array("rows", None, None)
    if rows.shape[1] < 8:
        raise file.error(
            f"found {rows.shape[1]} columns, expected 3 of the base's position, 4 of its "
            "quaternion, and one for each joint"
        )
    path, angles = rows[:, :3], rows[:, 7:]
    rotations, quaternions = tell_quaternions(file, path, rows[:, 3:7], angles)
    rate = file.rate(None, " (Unitree's files have 30)")
    name = "unitree.csv" if np.array_equal(rotations[:, 0], rows[:, 6]) else "qpos.csv"
    return file.motion(name, (path, rotations, angles), rate, UNNAMED, quaternions)


def from_tracking(file: File) -> RobotMotion:
    """Return the motion of poses of all bodies and unnamed joints, in either order."""
    angles = file.array("joint_pos", None, None)
    bodies = file.array("body_pos_w", len(angles), None, 3)
    turns = file.array("body_quat_w", len(angles), bodies.shape[1], 4)[:, 0]
    ordered, order = tell_order(file, angles, bodies, turns)
    breadth = (file.conventions.order or order).startswith("breadth")
    name = "beyondmimic.npz" if breadth else "mjlab.npz"
    return file.motion(name, (bodies[:, 0], turns, ordered), _rate(file), order, WXYZ)


def _number(file: File, field: str) -> float | None:
    """Return the first number of a field; None without the field, or without a number in it."""
    if field not in file.content:
        return None
    values = np.ravel(file.array(field, *([None] * np.ndim(file.content[field]))))
    return float(values[0]) if len(values) else None


def _rate(file: File, field: str = "fps") -> tuple[float, str]:
    return file.rate(_number(file, field), "")


def from_holosoma(file: File) -> RobotMotion:
    """Return the motion of MuJoCo's coordinates with names of joints and bodies."""
    hinges = file.names("joint_names")
    columns = file.array("joint_pos", None, 7 + len(hinges))
    return file.motion("holosoma.npz", _split(columns), _rate(file), NAMED, WXYZ, hinges=hinges)


def _split(qpos: Floats) -> Poses:
    return qpos[:, :3], qpos[:, 3:7], qpos[:, 7:]


def from_isaaclab(file: File) -> RobotMotion:
    """Return the motion of named joints and bodies, whose first is the base."""
    hinges, bodies = file.names("dof_names"), file.names("body_names")
    angles = file.array("dof_positions", None, len(hinges))
    positions = file.array("body_positions", len(angles), len(bodies), 3)
    rotations = file.array("body_rotations", len(angles), len(bodies), 4)
    robot = file.conventions.robot
    base = bodies.index(robot.bodies[0]) if robot and robot.bodies[0] in bodies else 0
    poses = positions[:, base], rotations[:, base], angles
    return file.motion("isaaclab.npz", poses, _rate(file), NAMED, WXYZ, hinges=hinges)


PELVIS = ("pelvis_tx", "pelvis_tz", "pelvis_ty", "pelvis_tilt", "pelvis_list", "pelvis_rotation")
"""Base of the first LocoMuJoCo: forward, left and upward path, then turns about y, x and z."""


def from_loco_joints(file: File) -> RobotMotion:
    """Return the motion of one field for each joint, as LocoMuJoCo's first files have."""
    names = [name[2:] for name in file.content if name.startswith("q_")]
    missing = [name for name in PELVIS if name not in names]
    if missing:
        raise file.error(f"found no field 'q_{missing[0]}' of the base")
    columns = {name: file.array(f"q_{name}", None) for name in names}
    hinges = tuple(name for name in names if name not in PELVIS)
    path = np.stack([columns[name] for name in PELVIS[:3]], axis=-1)
    robot = file.conventions.robot
    if robot:
        # The height is told from that of the robot's file.
        path = path + robot.offsets[0]
    turns = np.stack([columns[name] for name in PELVIS[3:]], axis=-1)
    rate = file.rate(None, " (LocoMuJoCo's first files have 500)")
    angles = np.stack([columns[name] for name in hinges], axis=-1)
    poses, quaternions = (path, quat.from_euler(turns, "YXZ"), angles), "none: three angles"
    return file.motion("locomujoco.npz", poses, rate, NAMED, quaternions, hinges=hinges)


def from_qpos(file: File) -> RobotMotion:
    """Return the motion of MuJoCo's coordinates."""
    columns = file.array("qpos", None, None)
    hinges, joints = tuple[str, ...](), UNNAMED
    if "joint_names" in file.content:
        # The first joint of a trajectory is the free one of the base.
        hinges, joints = file.names("joint_names")[1:], NAMED
    rate = file.rate(_number(file, "frequency") or _number(file, "fps"), "")
    name = "locomujoco.npz" if "split_points" in file.content else "qpos.npz"
    return file.motion(name, _split(columns), rate, joints, "wxyz: MuJoCo's", hinges=hinges)


LEG = ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll", "toe_base")
ARM = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow")
WRIST = ("wrist_roll", "wrist_pitch", "wrist_yaw", "hand_roll")
KIMODO_G1 = (
    "pelvis",
    *(f"{side}_{joint}" for side in ("left", "right") for joint in LEG),
    *("waist_yaw", "waist_roll", "waist_pitch"),
    *(f"{side}_{joint}" for side in ("left", "right") for joint in (*ARM, *WRIST)),
)
"""Joints of Kimodo's robot G1 in the order of its files."""
OFF_AXIS = np.radians(10.0)
"""Largest mean turn of a joint about other axes than its hinge's."""


def from_kimodo(file: File) -> RobotMotion:
    """Return the motion of the robot G1 of rotations of its bodies in the world, with Y up.

    Kimodo predicts rotations, not angles: each joint's turn about its hinge is taken, and the mean
    of what is left out is told.
    """
    positions = file.array("posed_joints", None, None, 3)
    joints = positions.shape[1]
    if joints != len(KIMODO_G1):
        raise file.error(
            f"holds {joints} joints of a person, expected the {len(KIMODO_G1)} of the robot G1: a "
            "recipe without [robot] reads people of Kimodo"
        )
    robot = file.conventions.robot
    if robot is None:
        raise file.error(
            "holds rotations of the robot G1, no angles: expected the robot too (--robot g1.xml)"
        )
    matrices = file.array("global_rot_mats", len(positions), joints, 3, 3)
    turns = quat.from_matrix(matrices[..., [2, 0, 1], :][..., [2, 0, 1]])
    angles, off_axis = [], []
    for hinge, name in enumerate(robot.hinges):
        body = robot.hinge_bodies[hinge]
        row, parent = (_kimodo_joint(file, robot, b) for b in (body, robot.parents[body]))
        local = quat.mul(quat.conj(turns[:, parent]), turns[:, row])
        turn = quat.mul(quat.conj(robot.turns[body])[None], local)
        angle = quat.twist(turn, robot.axes[hinge])
        rest = quat.mul(quat.conj(quat.from_axis_angle(robot.axes[hinge], angle)), turn)
        angles.append(angle)
        off_axis.append(float(np.linalg.norm(quat.log(rest), axis=-1).mean()))
        if off_axis[-1] > OFF_AXIS:
            raise file.error(
                f"joint {name!r} turns by {np.degrees(off_axis[-1]):.1f} degrees in the mean about "
                f"other axes than its hinge in {robot.name}: expected the robot G1"
            )
    rate = file.rate(None, " (Kimodo's files have 30)")
    left_out = np.degrees(max(off_axis))
    evidence = f"turns about the hinges; up to {left_out:.1f} degrees (mean) are left out"
    unwrapped = np.unwrap(np.stack(angles, axis=-1), axis=0)
    poses = positions[:, 0, [2, 0, 1]], turns[:, 0], unwrapped
    return file.motion("kimodo.npz", poses, rate, evidence, "none: matrices", hinges=robot.hinges)


def _kimodo_joint(file: File, robot: Robot, body: int) -> int:
    """Return the index of the joint of Kimodo's G1 that moves a body."""
    if body == 0:
        return 0
    name = robot.hinges[robot.hinge_bodies.index(body)] if body in robot.hinge_bodies else ""
    joint = name.removesuffix("_joint")
    if joint not in KIMODO_G1:
        raise file.error(
            f"joint {name!r} of {robot.name} is none of Kimodo's G1: expected the robot G1"
        )
    return KIMODO_G1.index(joint)


def from_gmr(file: File) -> RobotMotion:
    """Return the motion of a retargeter's pickle."""
    angles = file.array("dof_pos", None, None)
    rotations = wxyz(file.array("root_rot", len(angles), 4), "xyzw")
    path = file.array("root_pos", len(angles), 3)
    return file.motion("gmr.pkl", (path, rotations, angles), _rate(file), UNNAMED, XYZW)


def from_mimickit(file: File) -> RobotMotion:
    """Return the motion of rows of base position, rotation vector and joint angles."""
    frames = file.array("frames", None, None)
    if frames.shape[1] < 7:
        raise file.error(
            f"found {frames.shape[1]} numbers a frame, expected 6 of the base and more"
        )
    poses = frames[:, :3], quat.exp(frames[:, 3:6]), frames[:, 6:]
    loops = bool(file.content["loop_mode"])
    quaternions = "none: rotation vectors"
    return file.motion("mimickit.pkl", poses, _rate(file), UNNAMED, quaternions, loops=loops)


def from_asap(file: File) -> RobotMotion:
    """Return the motion of a pickle with the base's quaternions and joint angles."""
    angles = file.array("dof", None, None)
    path = file.array("root_trans_offset", len(angles), 3)
    rotations = wxyz(file.array("root_rot", len(angles), 4), "xyzw")
    return file.motion("asap.pkl", (path, rotations, angles), _rate(file), UNNAMED, XYZW)


AWD_FIELDS = ("root_pos", "root_quat", "joints_pos")


def _loops(file: File) -> bool:
    return str(file.content.get("LoopMode", "")).casefold() == "wrap"


def _frame_rate(file: File) -> tuple[float, str]:
    rate, duration = _number(file, "FPS"), _number(file, "FrameDuration")
    # Both are rounded.
    agree = rate is None or duration is None or abs(rate * duration - 1.0) < 0.05
    if not (agree or file.conventions.rate):
        raise file.error(f"states {rate:g} FPS and a FrameDuration of {duration:g} s: say --rate")
    return file.rate(rate or (1.0 / duration if duration else None), "")


def from_awd(file: File) -> RobotMotion:
    """Return the motion of rows whose layout the file states, with names of joints."""
    rows, hinges = file.array("Frames", None, None), file.names("Joints")
    layout = [
        np.ravel(file.content.get(name, [])).tolist() for name in ("Frame_offset", "Frame_size")
    ]
    if not all(len(entry) == 1 and isinstance(entry[0], dict) for entry in layout):
        raise file.error("Frame_offset and Frame_size hold no object each, expected one")
    (starts,), (sizes,) = layout
    parts = {}
    for name, size in zip(AWD_FIELDS, (3, 4, len(hinges)), strict=True):
        if sizes.get(name) != size or starts.get(name, -1) + size > rows.shape[1]:
            raise file.error(
                f"Frame_size and Frame_offset of {name!r} are {sizes.get(name)} and "
                f"{starts.get(name)}, expected {size} numbers within the {rows.shape[1]} of a frame"
            )
        parts[name] = rows[:, starts[name] : starts[name] + size]
    poses = parts["root_pos"], wxyz(parts["root_quat"], "xyzw"), parts["joints_pos"]
    facts = {"hinges": hinges, "loops": _loops(file)}
    return file.motion("awd.json", poses, _frame_rate(file), NAMED, XYZW, **facts)


DIFFERENCES = 0.9
"""Least correlation of columns of velocities with the differences of columns of angles."""


def _are_velocities(angles: Floats, speeds: Floats) -> bool:
    steps, means = np.diff(angles, axis=0), 0.5 * (speeds[1:] + speeds[:-1])
    if not (steps.any() and means.any()):
        return False
    return bool(np.corrcoef(steps.ravel(), means.ravel())[0, 1] > DIFFERENCES)


def from_amp(file: File) -> RobotMotion:
    """Return the motion of rows of text: with a quaternion, or with TienKung's three angles."""
    rows = file.array("Frames", None, None)
    rate, half, loops = _frame_rate(file), rows.shape[1] // 2, _loops(file)
    if rows.shape[1] % 2 == 0 and half > 7:
        if _are_velocities(rows[:, 6:half], rows[:, half + 6 :]):
            quaternions = "none: roll, pitch and yaw, as velocities follow in each row"
            poses = rows[:, :3], quat.from_euler(rows[:, [5, 4, 3]], "ZYX"), rows[:, 6:half]
            return file.motion("tienkung.txt", poses, rate, UNNAMED, quaternions, loops=loops)
        count = next((n for n in range(half, 6, -1) if _are_leading(rows, n)), None)
        if count:
            raise file.error(
                f"holds the angles of {count} joints and their velocities, but no base: expected "
                "the file of whole poses (TienKung calls it motion_visualization)"
            )
    path, angles = rows[:, :3], rows[:, 7:]
    rotations, quaternions = tell_quaternions(file, path, rows[:, 3:7], angles)
    return file.motion(
        "amp.txt", (path, rotations, angles), rate, UNNAMED, quaternions, loops=loops
    )


def _are_leading(rows: Floats, count: int) -> bool:
    """Return whether rows begin with angles of some joints and their velocities."""
    return _are_velocities(rows[:, :count], rows[:, count : 2 * count])
