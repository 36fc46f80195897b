"""Carry motion capture of people onto a robot, by the inverse kinematics of mink.

    pip install "posefield[robots]" mink daqp
    python examples/people_on_robot.py g1.xml walks/*.bvh --unit 0.01 -o robot_walks

Pelvis and feet follow the motion scaled by the length of the legs; elbows and hands follow from the
shoulders, scaled by the length of the arms. mink keeps joints within their limits, soles above the
floor and limbs apart (https://github.com/kevinzakka/mink). Frames stay, so that a table of clips
fits with the files' names changed. Roles that are not recognised are given: --role
leftFoot=left_ankle_roll_link.
"""

import argparse
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import mujoco
import numpy as np

from posefield.common.errors import InvalidField, MotionError, MotionFileError
from posefield.common.units import UP, Floats, Frames, Indices, RootPath
from posefield.motion import contact_detection, quat
from posefield.motion.clip import Clip
from posefield.motion.contact_detection import ContactThresholds
from posefield.motion.joint_roles import ROLES
from posefield.retarget import role_map
from posefield.retarget.role_map import SIDES, Body, PosedBody
from posefield.robots import robot_formats
from posefield.robots.robot import Robot
from posefield.robots.robot_motion import RobotMotion
from posefield.roles import joint_recognition
from posefield_train.robots import robot_file
from posefield_train.source import motion_file, motion_readers

try:
    import mink
except ImportError:
    raise SystemExit("people_on_robot: needs mink and a solver: pip install mink daqp") from None

Frame = tuple[RootPath, Annotated[Floats, "frames 4"]]
"""Positions, m, and turns from rest of a frame of the robot, with Y up."""
LEG, ARM = ("UpperLeg", "LowerLeg", "Foot"), ("UpperArm", "LowerArm", "Hand")
FOOT_COSTS, HIP_COSTS, CHEST_COSTS, ARM_COSTS = (20.0, 5.0), (3.0, 2.0), (0.0, 1.0), (1.0, 0.0)
"""Costs of a frame's distance from its target, 1/m, and of its turn, 1/rad."""
POSTURE, IDLE, DAMPING = 0.02, 1.0, 1e-6
"""Costs of an angle beside that at rest, of one beyond the wrist, and of any change, 1/rad."""
FIRST_STEPS, STEPS, STILL = 100, 3, 1e-3
"""Most steps of the solver in the first frame and in others, and the change, rad, of the last."""
FASTEST = 20.0
"""Limit of the speed of a hinge, rad/s."""
BENT, SAMPLES = 0.1, 181
"""Least bend of knees and elbows, rad: a straight limb may bend either way. Angles tried for it."""
APART, NEAR = 0.005, 0.02
"""Distance that limbs keep, and below which it is looked at, m."""
STANDING = ContactThresholds(speed=0.15, height=0.05, grown_speed=0.25, grown_height=0.07)
"""Thresholds of an ankle while the foot lies flat, on a floor that need not be level."""
LEANS = np.linspace(1.0, 0.0, 33)[:, None]
"""Shares of a foot's lean of which the largest that leaves its toes above the floor is taken."""
LEVEL = np.array([1.0, 0.0, 1.0, 0.0])
"""Numbers of a quaternion that turn about the vertical."""
FLOOR = "floor of people_on_robot"
TO_Z_UP, TO_Y_UP = [2, 0, 1], [1, 2, 0]


class Carrier:
    """A robot that follows people. roles: body by role; others are recognised by name."""

    def __init__(self, path: Path, roles: Mapping[str, str]) -> None:
        self.robot = robot_file.read(path)
        self._body = _RobotBody(path, self.robot, roles)
        self._joints = self._body.body.joints
        self._model = model = _model(path)
        base = int(model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE][0])
        self._bodies = [i for i in range(1, model.nbody) if model.body_rootid[i] == base]
        hinges = [model.joint(name).id for name in self.robot.hinges]
        ranges = self.robot.ranges.copy()
        for hinge, limits in self._body.bent():
            ranges[hinge] = model.jnt_range[hinges[hinge]] = limits
        free = model.jnt_qposadr[model.body_jntadr[base]] + np.arange(7)
        self._numbers = np.concatenate([free, model.jnt_qposadr[hinges]])
        self._angles = np.clip(0.0, ranges[:, 0], ranges[:, 1])
        self._posture = np.full(model.nv, POSTURE)
        for hand in (self._joints[s + "Hand"] for s in SIDES if s + "Hand" in self._joints):
            beyond = mink.get_subtree_joint_ids(model, self._bodies[hand])
            self._posture[model.jnt_dofadr[beyond]] = IDLE
        self._limits = [mink.ConfigurationLimit(model), *self._collisions()]

    def _collisions(self) -> Iterator[Any]:
        model = self._model
        solid = np.flatnonzero(model.geom_contype | model.geom_conaffinity).tolist()

        def shapes(of: Any, *roles: str) -> list[int]:
            bodies = [self._bodies[self._joints[role]] for role in roles if role in self._joints]
            return [shape for body in bodies for shape in of(model, body) if shape in solid]

        limbs = ("LowerArm", "UpperLeg", "Foot")
        arms, legs, feet = (
            [shapes(mink.get_subtree_geom_ids, side + limb) for side in SIDES] for limb in limbs
        )
        others = [*shapes(mink.get_body_geom_ids, "hips", "chest"), *legs[0], *legs[1]]
        limit = partial(mink.CollisionAvoidanceLimit, model, collision_detection_distance=NEAR)
        floor = [int(model.geom(FLOOR).id)]
        yield limit([(feet[0] + feet[1], floor)], minimum_distance_from_collisions=0.0)
        pairs = [(legs[0], legs[1]), (arms[0], others), (arms[1], others)]
        yield limit(pairs, minimum_distance_from_collisions=APART)

    def carried(self, clip: Clip, source: str) -> tuple[RobotMotion, dict[str, Floats]]:
        """Return the robot's motion, and the distances (F,) from its targets by role, m.

        clip: of a person. source: the file's name.
        """
        robot, tasks, frames = self._body, dict[str, Any](), dict[str, Frame]()
        targets = _Targets(robot, clip, source)
        for role, (path, turns) in targets.frames.items():
            costs = {"hips": HIP_COSTS, "chest": CHEST_COSTS}.get(role, FOOT_COSTS)
            tasks[role] = mink.FrameTask(self._bodies[self._joints[role]], "body", *costs)
            z_up = np.concatenate([turns[:, :1], turns[:, 1:][:, TO_Z_UP]], axis=-1)
            frames[role] = path[:, TO_Z_UP], quat.mul(z_up, robot.turns[self._joints[role]])
        for role, path in targets.arms.items():
            hand, chest = (self._bodies[self._joints[end]] for end in (role, "chest"))
            tasks[role] = mink.RelativeFrameTask(hand, "body", chest, "body", *ARM_COSTS)
            back = quat.conj(robot.turns[self._joints["chest"]])
            unturned = np.tile(quat.IDENTITY, (len(clip), 1))
            frames[role] = quat.rotate(back, path[:, TO_Z_UP]), unturned
        state = mink.Configuration(self._model)
        posture = mink.PostureTask(self._model, self._posture)
        start = state.q.copy()
        start[self._numbers] = np.concatenate([*(part[0] for part in frames["hips"]), self._angles])
        state.update(start)
        posture.set_target(start)
        # mink's bounds of distances count in units of time: a step is one.
        most = dict.fromkeys(robot.robot.hinges, FASTEST / (STEPS * clip.rate))
        limits = [*self._limits, mink.VelocityLimit(self._model, most)]
        numbers = np.empty((len(clip), len(self._numbers)))
        errors = {role: np.empty(len(clip)) for role in tasks if role != "chest"}
        for frame in range(len(clip)):
            for task, (path, turns) in zip(tasks.values(), frames.values(), strict=True):
                task.set_target(mink.SE3(np.concatenate([turns[frame], path[frame]])))
            goals, bounds = [*tasks.values(), posture], limits if frame else self._limits
            for _ in range(STEPS if frame else FIRST_STEPS):
                change = mink.solve_ik(state, goals, 1.0, "daqp", DAMPING, limits=bounds)
                state.integrate_inplace(change, 1.0)
                if np.abs(change).max() < STILL:
                    break
            numbers[frame] = state.q[self._numbers]
            for role, distances in errors.items():
                distances[frame] = np.linalg.norm(tasks[role].compute_error(state)[:3])
        base = quat.unroll(numbers[:, 3:7])
        angles, hinges = numbers[:, 7:], self.robot.hinges
        motion = RobotMotion(source, "mink", numbers[:, :3], base, angles, clip.rate, hinges)
        return motion, errors


def _model(path: Path) -> mujoco.MjModel:
    """Return the robot on a floor; its base floats."""
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.fusestatic = False
    if not any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in spec.joints):
        spec.worldbody.first_body().add_freejoint()
    spec.worldbody.add_geom(name=FLOOR, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
    return spec.compile()


class _RobotBody:
    """Bodies of a robot.

    turns (B, 4): at rest, with Z up. soles: points (P, 3) beside the foot's body at rest, m, by
    side. ankle: height of the feet's bodies at rest, m.
    """

    def __init__(self, path: Path, robot: Robot, roles: Mapping[str, str]) -> None:
        self.robot = robot
        rest, turns = self._poses(np.zeros((1, len(robot.hinges))))
        places, self.turns = rest[0][:, TO_Y_UP], turns[0]
        names = joint_recognition.roles_of(robot.bodies, robot.parents)
        soles = dict[str, list[Floats]]()
        for foot in robot.feet:
            # Soles may be bodies without hinges below that of the foot.
            chain = role_map.joint_chain(robot.parents, foot.body)
            body = max(body for body in chain if body in (0, *robot.hinge_bodies))
            side = SIDES[int(places[body, 0] < 0.0)]
            names[side + "Foot"] = robot.bodies[body]
            points = quat.rotate(self.turns[foot.body], foot.points)[:, TO_Y_UP]
            soles.setdefault(side, []).append(points + places[foot.body] - places[body])
        for role, name in roles.items():
            if role not in ROLES or name not in robot.bodies:
                reason = (
                    f"found --role {role}={name}, expected a role, such as leftFoot, and a body"
                )
                raise MotionFileError(str(path), reason)
        names |= roles
        missing = [role for role in joint_recognition.NEEDED if names.get(role) not in robot.bodies]
        if missing or len(soles) < len(SIDES):
            lacking = ", ".join(missing) or "the soles of two feet"
            reason = f"found no body for {lacking}, expected one each: give --role ROLE=BODY"
            raise MotionFileError(str(path), reason)
        self.soles = {side: np.concatenate(points) for side, points in soles.items()}
        self.ankle = -float(np.mean([points[:, 1].min() for points in self.soles.values()]))
        bones = places - places[np.maximum(robot.parents, 0)]
        joints = {role: robot.bodies.index(name) for role, name in names.items()}
        self.body = Body(robot.bodies, robot.parents, bones, joints)

    def _poses(self, angles: Floats) -> tuple[Floats, Floats]:
        still = np.zeros((len(angles), 3)), np.tile(quat.IDENTITY, (len(angles), 1))
        return self.robot.body_poses(*still, angles)

    def bent(self) -> Iterator[tuple[int, tuple[float, float]]]:
        """Yield each hinge of a knee or elbow, and the wider side of its range from straight on."""
        robot, joints = self.robot, self.body.joints
        for limb in ([side + part for part in parts] for side in SIDES for parts in (LEG, ARM)):
            start, middle, end = (joints.get(role, 0) for role in limb)
            hinges = [hinge for hinge, body in enumerate(robot.hinge_bodies) if body == middle]
            if len(hinges) != 1 or not middle:
                continue
            angles = np.zeros((SAMPLES, len(robot.hinges)))
            low, high = np.clip(robot.ranges[hinges[0]], -np.pi, np.pi)
            angles[:, hinges[0]] = tried = np.linspace(low, high, SAMPLES)
            places = self._poses(angles)[0]
            straight = tried[np.argmax(np.linalg.norm(places[:, end] - places[:, start], axis=-1))]
            if high - straight > straight - low:
                yield hinges[0], (max(low, straight + BENT), high)
            else:
                yield hinges[0], (low, min(high, straight - BENT))


class _Targets:
    """Targets of a robot by role. frames: in the world. arms: paths (F, 3), m, beside the chest."""

    def __init__(self, robot: _RobotBody, clip: Clip, source: str) -> None:
        self._robot, self._rate = robot, clip.rate
        try:
            person = role_map.body_of_motion(clip.skeleton, clip.translations.mean(axis=0), {})
        except InvalidField as fault:
            raise MotionFileError(source, str(fault)) from None
        self._person = PosedBody.of_rotations(person, clip.rotations, clip.root_path)
        self._bodies = robot.body, person
        self._scale = robot.body.leg_length / person.leg_length
        self._facing = quat.from_axis_angle(UP, np.array(person.facing - robot.body.facing))
        feet = [self._foot(side) for side in SIDES]
        self.frames = {"hips": self._hips(np.mean([ground for _, ground in feet], axis=0))}
        self.frames |= {side + "Foot": frame for side, (frame, _) in zip(SIDES, feet, strict=True)}
        self.arms: dict[str, RootPath] = {}
        if all("chest" in body.joints for body in self._bodies):
            self.frames["chest"] = np.zeros((len(clip), 3)), self._turns("chest")
            for limb in ([side + part for part in ARM] for side in SIDES):
                if all({*limb} <= body.joints.keys() for body in self._bodies):
                    self.arms |= dict(self._arm(*limb))

    def _turns(self, role: str) -> Floats:
        joint = self._person.body.joints[role]
        return quat.mul(self._person.orientations[:, joint], self._facing)

    def _scaled(self, path: RootPath, ground: Frames) -> RootPath:
        return self._scale * (path - np.outer(ground, UP)) + self._robot.ankle * UP

    def _hips(self, ground: Frames) -> Frame:
        legs, body, turns = [s + "UpperLeg" for s in SIDES], self._robot.body, self._turns("hips")
        middle = np.mean([self._person.of_role(leg) for leg in legs], axis=0)
        rest = np.mean([body.rest[body.joints[leg]] for leg in legs], axis=0)
        below = quat.rotate(turns, rest - body.rest[body.joints["hips"]])
        return self._scaled(middle, ground) - below, turns

    def _foot(self, side: str) -> tuple[Frame, Frames]:
        """Return the target of a foot, and the height (F,), m, of the person's ankle in stances."""
        path, turns = self._person.of_role(side + "Foot"), self._turns(side + "Foot")
        stands = contact_detection.detect_contacts(path, self._rate, False, thresholds=STANDING)
        if not stands.any():
            stands = path[:, 1] <= np.percentile(path[:, 1], 5.0)
        runs = contact_detection.runs(stands, cyclic=False)
        # At rest, a foot of a capture need not lie as it stands.
        up = quat.rotate(quat.conj(turns[stands]), UP).mean(axis=0)
        half = UP + up / np.linalg.norm(up)
        turns = quat.mul(turns, quat.normalize(np.array([half[1], half[2], 0.0, -half[0]])))
        lean = quat.mul(quat.conj(turns), quat.normalize(turns * LEVEL))
        turns = quat.mul(turns, quat.exp(_between(quat.log(lean), runs)))
        ground = _between(_means(path, runs), runs)[:, 1]
        # Each foot keeps its place below its own hip: hips of robots are wider.
        place = self._scaled(path, ground) + quat.rotate(turns, self._across(side + "UpperLeg"))
        place = place + _between(_means(place, runs) - place, runs)
        place[:, 1] = np.maximum(place[:, 1], self._robot.ankle)
        # A person's foot bends at the ball, a robot's does not.
        leaning = quat.slerp(quat.normalize(turns * LEVEL), turns, LEANS)
        soles = quat.rotate(leaning[:, :, None], self._robot.soles[side])[..., 1].min(axis=-1)
        above = place[:, 1] + soles >= 0.0
        best = np.where(above.any(axis=0), np.argmax(above, axis=0), len(LEANS) - 1)
        return (place, leaning[best, np.arange(len(turns))]), ground

    def _across(self, role: str) -> Floats:
        """Return by how much the robot's joint is left of the person's, scaled, m: (3,)."""
        robot, person = (body.rest[body.joints[role], 0] for body in self._bodies)
        return np.array([robot - self._scale * person, 0.0, 0.0])

    def _arm(self, shoulder: str, elbow: str, hand: str) -> Iterator[tuple[str, RootPath]]:
        body, person = self._bodies
        chest = body.joints["chest"]
        chain = role_map.joint_chain(body.parents, body.joints[elbow])
        start = body.rest[chain[chain.index(chest) + 1]].copy()
        start[0] = body.rest[body.joints[shoulder], 0]
        # Arms keep their distance from the hips, beside which shoulders of robots are narrower.
        outward = self._across(shoulder.replace("Arm", "Leg")) - self._across(shoulder)
        place = np.tile(start - body.rest[chest], (len(self._person.roots), 1))
        back = quat.conj(self._turns("chest"))
        for upper, lower in pairwise((shoulder, elbow, hand)):
            end = body.rest[body.joints[lower]]
            ratio = np.linalg.norm(end - start) / person.length(upper, lower)
            bone = self._person.of_role(lower) - self._person.of_role(upper)
            place, start = place + ratio * quat.rotate(back, bone), end
            yield lower, place + outward


def _means(paths: RootPath, runs: Sequence[Indices]) -> RootPath:
    """Return the mean (F, 3) of each run of frames, 0 in other frames."""
    means = np.zeros_like(paths)
    for run in runs:
        means[run] = paths[run].mean(axis=0)
    return means


def _between(changes: Floats, runs: Sequence[Indices]) -> Floats:
    """Return changes (F, 3) in the frames of runs, and linear between these."""
    frames, times = np.concatenate(runs), np.arange(len(changes))
    return np.stack([np.interp(times, frames, column[frames]) for column in changes.T], axis=-1)


def _facts(robot: Robot, motion: RobotMotion, errors: Mapping[str, Floats]) -> dict[str, Any]:
    """Return the figures of a motion that tell whether it is fit to train on."""
    soles = robot.foot_points(*motion.body_poses(robot))
    lowest = min(float(points[..., 2].min()) for points in soles)
    speeds = np.abs(np.diff(motion.angles, axis=0)) * motion.rate
    return {
        "frames": len(motion),
        "beyond_limits_degrees": max(0.0, float(np.degrees(motion.beyond_limits(robot).max()))),
        "sunk_mm": 1000.0 * max(0.0, -lowest),
        "fastest_rad_s": float(speeds.max()),
        "off_mm": {role: 1000.0 * float(np.sqrt(np.mean(d**2))) for role, d in errors.items()},
    }


def main() -> None:
    """Carry each file, and print a line of JSON for it."""
    words = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    words.add_argument("robot", type=Path, help="MJCF or URDF file")
    words.add_argument("files", type=Path, nargs="+", help="captures that posefield reads")
    words.add_argument(
        "--unit", type=float, help="length of a unit, m, of files that do not state it"
    )
    words.add_argument("--up", choices=("y", "z"), default="y", help="up axis of such files")
    words.add_argument("--role", action="append", default=[], help="ROLE=BODY of the robot")
    words.add_argument("--format", choices=tuple(robot_formats.WRITTEN), default="mjlab.npz")
    words.add_argument("-o", "--output", type=Path, required=True, help="folder")
    given = words.parse_args()
    given.output.mkdir(parents=True, exist_ok=True)
    try:
        carrier = Carrier(given.robot, dict(role.partition("=")[::2] for role in given.role))
        for path in given.files:
            capture = motion_readers.read(path)
            unit, up = capture.metres_per_unit or given.unit, capture.up or given.up
            if not unit or unit <= 0.0:
                raise MotionFileError(str(path), "states no unit: give its length, m, as --unit")
            begin = time.perf_counter()
            clip = motion_file.to_clip(capture, metres_per_unit=unit, up=up)
            motion, errors = carrier.carried(clip, path.name)
            seconds = time.perf_counter() - begin
            target = given.output / f"{path.stem}.{given.format}"
            target.write_bytes(robot_formats.WRITTEN[given.format].write(motion, carrier.robot))
            facts = _facts(carrier.robot, motion, errors)
            print(json.dumps({"file": str(target), **facts, "seconds": seconds}), flush=True)
    except MotionError as fault:
        raise SystemExit(f"people_on_robot: {fault}") from None


if __name__ == "__main__":
    main()
