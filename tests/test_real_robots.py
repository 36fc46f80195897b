"""Tests of the doctor on reference motions of other programs."""

import json
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import document_pages
import numpy as np
import pytest
from serving import POSEFIELD

import posefield
from posefield.common.errors import InvalidField, ModelError, MotionFileError
from posefield.motion import quat
from posefield.reference.motion_plan import Evaluator, Plan, ReferenceModel
from posefield.registry import model_registry
from posefield.robots import robot_clip, robot_formats
from posefield.robots.file_conventions import Conventions
from posefield_train import training
from posefield_train.robots import doctor, robot_file
from posefield_train.source import ingest, recipe

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import robot_recipe
from robot_recipe import PERIOD

pytestmark = pytest.mark.system
TRACKER = Path(__file__).parents[1] / "examples/track_in_mujoco.py"

# Format by the folder of the file, and a part of its name; None for a file that is refused.
FORMATS = {
    "asap_pkl": "asap.pkl",
    "holosoma_npz": "holosoma.npz",
    "locomujoco_npz": "locomujoco.npz",
    "motion_visualization": "tienkung.txt",
    "deepmimic_txt": "amp.txt",
    "motion_amp_expert": None,
    "kimodo_npz": None,
}


@pytest.fixture(scope="module")
def files(real_data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("robots")
    for name in ("robot_files.zip", "robot_go_bdx.zip"):
        with zipfile.ZipFile(real_data / name) as packed:
            packed.extractall(folder)
    return folder


def test_files_of_other_programs_are_recognised_or_refused_with_the_way_out(files):
    motions = [
        path
        for path in sorted((files / "robot_files").rglob("*.*"))
        if path.suffix in robot_formats.SUFFIXES and "LICENSE" not in path.name
    ]
    assert len(motions) > 30
    stated = Conventions(rate=60.0, quaternions="xyzw")
    for path in motions:
        expected = next(name for part, name in FORMATS.items() if part in str(path))
        if expected:
            assert robot_formats.read(path, stated).format == expected
        else:
            with pytest.raises(MotionFileError, match="expected the"):
                robot_formats.read(path, stated)


def test_gaits_of_a_biped_stand_within_limits_and_an_altered_one_is_found(files):
    folder = files / "robot_go_bdx"
    robot = robot_file.read(folder / "go_bdx.xml")
    assert {robot.bodies[foot.body] for foot in robot.feet} == FEET
    gaits = sorted((folder / "gaits").glob("*.json"), key=lambda path: int(path.stem))
    motions = [robot_formats.read(path, Conventions(robot)) for path in gaits]
    kinds = {finding.kind for finding in doctor.diagnose(motions[1], robot).findings}
    assert kinds == {"seam"}
    sound = set(doctor.outliers(motions))
    assert len(sound) <= 2
    offset = np.radians(10.0) * (np.arange(16) == robot.hinges.index("left_knee"))
    motions[7] = replace(motions[7], angles=motions[7].angles + offset)
    # A joint that moves a quarter of a cycle late.
    late = motions[30].angles.copy()
    late[:, robot.hinges.index("right_hip_pitch")] = np.roll(late[:, 13], 25)
    motions[30] = replace(motions[30], angles=late)
    found = doctor.outliers(motions)
    assert found[7].where == "left_knee"
    assert found[30].where == "right_hip_pitch"
    assert len(set(found) - sound - {7, 30}) <= 1


FEET = {"left_foot_link", "right_foot_link"}


@pytest.fixture(scope="module")
def biped(files):
    """Return the recipe of the biped's gaits, the folder of its files, and its examples."""
    folder = files / "robot_go_bdx"
    family = recipe.read(robot_recipe.write(folder))
    return family, folder, ingest.ingest(family, folder)[0]


@pytest.fixture(scope="module")
def model(biped, tmp_path_factory):
    """Return the path of the biped's model."""
    family, _, examples = biped
    path = tmp_path_factory.mktemp("model") / "go_bdx.onnx"
    training.export(training.train_examples(family, examples), path)
    return path


QUANTITIES = {"forward": "forward_velocity", "left": "left_velocity", "turning": "turn_rate"}


@pytest.fixture(scope="module")
def measured(biped, tmp_path_factory):
    """Return the path of a model whose commands are the velocities of the biped's gaits."""
    folder = biped[1]
    controls = [
        f'[[controls]]\nname = "{name}"\nauto = {{ quantity = "{quantity}" }}\ndescription = "Mean"'
        for name, quantity in QUANTITIES.items()
    ]
    (folder / "measured.toml").write_text("\n".join([robot_recipe.RECIPE, *controls]))
    family = recipe.read(folder / "measured.toml")
    examples = ingest.ingest(family, folder)[0]
    # Commands of the files are not the velocities of their gaits.
    stated = np.array([example.controls for example in biped[2]])
    velocities = np.array([example.controls for example in examples])
    assert np.ptp(velocities[:, 0]) < 0.6 * np.ptp(stated[:, 0])
    path = tmp_path_factory.mktemp("measured") / "go_bdx.onnx"
    training.export(training.train_examples(family, examples), path)
    return path


KINDS = pytest.mark.parametrize("kind", ["model", "measured"])
"""Models of given and of measured commands."""


@KINDS
def test_clips_of_a_robot_stand_on_their_soles_within_limits(kind, request):
    """Mean skate of ten commands between the captured ones: 0.2 cm/s, and 1.3 as predicted."""
    opened = posefield.load(request.getfixturevalue(kind))
    card = opened.synthesizer.session.card
    assert {card.robot.bodies[point.body] for point in card.soles} == FEET
    commands, names = np.array(card.examples), [control.name for control in card.controls]
    rng = np.random.default_rng(0)
    skates = []
    for _ in range(10):
        mixed = rng.dirichlet(np.ones(4)) @ commands[rng.choice(len(commands), 4, replace=False)]
        command = dict(zip(names, mixed.tolist(), strict=True))
        clip = opened.clip(fps=137, **command)
        assert not doctor.diagnose(clip.robot_motion(), card.robot).findings
        if kind == "measured":
            assert list(clip.trust.measured.values()) == pytest.approx(list(command.values()))
        skates.append((clip.trust.feet.skate_before, clip.trust.feet.skate))
        loop = opened.clip(fps=50, loop=True, **command).robot_motion()
        np.testing.assert_allclose(loop.angles[0], loop.angles[-1], atol=1e-7)
    before, after = np.mean(skates, axis=0)
    assert before > 0.005
    assert after < 0.003
    with pytest.raises(InvalidField, match="robots stand as they were recorded"):
        opened.clip(floor=0.1)


def mixed_commands(card, count):
    """Return commands between captured ones, two captured ones and one far outside."""
    commands, rng = np.array(card.examples), np.random.default_rng(5)
    chosen = commands[rng.integers(0, len(commands), (count, 4))]
    mixed = np.einsum("ek,ekd->ed", rng.dirichlet(np.ones(4), count), chosen)
    return np.vstack([mixed, commands[:2], 1.4 * commands.max(axis=0)])


def test_soles_are_on_the_floor_all_over_the_captured_commands(model):
    """Turns on the spot among them are predicted with soles 4.5 mm below it."""
    evaluator, given = Evaluator(ReferenceModel(model)), ReferenceModel(model)
    axes = np.linspace(given.bounds.low, given.bounds.high, 5).T
    plan = evaluator.plan(np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3))
    for phase in np.arange(120) / 120:
        goal = evaluator.sample(plan, np.full(125, phase))
        poses = given.robot.body_poses(*goal[2:4], goal.joint_positions)
        assert min(foot[..., 2].min() for foot in given.robot.foot_points(*poses)) > -0.001


@KINDS
def test_the_evaluator_of_training_loops_gives_the_answers_of_the_service(kind, request):
    model = request.getfixturevalue(kind)
    opened, evaluator = posefield.load(model), Evaluator(ReferenceModel(model))
    card = opened.synthesizer.session.card
    commands, names = mixed_commands(card, 6), [control.name for control in card.controls]
    plan = evaluator.plan(commands)
    joints = list(robot_clip.of(card.robot).hinge_joints)
    steps = card.frames - 1
    for row, command in enumerate(commands.tolist()):
        question = dict(zip(names, command, strict=True))
        clip = opened.clip(fps=97, joint_sigma=True, extrapolate="ok", **question)
        motion, trust = clip.robot_motion(), clip.trust
        phase = np.arange(len(motion)) / 97 / trust.duration
        one = Plan(*(np.repeat(values[[row]], len(phase), axis=0) for values in plan))
        reference = evaluator.sample(one, np.minimum(phase, 1.0 - 1e-12))
        np.testing.assert_allclose(reference.joint_positions, motion.angles, atol=1e-5)
        np.testing.assert_allclose(reference.base_positions, motion.base_path, atol=1e-5)
        low, high = card.robot.ranges.T
        assert np.all(reference.joint_positions > low - 1e-6)
        assert np.all(reference.joint_positions < high + 1e-6)
        signs = np.sign(np.sum(reference.base_rotations * motion.base_rotations, axis=-1))
        rotations = signs[:, None] * reference.base_rotations
        np.testing.assert_allclose(rotations, motion.base_rotations, atol=1e-5)
        np.testing.assert_allclose(1.0 / reference.phase_rates, trust.duration, atol=1e-6)
        np.testing.assert_allclose(plan.sigmas[row], trust.sigma, atol=2e-6)
        sigmas = np.array(trust.joint_sigma)[joints]
        np.testing.assert_allclose(reference.sigmas[0], sigmas, atol=5e-6)
        assert plan.supported[row] == trust.supported
        # Negative control: feet as predicted differ.
        predicted = opened.clip(feet="as_predicted", fps=97, extrapolate="ok", **question)
        apart = reference.joint_positions - predicted.robot_motion().angles
        assert np.abs(apart).max() > 1e-3
    cycle = Plan(*(np.repeat(values[:1], steps, axis=0) for values in plan))
    frames = evaluator.sample(cycle, np.arange(steps) / steps)
    around = (np.roll(frames.joint_positions, s, axis=0) for s in (-1, 1))
    rates = np.subtract(*around) * steps / (2.0 * plan.durations[0])
    np.testing.assert_allclose(frames.joint_velocities, rates, atol=1e-4)
    assert set(np.round(frames.contacts, 5).ravel()) == {0.0, 1.0}
    with pytest.raises(ModelError, match="expected a model whose recipe has"):
        ReferenceModel(model_registry.file_or_shipped(Path("cmu_walk")))


def single_precision_inputs(model):
    """Return commands and phases that single precision holds exactly."""
    commands = mixed_commands(posefield.load(model).synthesizer.session.card, 5)
    phase = np.linspace(-0.3, 1.9, len(commands))
    return commands.astype("f4").astype(float), phase.astype("f4").astype(float)


def assert_agree(answer, expected):
    for name, values, right in zip(expected._fields, answer, expected, strict=True):
        speed = name.endswith(("velocities", "rates"))
        np.testing.assert_allclose(values, right, atol=2e-4 if speed else 1e-5, err_msg=name)


# JAX warns of each process that is forked beside it, so it has a process of its own.
IN_JAX = """
import sys
import numpy as np
import jax
from posefield.reference.jax import ReferenceMotion

motion, inputs = ReferenceMotion(sys.argv[1]), np.load(sys.argv[2])
commands, phase = inputs["commands"].astype("f4"), inputs["phase"].astype("f4")
plan = motion.plan(commands)
answer = motion.sample(plan, phase)
slopes = jax.jacfwd(lambda at: motion.sample(plan, at).joint_positions.sum(0))(phase)
np.savez(sys.argv[3], slopes=slopes, **answer._asdict())
"""


def test_jax_agrees_with_numpy_and_passes_gradients(model, tmp_path):
    evaluator, (commands, phase) = Evaluator(ReferenceModel(model)), single_precision_inputs(model)
    plan = evaluator.plan(commands)
    expected = evaluator.sample(plan, phase)
    np.savez(tmp_path / "inputs.npz", commands=commands, phase=phase)
    words = [sys.executable, "-W", "ignore", "-c", IN_JAX, model]
    files = [tmp_path / "inputs.npz", tmp_path / "answers.npz"]
    subprocess.run([*words, *files], check=True)
    answers = np.load(files[1])
    assert_agree([answers[name] for name in expected._fields], expected)
    # Angles are linear in the phase between frames.
    step = 1e-6
    ahead, back = (evaluator.sample(plan, phase + way).joint_positions for way in (step, -step))
    slopes = np.transpose(ahead - back) / (2.0 * step)
    np.testing.assert_allclose(answers["slopes"], slopes, rtol=1e-3, atol=1e-3)
    assert np.abs(slopes).max() > 1.0
    with pytest.raises(AssertionError):
        assert_agree(evaluator.sample(plan, phase + 1e-3), expected)


def test_torch_agrees_with_numpy_and_passes_gradients(model):
    """Needs torch, which is larger than all packages of the project together."""
    torch = pytest.importorskip("torch")
    from posefield.reference import torch as in_torch

    evaluator, (commands, phase) = Evaluator(ReferenceModel(model)), single_precision_inputs(model)
    torch_motion = in_torch.ReferenceMotion(model)
    moving = torch.tensor(commands, dtype=torch.float32)
    answer = torch_motion.sample(moving, torch.tensor(phase))
    expected = evaluator.sample(evaluator.plan(commands), phase)
    assert_agree(answer, expected)
    poses = torch_motion.body_poses(answer), evaluator.body_poses(expected)
    np.testing.assert_allclose(*poses, atol=1e-5)
    # Commands that change are planned again, and only they.
    changed = moving.flip(0)
    changed[0] = moving[0]
    again = torch_motion.sample(changed, torch.tensor(phase))
    assert_agree(again, evaluator.sample(evaluator.plan(changed.double().numpy()), phase))
    double = in_torch.ReferenceMotion(model, dtype=torch.float64)
    inputs = [torch.tensor(values[:3], requires_grad=True) for values in (commands, phase)]

    def outputs(*arguments):
        answer = double.sample(*arguments)
        return torch.cat([answer.joint_positions, answer.base_rotations, answer.sigmas], -1)

    assert torch.autograd.gradcheck(outputs, inputs, atol=1e-4)
    guide = (document_pages.DOCS / "guide/robots.md").read_text()
    loop, line = (b.text for b in document_pages.blocks(guide) if b.language == "py")
    names = {"joints": torch.zeros(4096, len(double.hinges))}
    exec(loop.replace("model.onnx", str(model)).replace("range(1000)", "range(2)"), names)
    assert names["reward"].shape == (4096,)
    exec(line, names)
    assert names["joints"].shape == (4096, len(double.hinges))


def test_gaits_left_out_are_predicted_better_than_a_lookup_does(biped):
    """With a tenth of the commands left out, twice: 0.64 degrees, where the nearest has 1.26."""
    family, folder, examples = biped
    made = robot_clip.of(robot_file.read(folder / "go_bdx.xml"))
    angles = np.array([made.motion(each.clip, "").angles[:PERIOD] for each in examples])
    commands = np.array([each.controls for each in examples])
    order = np.random.default_rng(0).permutation(len(examples))
    errors, lookups = [], []
    for left_out in (order[::10], order[1::10]):
        rest = np.setdiff1d(order, left_out)
        trained = training.train_examples(family, [examples[index] for index in rest])
        predicted = predicted_angles(trained, made, commands[left_out])
        errors.append(predicted - angles[left_out])
        scaled = commands / commands.std(axis=0)
        distances = np.linalg.norm(scaled[left_out, None] - scaled[rest], axis=-1)
        lookups.append(angles[rest][distances.argmin(axis=1)] - angles[left_out])
    error, lookup = (np.degrees(np.sqrt(np.mean(np.square(each)))) for each in (errors, lookups))
    assert error < 0.7
    assert lookup > 1.7 * error


def test_four_commands_lead_from_gaits_to_a_robot_that_tracks_them(biped, tmp_path):
    """0.6 degrees off, no torque cut off. Controls: no stiffness, and legs that are exchanged."""
    folder = biped[1]
    rows = (folder / "clips.csv").read_text().splitlines()
    (folder / "few.csv").write_text("\n".join(rows[:31]) + "\n")
    few = (folder / "recipe.toml").read_text().replace("clips.csv", "few.csv")
    (folder / "few.toml").write_text(few)
    gaits = [folder / "gaits" / f"{index}.json" for index in range(3)]
    robot, model = folder / "go_bdx.xml", tmp_path / "few.onnx"

    def output(*words):
        done = subprocess.run([*map(str, words)], check=True, capture_output=True, text=True)
        return done.stdout

    told = json.loads(output(POSEFIELD, "doctor", *gaits, "--robot", robot, "--json"))
    assert len(told["motions"]) == len(gaits)
    output(POSEFIELD, "train", folder / "few.toml", "-o", model)
    grid = ["--grid", "forward=0.1", "--grid", "left=0", "--grid", "turning=0.1", "--fps", 50]
    references = tmp_path / "references"
    output(POSEFIELD, "export", model, *grid, "--format", "mjlab.npz", "-o", references)
    motion = next(references.rglob("*.mjlab.npz"))
    track = [sys.executable, TRACKER, robot]
    tracked = json.loads(output(*track, motion))
    assert tracked["error_degrees"] < 1.0
    assert tracked["saturated_share"] == 0.0
    assert 0.2 < tracked["largest_torque_share"] < 0.8
    limp = json.loads(output(*track, motion, "--stiffness", 0))
    assert limp["error_degrees"] > 10.0
    numbers = dict(np.load(motion))
    exchanged = np.r_[11:16, 5:11, 0:5]
    numbers |= {name: numbers[name][:, exchanged] for name in ("joint_pos", "joint_vel")}
    np.savez(tmp_path / "exchanged.npz", **numbers)
    wrong = json.loads(output(*track, tmp_path / "exchanged.npz"))
    assert wrong["saturated_share"] > 0.01


def predicted_angles(trained, made, commands):
    """Return the hinges' angles of a model at commands, at the frames of a cycle."""
    labels = np.zeros((len(commands), 0))
    bank = trained.model.bank
    durations = np.exp(bank.numpy(bank.points(commands, labels))["duration"])
    times = durations * np.arange(PERIOD) / PERIOD
    rotations = trained.model.evaluate(commands, times, labels).rotations
    names = trained.skeleton.names
    joints = [names.index(made.skeleton.names[joint]) for joint in made.hinge_joints]
    turns = [quat.twist(rotations[:, :, j], a) for j, a in zip(joints, made.axes, strict=True)]
    return np.stack(turns, axis=-1)
