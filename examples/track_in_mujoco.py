"""Track a reference motion in MuJoCo, on the CPU, by PD at the joints.

    python examples/track_in_mujoco.py robot.xml walk.mjlab.npz

The robot hangs over a floor on a soft weld, which draws its base along the reference: what is
measured is whether its motors can do what the reference has its joints do. The softer the weld, the
more of the weight is on the feet. Torques are cut off at the limits of the file's actuators.
"""

import argparse
import json

import mujoco
import numpy as np

STIFFNESS = 30.0
"""Natural frequency of each joint's PD, rad/s, critically damped for the inertia at the joint."""
WELD = 0.02
"""Time in which the weld draws the base to the reference, s."""
TIMESTEP = 0.002


def hung(path: str, weld: float) -> mujoco.MjModel:
    """Return the robot on a floor, its base welded to a body that the reference moves."""
    spec = mujoco.MjSpec.from_file(path)
    spec.option.timestep = TIMESTEP
    base = spec.worldbody.first_body()
    if not any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in spec.joints):
        base.add_freejoint()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], condim=3)
    spec.worldbody.add_body(name="reference", mocap=True)
    at_once = np.zeros(mujoco.mjNEQDATA)
    at_once[[6, 10]] = 1.0
    spec.add_equality(
        type=mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        name1="reference",
        name2=base.name,
        data=at_once,
        solref=[weld, 1.0],
    )
    return spec.compile()


def torque_limits(model: mujoco.MjModel) -> np.ndarray:
    """Return the largest torque of each hinge, N m; infinite where the file has none."""
    limits = np.full(model.nv, np.inf)
    for joint in range(model.njnt):
        if model.jnt_actfrclimited[joint]:
            limits[model.jnt_dofadr[joint]] = model.jnt_actfrcrange[joint, 1]
    for motor in range(model.nu):
        address = model.jnt_dofadr[model.actuator_trnid[motor, 0]]
        largest = [np.inf]
        if model.actuator_forcelimited[motor]:
            largest.append(model.actuator_forcerange[motor, 1])
        # A motor's control is its torque, a servo's an angle.
        if model.actuator_ctrllimited[motor] and not model.actuator_biastype[motor]:
            largest.append(model.actuator_gainprm[motor, 0] * model.actuator_ctrlrange[motor, 1])
        gear = abs(model.actuator_gear[motor, 0])
        limits[address] = min(limits[address], gear * min(largest))
    return limits[6:]


def weight_on_feet(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """Return the share of the robot's weight that the floor carries."""
    force, total = np.zeros(6), 0.0
    for contact in range(data.ncon):
        mujoco.mj_contactForce(model, data, contact, force)
        total += force[0]
    return total / float(model.body_mass.sum() * -model.opt.gravity[2])


def track(
    robot: str, motion: str, stiffness: float = STIFFNESS, weld: float = WELD
) -> dict[str, float]:
    """Return how well the robot's joints follow the motion of an mjlab.npz file."""
    model, reference = hung(robot, weld), np.load(motion)
    angles, speeds = reference["joint_pos"], reference["joint_vel"]
    if angles.shape[1] != model.nv - 6:
        raise SystemExit(f"{motion}: {angles.shape[1]} joints, expected {model.nv - 6}")
    base, turns = reference["body_pos_w"][:, 0], reference["body_quat_w"][:, 0]
    rate = float(reference["fps"].item())
    seconds = np.arange(0.0, (len(angles) - 1) / rate, TIMESTEP)
    limits = torque_limits(model)
    # The PD below takes the place of the file's actuators.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    data = mujoco.MjData(model)
    data.qpos[:] = np.concatenate([base[0], turns[0], angles[0]])
    data.qvel[6:] = speeds[0]
    inertia = np.zeros((model.nv, model.nv))
    errors, strains, weights = [], [], []
    for frame, part in ((int(time), time % 1.0) for time in seconds * rate):
        goal, speed, place, turn = (
            (1.0 - part) * rows[frame] + part * rows[frame + 1]
            for rows in (angles, speeds, base, turns)
        )
        data.mocap_pos[0], data.mocap_quat[0] = place, turn / np.linalg.norm(turn)
        mujoco.mj_forward(model, data)
        errors.append(data.qpos[7:] - goal)
        mujoco.mj_fullM(model, data, inertia)
        pull = stiffness * (goal - data.qpos[7:]) + 2.0 * (speed - data.qvel[6:])
        torque = stiffness * inertia.diagonal()[6:] * pull
        strains.append(np.abs(torque) / limits)
        data.qfrc_applied[6:] = np.clip(torque, -limits, limits)
        mujoco.mj_step(model, data)
        weights.append(weight_on_feet(model, data))
    return {
        "error_degrees": float(np.degrees(np.sqrt(np.mean(np.square(errors))))),
        "largest_error_degrees": float(np.degrees(np.abs(errors).max())),
        "saturated_share": float(np.mean(np.array(strains) > 1.0)),
        "largest_torque_share": float(np.max(strains)),
        "weight_on_feet": float(np.mean(weights)),
    }


if __name__ == "__main__":
    words = argparse.ArgumentParser(description=__doc__)
    for name in ("robot", "motion"):
        words.add_argument(name)
    words.add_argument("--stiffness", type=float, default=STIFFNESS)
    words.add_argument("--weld", type=float, default=WELD)
    print(json.dumps(track(**vars(words.parse_args()))))
