"""A robot of an MJCF or URDF file, as MuJoCo reads it."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from posefield.common.errors import MotionFileError
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.robots.robot import UNLIMITED, Foot, Robot

if TYPE_CHECKING:
    import mujoco

GROUND_BAND = 0.03
"""Height above the robot's lowest point at rest, m, within which the lowest of a foot lies."""
DIRECTIONS = 64
"""Directions in which the outermost points of a foot are kept."""
KINDS = ("free", "ball", "slide", "hinge")
"""Kinds of joints by MuJoCo's numbers."""


def read(path: Path) -> Robot:
    """Return the robot of a file, with its feet.

    A base that the file welds to the world floats. Raises MotionFileError for a file that MuJoCo
    refuses, such as one whose meshes are missing, and for joints that are no hinges.
    """
    model = model_of(path)
    joints = [_Joint(model, index) for index in range(model.njnt)]
    free = [joint.body for joint in joints if joint.kind == "free"]
    if len(free) != 1:
        listed = ", ".join(repr(model.body(body).name) for body in free) or "none"
        raise MotionFileError(str(path), f"bodies that float: {listed}, expected the robot's base")
    base = free[0]
    # Bodies of other trees, such as a floor or a box, are no part of the robot.
    bodies = [index for index in range(1, model.nbody) if model.body_rootid[index] == base]
    places = {body: place for place, body in enumerate(bodies)}
    hinges = [joint for joint in joints if joint.kind == "hinge" and joint.body in places]
    robot = Robot(
        name=path.name,
        bodies=tuple(model.body(body).name or f"body {body}" for body in bodies),
        parents=tuple(places.get(int(model.body_parentid[body]), -1) for body in bodies),
        offsets=model.body_pos[bodies].copy(),
        turns=model.body_quat[bodies].copy(),
        hinges=tuple(joint.name for joint in hinges),
        hinge_bodies=tuple(places[joint.body] for joint in hinges),
        axes=np.array([joint.axis for joint in hinges]).reshape(-1, 3),
        anchors=np.array([joint.anchor for joint in hinges]).reshape(-1, 3),
        ranges=np.array([joint.range for joint in hinges]).reshape(-1, 2),
    )
    return _with_feet(robot, [_surface(model, body) for body in bodies])


def model_of(path: Path) -> "mujoco.MjModel":
    """Return the model of a file, whose base floats; raises as `read` does."""
    try:
        import mujoco
    except ImportError:
        raise MotionFileError(
            str(path), "robots are read by MuJoCo: pip install 'posefield[robots]'"
        ) from None
    expected = "expected an MJCF or URDF file"
    if not path.is_file():
        fault = "is a folder" if path.is_dir() else "no such file"
        raise MotionFileError(str(path), f"{fault}, {expected}")
    if not path.read_bytes().lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        raise MotionFileError(str(path), f"does not begin with '<' as XML does: {expected}")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        # The links of a URDF file stay, and its base floats.
        spec.compiler.fusestatic = False
        for index, joint in enumerate(spec.joints):
            if KINDS[joint.type] in ("ball", "slide"):
                name, kind = joint.name or f"joint {index}", KINDS[joint.type]
                raise MotionFileError(str(path), f"{name!r} is a {kind} joint, expected hinges")
        bodies = spec.worldbody.bodies
        if bodies and not any(KINDS[joint.type] == "free" for joint in spec.joints):
            bodies[0].add_freejoint()
        return spec.compile()
    except ValueError as fault:
        reason = " ".join(str(fault).split())
        raise MotionFileError(str(path), f"MuJoCo refuses it: {reason}") from None


class _Joint:
    def __init__(self, model: "mujoco.MjModel", index: int) -> None:
        self.kind = KINDS[int(model.jnt_type[index])]
        self.name = model.joint(index).name or f"joint {index}"
        self.body = int(model.jnt_bodyid[index])
        self.axis = model.jnt_axis[index].copy()
        self.anchor = model.jnt_pos[index].copy()
        limited = bool(model.jnt_limited[index])
        self.range = model.jnt_range[index].copy() if limited else np.array([-UNLIMITED, UNLIMITED])


def _surface(model: "mujoco.MjModel", body: int) -> Floats:
    """Return outermost points (P, 3) of a body's shapes in its frame, m: of those that collide."""
    start, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    shapes = list(range(start, start + count)) if count else []
    solid = [
        shape for shape in shapes if model.geom_contype[shape] or model.geom_conaffinity[shape]
    ]
    points = [
        model.geom_pos[shape] + quat.rotate(model.geom_quat[shape], _shape_points(model, shape))
        for shape in solid or shapes
    ]
    return _outermost(np.concatenate(points)) if points else np.empty((0, 3))


def _shape_points(model: "mujoco.MjModel", shape: int) -> Floats:
    """Return points of a shape in its own frame: corners, or where its outline is outermost."""
    kind = int(model.geom_type[shape])
    mesh = int(model.geom_dataid[shape])
    if kind == 7 and mesh >= 0:
        start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        return _outermost(np.asarray(model.mesh_vert[start : start + count], dtype=float))
    size = np.asarray(model.geom_size[shape], dtype=float)
    directions = _directions()
    if kind == 6:
        return np.sign(directions) * size
    if kind in (3, 5):
        # Capsules end in half spheres, cylinders in discs.
        ends = np.sign(directions[:, 2:]) * np.array([0.0, 0.0, size[1]])
        across = directions * ([1, 1, 1] if kind == 3 else [1, 1, 0])
        return ends + size[0] * across / np.linalg.norm(across, axis=-1, keepdims=True)
    return directions * (size if kind == 4 else size[0])


def _directions() -> Floats:
    """Return unit vectors spread over the sphere, on a spiral."""
    heights = 1.0 - (2.0 * np.arange(DIRECTIONS) + 1.0) / DIRECTIONS
    angles = np.arange(DIRECTIONS) * np.pi * (3.0 - np.sqrt(5.0))
    radii = np.sqrt(1.0 - heights**2)
    return np.stack([radii * np.cos(angles), radii * np.sin(angles), heights], axis=-1)


def _outermost(points: Floats) -> Floats:
    """Return the corners of the hull of a mesh that lie outermost in some direction."""
    try:
        points = points[ConvexHull(points).vertices]
    except QhullError:
        pass  # A flat mesh has no hull: all of its points count.
    return points[np.unique(np.argmax(points @ _directions().T, axis=0))]


def _with_feet(robot: Robot, surfaces: list[Floats]) -> Robot:
    """Return the robot with its feet: the bodies whose surfaces are the lowest at rest.

    A body without a hinge is one with the body that carries it, such as spheres below an ankle.
    """
    identity, angles = quat.IDENTITY[None], np.zeros((1, len(robot.hinges)))
    positions, rotations = robot.body_poses(np.zeros((1, 3)), identity, angles)
    lowest: dict[int, float] = {}
    for body, points in enumerate(surfaces):
        if len(points):
            heights = positions[0, body, 2] + quat.rotate(rotations[0, body], points)[:, 2]
            lowest[body] = float(heights.min())
    ground = min(lowest.values(), default=0.0)
    soles: dict[int, list[Floats]] = {}
    for body in (body for body, height in lowest.items() if height < ground + GROUND_BAND):
        points, hinged = surfaces[body], body
        while hinged and hinged not in robot.hinge_bodies:
            points = robot.offsets[hinged] + quat.rotate(robot.turns[hinged], points)
            hinged = robot.parents[hinged]
        soles.setdefault(hinged, []).append(points)
    # Of an ankle and the foot that it carries, the foot.
    carriers = {robot.parents[body] for body in soles}
    feet = tuple(
        Foot(body, _outermost(np.concatenate(points)))
        for body, points in soles.items()
        if body not in carriers
    )
    return replace(robot, feet=feet)
