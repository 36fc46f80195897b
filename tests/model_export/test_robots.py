"""Tests of robots and of the doctor of their reference motions."""

import json
import os
import pickle
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from asking import asker

import posefield
import posefield_train
from posefield.common.errors import InvalidField, MotionFileError
from posefield.encode.formats import ROBOT_ENCODERS
from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.inference import session
from posefield.model_file import card_check, checked_file
from posefield.motion import cycle_velocities, quat
from posefield.motion.clip import Clip
from posefield.reference.motion_plan import Evaluator, ReferenceModel
from posefield.registry import model_registry
from posefield.robots import robot_clip, robot_formats
from posefield.robots.file_conventions import Conventions
from posefield.robots.robot_motion import RobotMotion
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.report import robot_feasibility
from posefield_train.robots import doctor, robot_dynamics, robot_file
from posefield_train.source import ingest

# A biped whose left leg branches before its right, with a hinge beside its body's origin, a body
# with two hinges, and a neck behind both legs: its orders depth first and breadth first differ.
LEG = """<body name="{side}_hip" pos="0 {y} -0.1" quat="0.9 0.1 0 0">
  <joint name="{side}_hip_roll" axis="1 0 0" range="-0.6 0.6"/>
  <joint name="{side}_hip_pitch" axis="0 1 0" pos="0.02 0 0.01" range="-1.2 1.2"/>
  <geom type="sphere" size="0.03"/>
  <body name="{side}_shin" pos="0 0 -0.3">
    <joint name="{side}_knee" axis="0 1 0" range="-0.1 1.5"/><geom type="sphere" size="0.03"/>
    <body name="{side}_foot" pos="0 0 -0.3"><joint name="{side}_ankle" axis="0 1 0" range="-1 1"/>
      <geom type="box" size="0.08 0.04 0.02"/></body></body></body>"""
BIPED = f"""<mujoco><compiler angle="radian" autolimits="true"/><worldbody>
<geom type="plane" size="5 5 0.1"/><body name="pelvis" pos="0 0 0.72"><freejoint/>
<geom type="box" size="0.1 0.1 0.1"/>{LEG.format(side="left", y=0.1)}
{LEG.format(side="right", y=-0.1)}
<body name="neck" pos="0 0 0.2"><joint name="neck_yaw" axis="0 0 1"/>
<geom type="sphere" size="0.05"/></body></body></worldbody></mujoco>"""


@pytest.fixture
def command(posefield):
    """Function that runs `posefield` here; the package has the fixture's name."""
    return posefield


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("robot") / "biped.xml"
    path.write_text(BIPED)
    return path


@pytest.fixture(scope="module")
def robot(file):
    return robot_file.read(file)


def motion_of(robot, frames=60, seed=0, rate=50.0, turn=0.8):
    """A robot that turns and moves smoothly in the air."""
    times = np.arange(frames) / rate
    draws = np.random.default_rng(seed)
    middles = np.array([np.mean(np.clip(limits, -1, 1)) for limits in robot.ranges])
    sizes, phases = draws.uniform(0.05, 0.2, (2, len(robot.hinges)))
    angles = middles + sizes * np.sin(2 * np.pi * times[:, None] + 9 * phases)
    path = np.stack([0.5 * times, 0.1 * np.sin(times), 1.0 + 0.01 * np.sin(5 * times)], axis=-1)
    leaning = quat.from_axis_angle(np.array([0.0, 1.0, 0.0]), 0.1 + 0.02 * np.sin(times))
    heading = quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), turn * (1 + times))
    rotations = quat.mul(heading, leaning)
    return RobotMotion("made.csv", "qpos.csv", path, rotations, angles, rate, robot.hinges)


def save(path, motion, robot, name):
    target = path / f"motion{robot_formats.WRITTEN[name].suffix}"
    target.write_bytes(robot_formats.WRITTEN[name].write(motion, robot))
    return target


def test_bodies_are_where_mujoco_puts_them(file, robot):
    model = mujoco.MjModel.from_xml_path(str(file))
    state = mujoco.MjData(model)
    motion = motion_of(robot)
    positions, rotations = motion.body_poses(robot)
    for frame in range(0, len(motion), 7):
        state.qpos[:] = np.concatenate(
            [motion.base_path[frame], motion.base_rotations[frame], motion.angles[frame]]
        )
        mujoco.mj_kinematics(model, state)
        np.testing.assert_allclose(positions[frame], state.xpos[1:], atol=1e-12)
        alike = np.abs(np.einsum("bk,bk->b", rotations[frame], state.xquat[1:]))
        np.testing.assert_allclose(alike, 1.0, atol=1e-12)
    assert [robot.bodies[foot.body] for foot in robot.feet] == ["left_foot", "right_foot"]
    for foot in robot.feet:
        np.testing.assert_allclose(np.abs(foot.points), [[0.08, 0.04, 0.02]] * 8)
        assert len(np.unique(foot.points, axis=0)) == 8


@pytest.mark.parametrize("name", robot_formats.WRITTEN)
def test_a_format_is_recognised_and_gives_the_motion_back(name, robot, tmp_path):
    motion = motion_of(robot)
    # TienKung's and AMP's rows state no order of the quaternion: the robot stands in one alone.
    stated = Conventions(robot, rate=50.0 if name.endswith(".csv") else None)
    written = robot_formats.read(save(tmp_path, motion, robot, name), stated)
    assert written.format == name
    assert written.hinges == robot.hinges
    assert written.rate == pytest.approx(50.0)
    np.testing.assert_allclose(written.angles, motion.angles, atol=1e-6)
    np.testing.assert_allclose(written.base_path, motion.base_path, atol=1e-6)
    alike = np.abs(np.einsum("fk,fk->f", written.base_rotations, motion.base_rotations))
    np.testing.assert_allclose(alike, 1.0, atol=1e-9)


def test_a_trajectory_of_locomujoco_has_what_its_loader_needs(file, robot, tmp_path):
    """Its loader makes the joints' places of their types, which are MuJoCo's."""
    model = mujoco.MjModel.from_xml_path(str(file))
    with np.load(save(tmp_path, motion_of(robot), robot, "locomujoco.npz")) as fields:
        assert fields["njnt"] == model.njnt
        np.testing.assert_array_equal(fields["jnt_type"], model.jnt_type)
        assert fields["qpos"].shape[1] == model.nq
        assert fields["qvel"].shape[1] == model.nv


def test_a_capture_of_people_is_refused_with_the_way_out(robot, tmp_path):
    capture = tmp_path / "walk.bvh"
    capture.write_text("HIERARCHY")
    with pytest.raises(MotionFileError, match="carried onto a robot first: see 'People on a"):
        robot_formats.read(capture, Conventions(robot))


def test_an_order_of_joints_is_told_by_the_bodies_and_never_guessed(robot, tmp_path):
    breadth = save(tmp_path, motion_of(robot), robot, "beyondmimic.npz")
    told = robot_formats.read(breadth, Conventions(robot)).evidence["joints"]
    assert told.startswith("breadth first: its bodies lie within")
    stated = robot_formats.read(breadth, Conventions(robot, order="breadth"))
    np.testing.assert_allclose(stated.angles, motion_of(robot).angles, atol=1e-12)
    assert "unknown" in robot_formats.read(breadth, Conventions()).evidence["joints"]
    with np.load(breadth) as fields:
        shuffled = {**fields, "joint_pos": fields["joint_pos"][:, ::-1]}
    np.savez(breadth, **shuffled)
    with pytest.raises(MotionFileError, match="in neither order"):
        robot_formats.read(breadth, Conventions(robot))


def test_angles_in_degrees_are_read_as_such(robot, tmp_path):
    motion = motion_of(robot)
    degrees = replace(motion, angles=np.degrees(motion.angles))
    path = save(tmp_path, degrees, robot, "qpos.csv")
    read = robot_formats.read(path, Conventions(robot, rate=50.0, degrees=True))
    np.testing.assert_allclose(read.angles, motion.angles, atol=1e-7)


def test_quaternions_are_told_by_the_robot_that_stands_or_asked_for(robot, tmp_path):
    turning = save(tmp_path, motion_of(robot), robot, "unitree.csv")
    told = robot_formats.read(turning, Conventions(rate=50.0)).evidence["quaternions"]
    assert told.startswith("xyzw: upright in all frames")
    # Ahead, both readings are upright: one is the other turned by half a turn.
    ahead = replace(motion_of(robot), base_rotations=np.tile([1.0, 0.0, 0.0, 0.0], (60, 1)))
    straight = save(tmp_path, ahead, robot, "unitree.csv")
    with pytest.raises(MotionFileError, match="say --quaternions"):
        robot_formats.read(straight, Conventions(rate=50.0))
    stated = Conventions(rate=50.0, quaternions="xyzw")
    np.testing.assert_allclose(
        robot_formats.read(straight, stated).base_rotations, ahead.base_rotations, atol=1e-8
    )


def standing(robot, frames=100):
    """The robot on the floor, swaying its neck."""
    motion = motion_of(robot, frames)
    angles = np.zeros_like(motion.angles)
    angles[:, -1] = 0.3 * np.sin(np.arange(frames) / 10)
    upright = np.tile(quat.IDENTITY, (frames, 1))
    moved = replace(motion, base_path=np.zeros((frames, 3)), base_rotations=upright, angles=angles)
    return grounded(moved, robot)


def changed(motion, hinge, change):
    angles = motion.angles.copy()
    change(angles[:, motion.hinges.index(hinge)])
    return replace(motion, angles=angles)


def raised(motion, height, sway=0.0):
    path = motion.base_path + np.array([0.0, 0.0, height])
    path[:, 1] += sway * np.arange(len(path)) / motion.rate
    return replace(motion, base_path=path)


def bent(angles):
    angles[40:] -= 0.3


def hit(angles):
    angles[50] += 0.3


FAULTS = {
    "limit": (lambda motion: changed(motion, "left_knee", bent), "left_knee", 11.5),
    "jump": (lambda motion: changed(motion, "neck_yaw", hit), "neck_yaw", 34.0),
    "sunk": (lambda motion: raised(motion, -0.01), "left_foot", 1.0),
    "floating": (lambda motion: raised(motion, 0.03), "left_foot", 3.0),
    "skating": (lambda motion: raised(motion, 0.0, 0.1), "left_foot", 10.0),
    "seam": (
        lambda motion: replace(
            changed(motion, "neck_yaw", lambda angles: angles.sort()), loops=True
        ),
        "neck_yaw",
        34.0,
    ),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_a_planted_fault_is_told_with_its_joint_and_size(kind, robot):
    sound = standing(robot)
    assert not doctor.diagnose(sound, robot).findings
    plant, where, size = FAULTS[kind]
    findings = [each for each in doctor.diagnose(plant(sound), robot).findings if each.kind == kind]
    assert where in {finding.where for finding in findings}
    assert findings[0].value == pytest.approx(size, rel=0.05)


def test_a_motion_unlike_the_others_is_found_and_no_other(robot):
    motions = []
    for index in range(20):
        motion = motion_of(robot, 100)
        scale = 0.5 + 0.05 * index
        motions.append(replace(motion, angles=motion.angles * scale))
    assert not doctor.outliers(motions)
    motions[7] = changed(motions[7], "left_ankle", lambda angles: np.add(angles, 0.3, out=angles))
    assert {index: found.where for index, found in doctor.outliers(motions).items()} == {
        7: "left_ankle"
    }


class Hostile:
    def __reduce__(self):
        return os.mkdir, ("made-by-a-pickle",)


def test_a_pickle_runs_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "motion.pkl"
    path.write_bytes(pickle.dumps({"fps": 30, "root_pos": Hostile()}))
    with pytest.raises(MotionFileError, match="mkdir, expected NumPy arrays"):
        robot_formats.read(path, Conventions())
    assert not (tmp_path / "made-by-a-pickle").exists()
    path.write_bytes(b"no pickle")
    with pytest.raises(MotionFileError, match="is no pickle that can be read"):
        robot_formats.read(path, Conventions())


BAD_ROBOTS = {
    "'left_knee' is a slide joint": ('name="left_knee"', 'name="left_knee" type="slide"'),
    "'neck_yaw' is a ball joint": ('neck_yaw" axis="0 0 1"', 'neck_yaw" type="ball"'),
    "bodies that float: 'pelvis', 'box', expected the robot's": (
        "</worldbody>",
        '<body name="box"><freejoint/><geom size="0.1"/></body></worldbody>',
    ),
    "bodies that float: none": (BIPED, "<mujoco/>"),
    "does not begin with '<' as XML does": (BIPED, "solid robot"),
    "Error opening file 'gone.xml'": ("<worldbody>", '<include file="gone.xml"/><worldbody>'),
    "Error opening file .*gone.stl": (
        "<worldbody>",
        '<asset><mesh name="gone" file="gone.stl"/></asset><worldbody>',
    ),
}


@pytest.mark.parametrize("message", BAD_ROBOTS)
def test_a_robot_that_cannot_be_read_is_refused_with_the_reason(message, tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(BIPED.replace(*BAD_ROBOTS[message]))
    with pytest.raises(MotionFileError, match=message):
        robot_file.read(path)


def test_bodies_that_are_fixed_to_a_foot_are_one_foot_with_it(robot, tmp_path):
    box = '<geom type="box" size="0.08 0.04 0.02"/></body>'
    heel = '<body pos="{} 0 -0.02"><geom type="box" size="0.02 0.04 0.01"/></body>'
    path = tmp_path / "robot.xml"
    path.write_text(BIPED.replace(box, f"{heel.format(0.05)}{heel.format(-0.05)}</body>"))
    parts = robot_file.read(path)
    assert [parts.bodies[foot.body] for foot in parts.feet] == ["left_foot", "right_foot"]
    for foot in parts.feet:
        np.testing.assert_allclose(np.ptp(foot.points, axis=0), [0.14, 0.08, 0.02])
    assert len(repr(parts)) < 500 and len(repr(motion_of(robot))) < 500


def test_a_urdf_file_floats(tmp_path):
    path = tmp_path / "robot.urdf"
    mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    path.write_text(
        f'<robot name="one"><link name="base">{mass}</inertial></link><link name="arm">{mass}'
        '</inertial></link><joint name="elbow" type="revolute"><parent link="base"/>'
        '<child link="arm"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="2" effort="1" velocity="1"/></joint></robot>'
    )
    robot = robot_file.read(path)
    assert robot.bodies == ("base", "arm")
    assert robot.hinges == ("elbow",)
    np.testing.assert_allclose(robot.ranges, [[-1.0, 2.0]])


def test_the_command_tells_converts_and_draws(robot, file, tmp_path, command):
    sound = save(tmp_path, standing(robot), robot, "awd.json")
    output, drawn = tmp_path / "converted", tmp_path / "picture.png"
    words = ["doctor", sound, "--robot", file, "--to", "mjlab.npz", "-o", output]
    code, out, _ = command(*words, "--picture", drawn, "--json")
    (facts,) = json.loads(out)["motions"]
    assert (code, facts["format"], facts["frames"], facts["findings"]) == (0, "awd.json", 100, [])
    assert drawn.read_bytes().startswith(b"\x89PNG")
    mjlab = robot_formats.read(output / "motion.npz", Conventions(robot))
    np.testing.assert_allclose(mjlab.angles, standing(robot).angles, atol=1e-9)
    code, _, errors = command(*words)
    assert code and "exists already" in errors


def test_a_skeleton_moves_as_the_robot_and_gives_its_angles_back(robot):
    motion = motion_of(robot)
    made = robot_clip.of(robot)
    rotations, translations = made.joint_motion(motion)
    clip = Clip(made.skeleton, rotations, translations, motion.rate)
    positions, _ = motion.body_poses(robot)
    foot = made.skeleton.names.index("right_foot")
    # Y up, and +Z ahead: the axes of a robot's file, moved on by one.
    expected = positions[:, robot.bodies.index("right_foot")][:, [1, 2, 0]]
    np.testing.assert_allclose(clip.positions()[:, foot], expected, atol=1e-12)
    back = made.motion(clip, "clip")
    np.testing.assert_allclose(back.angles, motion.angles, atol=1e-12)
    np.testing.assert_allclose(back.base_path, motion.base_path, atol=1e-12)
    np.testing.assert_allclose(back.base_rotations, motion.base_rotations, atol=1e-12)


def test_means_of_hinges_are_hinges(robot):
    made = robot_clip.of(robot)
    chart = quat.CHARTS["stereographic"]
    first, second = (
        chart.numbers(quat.log(made.joint_motion(motion_of(robot, seed=seed))[0]))
        for seed in (0, 1)
    )
    mixed = chart.quaternions(0.3 * first + 0.7 * second)
    for hinge, joint in enumerate(made.hinge_joints):
        across = quat.cross(mixed[:, joint, 1:], made.axes[hinge])
        np.testing.assert_allclose(across, 0.0, atol=1e-12)


RECIPE = """schema = 1
name = "biped"
description = "Gaits of a biped"
licence = "CC0-1.0"
[robot]
model = "biped.xml"
[clips]
table = "clips.csv"
file = "file"
[[controls]]
name = "pace"
column = "pace"
unit = "m/s"
description = "Speed"
[motion]
frames = 24
cyclic = true
root = "travelling"
[alignment]
warp = "identity"
[size]
rms_budget_cm = 0.01
"""


def gait(robot, pace):
    """One cycle of 40 frames, the last of which is the first of the next, at a pace in m/s."""
    motion = motion_of(robot, 41, rate=40.0, turn=0.0)
    cycle = np.sin(2 * np.pi * np.arange(41) / 40)[:, None]
    angles = motion.angles.mean(axis=0) + 0.4 * pace * cycle * np.linspace(0.5, 1.0, 9)
    path = np.stack([pace * np.arange(41) / 40, np.zeros(41), np.full(41, 0.7)], axis=-1)
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (41, 1))
    return replace(motion, angles=angles, base_path=path, base_rotations=upright)


def trained(folder, robot, recipe, table, motions):
    """Write gaits, their table and their recipe into a folder, with the model of them."""
    for index, motion in enumerate(motions):
        save(folder, motion, robot, "awd.json").rename(folder / f"{index}.json")
    for name, text in (("clips.csv", table), ("biped.xml", BIPED), ("recipe.toml", recipe)):
        (folder / name).write_text(text)
    read = posefield_train.read_recipe(folder / "recipe.toml")
    posefield_train.export(posefield_train.train(read, folder), folder / "biped.onnx")
    return folder


@pytest.fixture(scope="module")
def family(robot, tmp_path_factory):
    """Folder of a recipe with gaits at eight paces, and the model of it."""
    paces = np.linspace(0.2, 0.9, 8)
    table = "".join(
        ["file,pace\n", *(f"{index}.json,{pace}\n" for index, pace in enumerate(paces))]
    )
    gaits = [gait(robot, pace) for pace in paces]
    return trained(tmp_path_factory.mktemp("biped"), robot, RECIPE, table, gaits)


def test_the_guides_recipe_reads_gaits_without_doubt_of_their_unit(family, file, tmp_path):
    guide = Path(__file__).parents[2] / "docs/guide/robots.md"
    recipe = re.search(r"```toml\n(schema = 1.*?)```", guide.read_text(), re.S)[1]
    for number in range(8):
        (tmp_path / f"{number}.json").write_bytes((family / f"{number}.json").read_bytes())
    (tmp_path / "recipe.toml").write_text(recipe)
    (tmp_path / "robot.xml").write_text(file.read_text())
    rows = [f"{number}.json,{number},0,0,40" for number in range(8)]
    (tmp_path / "clips.csv").write_text(
        "\n".join(["file,vx,yaw,first_frame,last_frame", *rows]) + "\n"
    )
    recipe = posefield_train.read_recipe(tmp_path / "recipe.toml")
    examples, notes = ingest.ingest(recipe, tmp_path)
    assert len(examples) == 8
    assert not any("metres_per_unit" in note or "motion.frames" in note for note in notes)


def test_frames_that_a_model_of_a_robot_does_not_have_are_told(family):
    _, notes = ingest.ingest(posefield_train.read_recipe(family / "recipe.toml"), family)
    assert any("motion.frames is 24, and clips have up to 41 frames" in note for note in notes)


def test_a_model_of_a_robot_answers_with_its_angles_between_the_commands(family, robot):
    model = posefield.load(family / "biped.onnx")
    motion = model.clip(pace=0.45, fps=40.0).robot_motion()
    # Between two commands, to which neither lies nearer than 0.05 m/s: 1.1 degrees off.
    expected = gait(robot, 0.45).angles[:40]
    assert np.degrees(np.abs(motion.angles[:40] - expected).max()) < 0.2
    nearest = np.degrees(np.abs(gait(robot, 0.4).angles[:40] - expected).max())
    assert nearest > 1.0
    assert motion.base_path[39, 0] == pytest.approx(0.45 * 39 / 40, abs=1e-3)


MEASURED = """
[[controls]]
name = "{name}"
auto = {{ quantity = "{quantity}" }}
description = "Measured"
"""


@pytest.fixture(scope="module")
def measured(robot, tmp_path_factory):
    """Model of gaits on arcs, whose commands are measured ahead and of the heading."""
    motions, upright = [], np.array([0.0, 0.0, 1.0])
    for index, pace in enumerate(np.linspace(0.2, 0.9, 12)):
        # Not as an arithmetic sequence, which measured velocities would follow.
        headings = 0.5 * np.cos(2.3 * index) * np.arange(41) / 40
        radius = pace / max(abs(headings[-1]), 1e-6) * np.sign(headings[-1])
        arc = [radius * np.sin(headings), radius * (1.0 - np.cos(headings)), np.full(41, 0.7)]
        turned = quat.from_axis_angle(upright, headings)
        path = np.stack(arc, axis=-1)
        motions.append(replace(gait(robot, pace), base_path=path, base_rotations=turned))
    table = "".join(["file\n", *(f"{index}.json\n" for index in range(12))])
    begin, _, rest = RECIPE.partition("[[controls]]")
    rest = rest[rest.index("[motion]") :]
    pairs = (("ahead", "forward_velocity"), ("turning", "turn_rate"))
    controls = "".join(MEASURED.format(name=name, quantity=what) for name, what in pairs)
    folder = tmp_path_factory.mktemp("measured")
    return trained(folder, robot, begin + controls + rest, table, motions) / "biped.onnx"


def test_commands_that_are_measured_are_met_exactly(measured, robot):
    model = posefield.load(measured)
    evaluator = Evaluator(ReferenceModel(measured))
    commands = np.array([[0.31, 0.2], [0.55, -0.33], [0.7, 0.0]])
    plan = evaluator.plan(commands)
    goal = evaluator.sample(plan, np.array([0.2, -0.4, 1.7]))
    positions, turns = robot.body_poses(*goal[2:4], goal.joint_positions)
    expected = np.concatenate([quat.to_matrix(turns), positions[..., None]], axis=-1)
    np.testing.assert_allclose(evaluator.body_poses(goal), expected, atol=1e-6)
    ways = plan.travels[:, [1, 0, 2]]
    planned = cycle_velocities.of_travels(np, ways, plan.durations)
    np.testing.assert_allclose(planned[:, 1:], commands, atol=1e-12)
    beside = []
    for command, way, duration in zip(commands, ways, plan.durations, strict=True):
        question = {"ahead": command[0], "turning": command[1], "fps": 40.0, "loop": True}
        clip, predicted = (model.clip(**question, exact=exact) for exact in ("auto", "none"))
        np.testing.assert_allclose(clip.trust.duration, duration, atol=1e-6)
        np.testing.assert_allclose(travel(clip), way, atol=1e-6)
        np.testing.assert_allclose(velocities(clip)[1:], command, atol=1e-9)
        assert list(clip.trust.measured.values()) == pytest.approx(command)
        assert all(target.reached for target in clip.trust.targets)
        beside.append(np.abs(velocities(predicted)[1:] - command).max())
    assert max(beside) > 1e-5, "negative control: the prediction travels otherwise"


def travel(clip):
    """Way to the left and ahead, m, and turn, rad, of a loop."""
    motion = clip.robot_motion()
    gone = motion.base_path[-1] - motion.base_path[0]
    turned = quat.mul(motion.base_rotations[-1], quat.conj(motion.base_rotations[0]))
    return np.array([gone[1], gone[0], quat.twist(turned, np.array([0.0, 0.0, 1.0]))])


def velocities(clip):
    return cycle_velocities.of_travels(np, travel(clip), np.float64(clip.trust.duration))


def numbers(robot, content, name, folder):
    """The motion in the bytes of a file that a service or an archive sent."""
    path = folder / f"sent{robot_formats.WRITTEN[name].suffix}"
    path.write_bytes(content)
    order = "wxyz" if name == "qpos.csv" else "xyzw"
    return robot_formats.read(path, Conventions(robot, rate=40.0, quaternions=order))


@pytest.fixture(scope="module")
def service(family):
    """Function that asks a service with the robot's model."""
    registry = model_registry.load([family / "biped.onnx"])
    return asker(create_app(registry, Settings()))


@pytest.mark.parametrize("ending", robot_formats.WRITTEN)
def test_each_reference_motion_is_given_at_its_ending(ending, service, family, robot, command):
    sent = service("GET", f"/v1/models/biped/clip.{ending}?pace=0.45&fps=40")
    assert sent.status_code == 200, sent.text
    assert sent.headers["content-type"].partition(";")[0] == ROBOT_ENCODERS[ending].media_type
    assert sent.headers["content-disposition"].endswith(f'"biped.{ending}"')
    motion = numbers(robot, sent.content, ending, family)
    assert motion.format == ending
    expected = posefield.load(family / "biped.onnx").clip(pace=0.45, fps=40.0)
    np.testing.assert_allclose(motion.angles, expected.robot_motion().angles, atol=1e-6)
    body = {"controls": {"pace": 0.45}, "fps": 40}
    assert service("POST", f"/v1/models/biped/clip.{ending}", json=body).content == sent.content
    files = family / f"saved.{ending}", family / f"answer.{ending}"
    expected.save(files[0])
    command("clip", family / "biped.onnx", "-c", "pace=0.45", "--fps", "40", "-o", files[1])
    assert [file.read_bytes() for file in files] == [sent.content] * 2


REFUSED = {
    "stroll/clip.mjlab.npz?speed=1&turn=0": "this is a motion of none",
    "biped/clip.mjlab.npz?pace=0.45&up=y": "expected 'z'",
    "biped/clip.mjlab.npz?pace=0.45&body=bones": "carry no body",
    "biped/clip.mjlab.npy?pace=0.45": "mjlab.npz",
    "biped/clip.mjlab.npz?pace=0.45&end=0": "1 frame, expected two or more",
}


@pytest.mark.parametrize("path", REFUSED)
def test_a_service_says_why_it_gives_no_reference_motion(path, family, walk_path):
    registry = model_registry.load([family / "biped.onnx", walk_path])
    sent = asker(create_app(registry, Settings()))("GET", f"/v1/models/{path}")
    assert sent.status_code in (404, 422)
    assert sent.headers["content-type"] == "application/problem+json"
    assert REFUSED[path] in sent.text


@pytest.fixture(scope="module")
def limited(family, robot):
    """Model whose left knee may turn half as far as the fastest gait turns it."""
    card = checked_file.load_card((family / "biped.onnx").read_bytes(), "biped.onnx")
    ranges = card.robot.ranges.copy()
    knee = robot.hinges.index("left_knee")
    reach = np.ptp(gait(robot, 0.9).angles[:, knee])
    ranges[knee] = gait(robot, 0.9).angles[:, knee].mean() + np.array([-0.25, 0.25]) * reach
    opened = session.open_bytes((family / "biped.onnx").read_bytes(), "biped@0")
    narrow = replace(card, robot=replace(card.robot, ranges=ranges))
    return posefield.Model(Synthesizer("biped", replace(opened, card=narrow)))


def test_limits_that_a_command_breaks_are_told_or_refused(limited, robot):
    slow, fast = (limited.clip(pace=pace, fps=40.0).trust for pace in (0.25, 0.85))
    assert slow.limits == ()
    (broken,) = fast.limits
    assert broken.joint == "left_knee"
    assert broken.sentence in fast.warnings
    angles = gait(robot, 0.85).angles[:, robot.hinges.index("left_knee")]
    swing = abs(broken.angle - angles.mean())
    assert swing == pytest.approx(np.abs(angles - angles.mean()).max(), abs=np.radians(0.2))
    assert limited.clip(pace=0.25, limits="refuse").trust.limits == ()
    with pytest.raises(InvalidField, match="left_knee turns to"):
        limited.clip(pace=0.85, limits="refuse")


def test_feasibility_tells_the_commands_that_break_a_limit(limited, family, robot, command):
    dynamics = robot_dynamics.Dynamics(family / "biped.xml")
    dynamics.robot = limited.synthesizer.session.card.robot
    rows = robot_feasibility.measure(limited, dynamics, 5).rows
    assert ["limit_rad" in row["broken"] for row in rows] == [False, False, True, True, True]
    assert {row["where"] for row in rows[2:]} == {"left_knee"}
    page = family / "feasibility.html"
    words = ["feasibility", family / "biped.onnx", "--robot", family / "biped.xml", "-o", page]
    assert command(*words, "--per-control", "3")[0] == 0
    figures = json.loads(page.with_suffix(".json").read_bytes())
    assert [row["limit_rad"] for row in figures["commands"]] == [0.0, 0.0, 0.0]
    assert max(row["seam_rad"] for row in figures["commands"]) < 1e-9
    assert page.read_text().count("<img") == len(robot_feasibility.QUANTITIES)
    words[3] = family / "other.xml"
    words[3].write_text(BIPED.replace("neck_yaw", "neck_pan"))
    assert "expected its 9; unlike: neck_pan, neck_yaw" in " ".join(command(*words)[2].split())
    errors = command("train", family / "0.json", "-o", family / "none.onnx")[2]
    assert "found a .json file, expected a recipe, .toml" in " ".join(errors.split())


HOPPER = """<mujoco><compiler angle="radian"/><worldbody><body name="trunk" pos="0 0 0.54">
<freejoint/><geom type="box" size="0.1 0.05 0.05" pos="0.04 0 0.1" mass="3"/>
<body name="shin"><joint name="hip" axis="0 1 0"/>
<geom type="box" size="0.02 0.02 0.2" pos="0 0 -0.25" mass="1"/>
<body name="foot" pos="0 0 -0.5"><joint name="ankle" axis="0 1 0"/>
<geom type="box" size="0.15 0.05 0.02" pos="0 0 -0.02" mass="0.5"/></body></body></body></worldbody>
<actuator><motor joint="hip" ctrlrange="-2 2" ctrllimited="true" gear="5"/></actuator></mujoco>"""
GRAVITY = 9.81


@pytest.fixture(scope="module")
def hopper(tmp_path_factory):
    path = tmp_path_factory.mktemp("hopper") / "hopper.xml"
    path.write_text(HOPPER)
    return robot_dynamics.Dynamics(path)


def hops(accelerated=0.0, angle=0.3, frames=5, rate=50.0):
    """The hopper upright on its level foot, with a constant acceleration ahead, m/s²."""
    times = np.arange(frames) / rate
    height = 0.04 + 0.5 * np.cos(angle)
    ahead = 0.5 * accelerated * times**2
    path = np.stack([ahead, 0 * times, np.full(frames, height)], axis=-1)
    angles = np.tile([angle, -angle], (frames, 1))
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
    return RobotMotion("", "qpos.csv", path, upright, angles, rate, ("hip", "ankle"))


def test_torques_of_a_standing_robot_carry_what_lies_above_each_hinge(hopper):
    motion = hops()
    loads = hopper.loads(motion, np.ones((5, 1), bool))
    # Moments of weight about the axis y: trunk about the hip, trunk and shin about the ankle.
    hip = motion.base_path[2]
    ankle = hip - 0.5 * np.array([np.sin(0.3), 0, np.cos(0.3)])
    shin = 0.5 * (hip + ankle)
    of_trunk = 3 * GRAVITY * 0.04
    of_leg = 3 * GRAVITY * (hip[0] + 0.04 - ankle[0]) + GRAVITY * (shin[0] - ankle[0])
    np.testing.assert_allclose(loads.torques[2], [of_trunk, of_leg], rtol=2e-3)
    np.testing.assert_allclose(loads.shares[2, 0], of_trunk / 10.0, rtol=2e-3)
    assert loads.lacking.max() < 1e-3
    # In the air nothing is carried: the whole weight lacks, and the shin hangs from the hip.
    flying = hopper.loads(motion, np.zeros((5, 1), bool))
    assert flying.lacking == pytest.approx(1.0)
    assert np.isnan(flying.zero_moment).all()


@pytest.mark.parametrize("accelerated", [0.0, 1.5, -4.0])
def test_the_zero_moment_point_lies_below_the_mass_less_its_acceleration(accelerated, hopper):
    motion = hops(accelerated)
    loads = hopper.loads(motion, np.ones((5, 1), bool))
    path = motion.base_path[2]
    ankle = path - 0.5 * np.array([np.sin(0.3), 0, np.cos(0.3)])
    trunk, foot = path + np.array([0.04, 0, 0.1]), ankle - np.array([0, 0, 0.02])
    parts = ((3.0, trunk), (1.0, 0.5 * (path + ankle)), (0.5, foot))
    mass = sum(weight * middle for weight, middle in parts) / 4.5
    point = mass[0] - mass[2] * accelerated / GRAVITY
    expected = max(abs(point - ankle[0]) - 0.15, -0.05)
    assert loads.zero_moment[2] == pytest.approx(expected, abs=2e-3)
    assert (loads.lacking[2] < 0.01) == (expected < 0)


def test_commands_are_swept_into_a_folder_of_reference_motions(family, robot, tmp_path, command):
    words = ["export", family / "biped.onnx", "--grid", "pace=0.3:1.5:5", "--fps", "40"]
    assert command(*words, "--format", "mjlab.npz", "-o", tmp_path / "sweep")[0] == 0
    lines = (tmp_path / "sweep/manifest.jsonl").read_text().splitlines()
    entries = [json.loads(line) for line in lines]
    assert [entry["controls"]["pace"] for entry in entries] == pytest.approx(
        [0.3, 0.6, 0.9, 1.2, 1.5]
    )
    assert [entry["supported"] for entry in entries] == [True, True, True, False, False]
    for entry in entries[:3]:
        content = (tmp_path / "sweep" / entry["file"]).read_bytes()
        angles = numbers(robot, content, "mjlab.npz", tmp_path).angles
        expected = gait(robot, entry["controls"]["pace"]).angles
        np.testing.assert_allclose(np.degrees(angles[:40]), np.degrees(expected[:40]), atol=0.3)


def grounded(motion, robot):
    """The motion with its lowest sole on the floor."""
    soles = robot.foot_points(*motion.body_poses(robot))
    return raised(motion, -min(float(points[..., 2].min()) for points in soles))


def without(name):
    return lambda fields: {key: value for key, value in fields.items() if key != name}


def edited(path, edit):
    """Write the fields of an NPZ, JSON or PKL file anew."""
    if path.suffix == ".npz":
        with np.load(path) as fields:
            np.savez(path, **edit({**fields}))
    elif path.suffix == ".json":
        path.write_text(json.dumps(edit(json.loads(path.read_text()))))
    else:
        path.write_bytes(pickle.dumps(edit(pickle.loads(path.read_bytes()))))


Y_UP = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(-np.pi / 2))
# Format, change of the motion, and the words of the refusal.
BAD_MOTIONS = {
    "Y up": (
        "awd.json",
        lambda motion: replace(
            motion,
            base_path=quat.rotate(Y_UP, motion.base_path),
            base_rotations=quat.mul(Y_UP, motion.base_rotations),
        ),
        "if the file has Y up: expected metres with Z up",
    ),
    "swapped": (
        "gmr.pkl",
        lambda motion: replace(
            motion,
            base_path=motion.base_path[:, [1, 2, 0]],
            base_rotations=motion.base_rotations[:, [0, 2, 3, 1]],
        ),
        "if the file has Y up and swapped axes",
    ),
    "centimetres": (
        "awd.json",
        lambda motion: replace(motion, base_path=100.0 * motion.base_path),
        "expected metres with Z up",
    ),
    "degrees": (
        "awd.json",
        lambda motion: replace(motion, angles=np.degrees(motion.angles)),
        "if they are degrees",
    ),
}
ODD_NUMBER = np.outer(np.arange(41) == 5, np.arange(9) == 2)
# Format, change of the file's fields, and the words of the refusal.
BAD_FIELDS = {
    "no rate": ("mjlab.npz", without("fps"), "states no frame rate: say --rate"),
    "layout": ("awd.json", without("Frame_size"), "Frame_size hold no object each"),
    "one frame": (
        "gmr.pkl",
        lambda fields: {
            name: each[:1] if np.ndim(each) > 1 else each for name, each in fields.items()
        },
        "found 1 frame, expected two or more",
    ),
    "no number": (
        "gmr.pkl",
        lambda fields: fields | {"dof_pos": fields["dof_pos"] + np.where(ODD_NUMBER, np.nan, 0.0)},
        "joint angle 3 of frame 5 is nan",
    ),
    "norm": (
        "gmr.pkl",
        lambda fields: fields | {"root_rot": fields["root_rot"] * (1.0 + 0.1 * ODD_NUMBER[:, 2:3])},
        "quaternion of frame 5 has norm 1.1",
    ),
    "two rates": (
        "awd.json",
        lambda fields: fields | {"FrameDuration": 0.01},
        "states 40 FPS and a FrameDuration of 0.01 s: say --rate",
    ),
    "other robot": (
        "gmr.pkl",
        lambda fields: fields | {"dof_pos": fields["dof_pos"][:, :-2]},
        "found 7 joint angles a frame, expected the 9",
    ),
    "other joint": (
        "isaaclab.npz",
        lambda fields: fields | {"dof_names": [*fields["dof_names"][:-1], "neck_jaw"]},
        "'neck_jaw' is none of biped.xml (did you mean",
    ),
}


@pytest.mark.parametrize("fault", [*BAD_MOTIONS, *BAD_FIELDS])
def test_a_bad_motion_is_refused_by_all_commands_with_one_sentence(
    fault, robot, file, tmp_path, command
):
    form, change, message = (BAD_MOTIONS | BAD_FIELDS)[fault]
    motion = grounded(gait(robot, 0.5), robot)
    sound = save(tmp_path, motion, robot, form)
    path = sound.rename(tmp_path / f"bad{sound.suffix}")
    save(tmp_path, motion, robot, form)
    if fault in BAD_MOTIONS:
        path.write_bytes(robot_formats.WRITTEN[form].write(change(motion), robot))
    else:
        edited(path, change)
    (tmp_path / "clips.csv").write_text(f"file,pace\n{sound.name},0.4\n{path.name},0.5\n")
    (tmp_path / "biped.xml").write_text(BIPED)
    (tmp_path / "recipe.toml").write_text(RECIPE)
    told = ["doctor", sound, path, "--robot", file]
    converted, model = tmp_path / "converted", tmp_path / "model.onnx"
    for words in (
        told,
        [*told, "--to", "mimickit.pkl", "-o", converted],
        ["train", tmp_path / "recipe.toml", "-o", model],
    ):
        code, _, errors = command(*words)
        sentence = " ".join(errors.split())
        assert code and path.name in sentence
        assert message in sentence
    assert not converted.exists() and not model.exists()


def test_a_clip_that_is_no_cycle_is_refused_by_a_recipe_of_cycles(family, robot, command, tmp_path):
    drift = np.linspace(0.0, 0.6, 41)
    open_gait = changed(
        gait(robot, 0.5), "left_knee", lambda angles: np.add(angles, drift, out=angles)
    )
    for name in ("biped.xml", "0.json", "recipe.toml"):
        (tmp_path / name).write_bytes((family / name).read_bytes())
    save(tmp_path, open_gait, robot, "awd.json").rename(tmp_path / "open.json")
    (tmp_path / "clips.csv").write_text("file,pace\n0.json,0.2\nopen.json,0.5\n")
    code, _, errors = command("train", tmp_path / "recipe.toml", "-o", tmp_path / "model.onnx")
    sentence = " ".join(errors.split())
    assert code and "open.json: joint 'left_shin' turns by 34.4 degrees from the last" in sentence


def test_files_that_cannot_be_read_and_other_robots_are_told_beside_the_others(
    robot, file, tmp_path, command
):
    sound = save(tmp_path, motion_of(robot), robot, "gmr.pkl").rename(tmp_path / "one.pkl")
    other = save(tmp_path, motion_of(robot), robot, "gmr.pkl")
    edited(other, lambda fields: fields | {"dof_pos": fields["dof_pos"][:, :-2]})
    broken = tmp_path / "broken.csv"
    broken.write_text("1,2,three\n")
    code, out, errors = command("doctor", sound, other, broken)
    assert code == 1 and "1 motion, 0 with faults" in out
    assert "found 7 joints, expected the 9 of" in " ".join(errors.split())
    assert "line 1: found '1,2,three', expected numbers" in " ".join(errors.split())
    bent_knee = save(tmp_path, changed(standing(robot), "left_knee", bent), robot, "awd.json")
    assert "limit 1" in command("doctor", bent_knee, "--robot", file)[1].splitlines()[-1]


def test_a_clip_of_no_robot_is_no_reference_motion(walk_path, tmp_path, command):
    output = tmp_path / "walk.mjlab.npz"
    grid = ["--grid", "speed=1:1.2:2", "--grid", "turn=0", "--format", "mjlab.npz"]
    for words in (["clip", walk_path], ["export", walk_path, *grid]):
        code, _, errors = command(*words, "-o", output)
        assert code and "this is a motion of none" in errors
        assert not output.exists()


BAD_CARDS = {
    "parents": lambda robot: {"parents": (*robot.parents[:-1], 40)},
    "axes": lambda robot: {"axes": 2.0 * robot.axes},
    "parents is": lambda robot: {"parents": (-1, 2, 1, *robot.parents[3:])},
    "hinge_bodies": lambda robot: {"hinge_bodies": (0, *robot.hinge_bodies[1:])},
    "the joints of the skeleton": lambda robot: {"bodies": ("hips", *robot.bodies[1:])},
}


@pytest.mark.parametrize("message", BAD_CARDS)
def test_a_card_with_a_broken_robot_is_refused(message, family):
    card = checked_file.load_card((family / "biped.onnx").read_bytes(), "biped.onnx")
    broken = replace(card, robot=replace(card.robot, **BAD_CARDS[message](card.robot)))
    with pytest.raises(ValueError, match=message):
        card_check.check(broken)
