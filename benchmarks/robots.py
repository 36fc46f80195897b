"""Gaits of a robot by command: posefield against the interpolations that people write themselves.

    python benchmarks/robots.py build/data/robot_go_bdx --record

All methods have the same commands and the same cycles: joint angles by phase, and the velocities of
a cycle. Commands are those of the files, which are no velocities of the gaits, and then these
velocities. Each tenth of the gaits is left out in turn; then all but the 27 gaits nearest to the
nodes of a grid of 3 × 3 × 3 commands. Standing feet, limits and the evaluator of training loops are
measured on the model of all gaits. The gaits are NVIDIA's, for other than commercial use: not
shipped. Steps of training loops are measured where torch is installed.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import robot_recipe
from numpy.typing import NDArray
from robot_recipe import COMMANDS, PERIOD, RATE
from rows import Row, compact, record, table
from scipy.interpolate import RBFInterpolator, RegularGridInterpolator
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

import posefield
import posefield_train
from posefield.motion import cycle_velocities, quat
from posefield.reference.motion_plan import Evaluator, ReferenceModel
from posefield.robots import robot_clip
from posefield.robots.robot import Robot
from posefield.robots.robot_motion import RobotMotion
from posefield_train import training
from posefield_train.robots import robot_file
from posefield_train.source import ingest, recipe
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

Numbers = NDArray[np.float64]
QUANTITIES = ("forward_velocity", "left_velocity", "turn_rate")
"""Measures of the commands."""
KINDS = ("given", "measured")
"""Kinds of commands: of the files, or measured of the gaits."""
BETWEEN = 40
"""Commands between captured ones at which the model of all gaits is measured."""
FOLDS, NODES, DEGREE = 10, 3, 15
"""Parts that are left out in turn, nodes of the grid along each command, and the degree of the
polynomials in time with which tables of gaits are stored."""
RESULTS = Path(__file__).parents[1] / "docs/results"


@dataclass(frozen=True)
class Gaits:
    """Cycles of a robot, closed as training closes them. commands (N, 3). motions: of examples."""

    robot: Robot
    family: Recipe
    examples: list[Example]
    commands: Numbers
    motions: list[RobotMotion]

    @property
    def cycles(self) -> Numbers:
        """Return what methods interpolate (N, PERIOD * H + 3): angles, rad, and travel."""
        angles = np.array([motion.angles[:PERIOD].ravel() for motion in self.motions])
        return np.hstack([angles, np.array([travel(motion) for motion in self.motions])])


def read(folder: Path, work: Path, kind: str = "given") -> Gaits:
    """Return the gaits of a folder with a robot and JSON files; work: empty folder.

    kind: of the commands, in KINDS.
    """
    for entry in ("go_bdx.xml", "gaits", "meshes"):
        (work / entry).symlink_to((folder / entry).absolute())
    path = robot_recipe.write(work)
    if kind == "measured":
        controls = [
            f'[[controls]]\nname = "{name}"\nauto = {{ quantity = "{quantity}" }}\n'
            'description = "Command"'
            for name, quantity in zip(COMMANDS, QUANTITIES, strict=True)
        ]
        path.write_text("\n".join([robot_recipe.RECIPE, *controls]))
    family = recipe.read(path)
    examples, _ = ingest.ingest(family, work)
    robot = robot_file.read(work / "go_bdx.xml")
    body = robot_clip.of(robot)
    motions = [body.motion(example.clip, "gait") for example in examples]
    commands = np.array([example.controls for example in examples])
    return Gaits(robot, family, list(examples), commands, motions)


def travel(motion: RobotMotion, duration: float | None = None) -> Numbers:
    """Return the velocities ahead and to the left, m/s, and of the heading, rad/s, of a cycle.

    duration: s; default: that of its frames.
    """
    way = motion.base_path[-1] - motion.base_path[0]
    turned = quat.mul(motion.base_rotations[-1], quat.conj(motion.base_rotations[0]))
    gone = np.array([way[1], way[0], quat.twist(turned, np.array([0.0, 0.0, 1.0]))])
    seconds = np.float64(motion.duration if duration is None else duration)
    return np.asarray(cycle_velocities.of_travels(np, gone, seconds)[[1, 0, 2]])


Method = Callable[[Numbers, Numbers, Numbers], Numbers]
"""Returns values (M, V) at points (M, 3) from commands (N, 3) and values (N, V)."""


def distances(points: Numbers, commands: Numbers) -> Numbers:
    """Return distances (M, N) of points and commands, each in standard deviations."""
    scale = commands.std(axis=0)
    return np.linalg.norm((points[:, None] - commands) / scale, axis=-1)


def nearest(points: Numbers, commands: Numbers, values: Numbers) -> Numbers:
    """Return the values of the nearest command: a lookup."""
    return values[distances(points, commands).argmin(axis=1)]


def polynomial_table(points: Numbers, commands: Numbers, values: Numbers) -> Numbers:
    """Return the nearest gait as polynomials in time, as the table that people ship stores it."""
    times = np.linspace(0.0, 1.0, PERIOD)
    angles = values[:, :-3].reshape(len(values), PERIOD, -1)
    columns = angles.transpose(1, 0, 2).reshape(PERIOD, -1)
    fitted = np.polynomial.Polynomial.fit
    smooth = np.stack([fitted(times, column, DEGREE)(times) for column in columns.T], axis=1)
    stored = smooth.reshape(PERIOD, len(values), -1).transpose(1, 0, 2).reshape(len(values), -1)
    return nearest(points, commands, np.hstack([stored, values[:, -3:]]))


def two_nearest(points: Numbers, commands: Numbers, values: Numbers) -> Numbers:
    """Return the mean of the two nearest, by distance."""
    gaps = distances(points, commands)
    order = np.argsort(gaps, axis=1)[:, :2]
    weights = 1.0 / np.maximum(np.take_along_axis(gaps, order, axis=1), 1e-9)
    weights /= weights.sum(axis=1, keepdims=True)
    return np.einsum("mk,mkv->mv", weights, values[order])


def trilinear(points: Numbers, commands: Numbers, values: Numbers) -> Numbers:
    """Return values between the nodes of a grid, each with the gait that is nearest to it."""
    axes = [np.linspace(low, high, NODES) for low, high in zip(*extent(commands), strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    node_values = nearest(nodes.reshape(-1, 3), commands, values)
    inside = np.clip(points, *extent(commands))
    return np.asarray(
        RegularGridInterpolator(axes, node_values.reshape(*nodes.shape[:-1], -1))(inside)
    )


def extent(commands: Numbers) -> tuple[Numbers, Numbers]:
    """Return the least and largest commands (3,)."""
    return commands.min(axis=0), commands.max(axis=0)


def quadratic(points: Numbers, commands: Numbers, values: Numbers) -> Numbers:
    """Return quadratic functions of the commands, by least squares."""
    fitted, *_ = np.linalg.lstsq(monomials(commands), values, rcond=None)
    return monomials(points) @ fitted


def monomials(commands: Numbers) -> Numbers:
    """Return all products of up to two commands (N, 10)."""
    pairs = [commands[:, i] * commands[:, j] for i in range(3) for j in range(i, 3)]
    return np.column_stack([np.ones(len(commands)), commands, *pairs])


def radial(points: Numbers, commands: Numbers, values: Numbers) -> Numbers:
    """Return SciPy's thin plate splines with its defaults, of commands in standard deviations."""
    scale = commands.std(axis=0)
    return np.asarray(RBFInterpolator(commands / scale, values)(points / scale))


def gaussian_process(points: Numbers, commands: Numbers, values: Numbers) -> Numbers:
    """Return a Gaussian process with a length for each command and noise, by likelihood."""
    mean, scale = values.mean(axis=0), commands.std(axis=0)
    left, sizes, right = np.linalg.svd(values - mean, full_matrices=False)
    count = int((sizes > 1e-3 * sizes[0]).sum())
    scores = left[:, :count] * sizes[:count]

    def kernel(one: Numbers, other: Numbers, lengths: Numbers) -> Numbers:
        gaps = (one[:, None] - other) / scale / lengths
        return np.asarray(np.exp(-0.5 * (gaps**2).sum(axis=-1)))

    def cost(logarithms: Numbers) -> float:
        covariance = kernel(commands, commands, np.exp(logarithms[:3]))
        covariance[np.diag_indices(len(covariance))] += np.exp(logarithms[3])
        factor = cho_factor(covariance, lower=True)
        explained = (scores * cho_solve(factor, scores)).sum()
        half_determinant = np.log(np.diag(factor[0])).sum()
        return float(0.5 * scores.size * np.log(explained / scores.size) + count * half_determinant)

    start = np.array([0.5, 0.5, 0.5, -4.0])
    best = minimize(cost, start, method="L-BFGS-B", bounds=[(-2.0, 4.0)] * 3 + [(-14.0, 1.0)]).x
    covariance = kernel(commands, commands, np.exp(best[:3]))
    covariance[np.diag_indices(len(covariance))] += np.exp(best[3])
    weights = kernel(points, commands, np.exp(best[:3])) @ np.linalg.solve(covariance, scores)
    return mean + weights @ right[:count]


RIVALS: dict[str, Method] = {
    "nearest": nearest,
    "polynomial table": polynomial_table,
    "two nearest": two_nearest,
    "trilinear grid": trilinear,
    "quadratic": quadratic,
    "RBF": radial,
    "GP": gaussian_process,
}


@dataclass(frozen=True)
class Predicted:
    """Predictions of M gaits.

    values (M, V). seconds: CPU time of training. clip_errors, sigmas (M,), m: actual distance of
    joints and the one that the model expects. seams (M,), rad.
    """

    values: Numbers
    seconds: float
    clip_errors: Numbers
    sigmas: Numbers
    seams: Numbers


def by_posefield(gaits: Gaits, rest: Numbers, left_out: Numbers) -> Predicted:
    """Return what a model of the rest says of the gaits that are left out."""
    with tempfile.TemporaryDirectory() as name:
        begin = time.process_time()
        trained = training.train_examples(gaits.family, [gaits.examples[i] for i in rest])
        seconds = time.process_time() - begin
        posefield_train.export(trained, Path(name, "model.onnx"))
        model = posefield.load(Path(name, "model.onnx"))
    values, errors, sigmas, seams = [], [], [], []
    for index in left_out:
        command = dict(zip(COMMANDS, gaits.commands[index].tolist(), strict=True))
        clip = model.clip(**command, fps=RATE, loop=True, feet="as_predicted")
        motion, truth = clip.robot_motion(), gaits.examples[index].clip
        gone = travel(motion, clip.trust.duration)
        values.append(np.concatenate([motion.angles[:PERIOD].ravel(), gone]))
        gaps = clip.clip.positions()[:PERIOD] - truth.positions()[:PERIOD]
        errors.append(np.sqrt((gaps**2).sum(axis=-1).mean()))
        sigmas.append(clip.trust.sigma)
        seams.append(np.abs(motion.angles[-1] - motion.angles[0]).max())
    return Predicted(np.array(values), seconds, np.array(errors), np.array(sigmas), np.array(seams))


def figures(gaits: Gaits, values: Numbers, left_out: Numbers) -> dict[str, float]:
    """Return errors of predictions: joints in degrees, bodies in cm about the base, and travel."""
    truth = gaits.cycles[left_out]
    angles, true_angles = (
        each[:, :-3].reshape(len(left_out), PERIOD, -1) for each in (values, truth)
    )
    errors = np.degrees(angles - true_angles)
    positions = [
        gaits.robot.body_poses(np.zeros((PERIOD, 3)), np.tile(quat.IDENTITY, (PERIOD, 1)), frames)[
            0
        ]
        for frames in (*angles, *true_angles)
    ]
    gaps = np.array(positions[: len(left_out)]) - np.array(positions[len(left_out) :])
    ways = values[:, -3:] - truth[:, -3:]
    return {
        "joints_deg": float(np.sqrt((errors**2).mean())),
        "worst_gait_deg": float(np.sqrt((errors**2).mean(axis=(1, 2))).max()),
        "bodies_cm": float(100 * np.sqrt((gaps**2).sum(axis=-1).mean())),
        "speed_cm_s": float(100 * np.sqrt((ways[:, :2] ** 2).sum(axis=-1).mean())),
        "turn_deg_s": float(np.degrees(np.sqrt((ways[:, 2] ** 2).mean()))),
        "travel_share": float(np.sqrt((ways**2).sum() / (truth[:, -3:] ** 2).sum())),
        **tracked(values[:, -3:], truth[:, -3:]),
    }


def tracked(velocities: Numbers, truth: Numbers) -> dict[str, float]:
    """Return the median and the 95th percentile of errors of velocities over their size, %."""
    errors = 100 * np.linalg.norm(velocities - truth, axis=1) / np.linalg.norm(truth, axis=1)
    return {
        "tracked_median": float(np.median(errors)),
        "tracked_95": float(np.percentile(errors, 95)),
    }


def of_all(gaits: Gaits, folder: Path) -> dict[str, float]:
    """Return figures of the model of all gaits, at captured commands and between them."""
    path = folder / "model.onnx"
    posefield_train.export(training.train_examples(gaits.family, list(gaits.examples)), path)
    model = posefield.load(path)
    evaluator = Evaluator(ReferenceModel(path))
    captured, draws = gaits.commands, np.random.default_rng(5)
    corners = captured[draws.integers(0, len(captured), (BETWEEN, 4))]
    between = np.einsum("ek,ekd->ed", draws.dirichlet(np.ones(4), BETWEEN), corners)
    gone, feet, sunk, beyond, apart, seams = [], [], [], [], [], []
    for row, command in enumerate([*captured.tolist(), *between.tolist()]):
        question = dict(zip(COMMANDS, command, strict=True))
        loop = model.clip(**question, fps=RATE, loop=True)
        motion, trust = loop.robot_motion(), loop.trust
        gone.append(travel(motion, trust.duration))
        seams.append(np.abs(motion.angles[-1] - motion.angles[0]).max())
        beyond.append(motion.beyond_limits(gaits.robot).max())
        if row < len(captured):
            continue
        feet.append((trust.feet.skate_before, trust.feet.skate))
        soles = gaits.robot.foot_points(*motion.body_poses(gaits.robot))
        sunk.append(-min(points[..., 2].min() for points in soles))
        phases = np.arange(len(motion) - 1) / (len(motion) - 1)
        plan = evaluator.plan(np.tile(command, (len(phases), 1)))
        answer = evaluator.sample(plan, phases)
        gaps = (answer.joint_positions - motion.angles[:-1], plan.sigmas - trust.sigma)
        apart.append([np.abs(gap).max() for gap in gaps])
    velocities = gaits.cycles[:, -3:]
    skates, gaps = 100 * np.mean(feet, axis=0), np.max(apart, axis=0)
    return {
        **{
            f"captured_{name}": v
            for name, v in tracked(np.array(gone[: len(captured)]), velocities).items()
        },
        **{
            f"between_{name}": v
            for name, v in tracked(np.array(gone[len(captured) :]), between).items()
        },
        "skate_predicted_cm_s": float(skates[0]),
        "skate_cm_s": float(skates[1]),
        "sunk_mm": float(1000 * max(0.0, *sunk)),
        "beyond_limits_rad": float(max(0.0, *beyond)),
        "seam_rad": float(max(seams)),
        "apart_rad": float(gaps[0]),
        "sigma_apart_m": float(gaps[1]),
        **loops(path),
    }


def loops(path: Path) -> dict[str, float]:
    """Return the times of training loops, where torch is installed."""
    if find_spec("torch") is None:
        return {}
    script = Path(__file__).with_name("training_loop.py")
    told = subprocess.run([sys.executable, script, path], check=True, capture_output=True)
    figures: dict[str, float] = json.loads(told.stdout)
    return {name: value for name, value in figures.items() if name.endswith("_ms")}


def splits(gaits: Gaits) -> dict[str, list[Numbers]]:
    """Return the gaits that are left out together, by name of the trial."""
    order = np.random.default_rng(0).permutation(len(gaits.examples))
    axes = [
        np.linspace(low, high, NODES) for low, high in zip(*extent(gaits.commands), strict=True)
    ]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    kept = np.unique(distances(nodes, gaits.commands).argmin(axis=1))
    return {
        "tenths": [order[fold::FOLDS] for fold in range(FOLDS)],
        "grid": [np.setdiff1d(order, kept)],
    }


def measure(gaits: Gaits) -> dict[str, Any]:
    """Return the figures of all methods in all trials."""
    report: dict[str, Any] = {}
    for name, parts in splits(gaits).items():
        everything = np.arange(len(gaits.examples))
        left_out = np.concatenate(parts)
        rows: dict[str, dict[str, float]] = {}
        predictions = []
        for part in parts:
            predictions.append(by_posefield(gaits, np.setdiff1d(everything, part), part))
            sys.stderr.write(f"{name}: {len(predictions)} of {len(parts)}\n")
        values = np.concatenate([each.values for each in predictions])
        rows["posefield"] = figures(gaits, values, left_out)
        for rival, method in RIVALS.items():
            rival_values = []
            for part in parts:
                rest = np.setdiff1d(everything, part)
                rival_values.append(
                    method(gaits.commands[part], gaits.commands[rest], gaits.cycles[rest])
                )
            rows[rival] = figures(gaits, np.concatenate(rival_values), left_out)
        errors, sigmas, seams = (
            np.concatenate([getattr(each, field) for each in predictions])
            for field in ("clip_errors", "sigmas", "seams")
        )
        ranks = [np.argsort(np.argsort(each)) for each in (errors, sigmas)]
        report[name] = {
            "gaits": len(gaits.examples),
            "left_out": len(left_out),
            "kept": len(gaits.examples) - len(parts[0]),
            "methods": [{"method": method, **row} for method, row in rows.items()],
            "sigma_ratio": float(np.sqrt((errors**2).mean() / (sigmas**2).mean())),
            "sigma_rank": float(np.corrcoef(*ranks)[0, 1]),
            "within_two_sigma": float((errors < 2.0 * sigmas).mean()),
            "seam_rad": float(seams.max()),
            "training_s": float(np.mean([each.seconds for each in predictions])),
        }
    return report


def rows_of(trials: dict[str, Any], models: dict[str, Any]) -> list[Row]:
    """Return the figures that have goals.

    trials: of given and, by other names, of measured commands. models: of all gaits, by kind.
    """
    rows = []
    for trial, facts in trials.items():
        (ours,) = [row for row in facts["methods"] if row["method"] == "posefield"]
        best = min(row["joints_deg"] for row in facts["methods"][1:])
        against, ratio = f"best of the others {best:.2f}", facts["sigma_ratio"]
        must = 0.75 if trial == "tenths" else None
        median, high = ours["tracked_median"], f"95 % within {ours['tracked_95']:.2g} %"
        rows += [
            Row(f"{trial}: joints", ours["joints_deg"], "degrees", against, None, must),
            Row(f"{trial}: command tracked", median, "%", high, None, 1.0),
            # Too small by a factor is as wrong as too large.
            Row(
                f"{trial}: factor between error and sigma",
                max(ratio, 1.0 / ratio),
                "",
                f"error over sigma {ratio:.2f}",
                None,
                1.25,
            ),
        ]
    for kind, facts in models.items():
        for where in ("captured", "between"):
            if (kind, where) == ("given", "between"):
                # There is no true speed of a gait between commands of a planner.
                continue
            median = facts[f"{where}_tracked_median"]
            high = f"95 % within {facts[f'{where}_tracked_95']:.2g} %"
            name = f"{kind}, {where}: command tracked"
            rows.append(Row(name, median, "%", high, None, 1.0))
        predicted = f"as predicted {facts['skate_predicted_cm_s']:.2g}"
        rows += [
            Row(f"{kind}: skate", facts["skate_cm_s"], "cm/s", predicted, None, 1.0),
            Row(f"{kind}: penetration", facts["sunk_mm"], "mm", "", None, 2.0),
            Row(f"{kind}: beyond limits", facts["beyond_limits_rad"], "rad", "", None, 0.0),
            Row(f"{kind}: seam", facts["seam_rad"], "rad", "", None, 1e-6),
            Row(f"{kind}: evaluator, angles", facts["apart_rad"], "rad", "", None, 1e-5),
            Row(f"{kind}: evaluator, sigma", facts["sigma_apart_m"], "m", "", None, 1e-5),
        ]
        for name, what in LOOPS.items():
            if name in facts:
                rows.append(Row(f"{kind}: {what}", facts[name], "ms", "", None, 5.0))
    return rows


LOOPS = {
    "step_ms": "4,096 environments, a step",
    "step_with_8_changed_ms": "4,096 environments, a step with eight new commands",
}


def main() -> None:
    """Measure, and print or record the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder with go_bdx.xml and gaits")
    parser.add_argument("--record", action="store_true", help="write docs/results/robot_gaits.json")
    options = parser.parse_args()
    trials: dict[str, Any] = {}
    models: dict[str, Any] = {}
    for kind in KINDS:
        with tempfile.TemporaryDirectory() as name:
            gaits = read(options.folder, Path(name), kind)
            models[kind] = of_all(gaits, Path(name))
            named = "" if kind == "given" else f"{kind} "
            trials |= {f"{named}{trial}": facts for trial, facts in measure(gaits).items()}
    tables = {"robot_gaits": rows_of(trials, models)}
    sys.stdout.write(f"{table(tables['robot_gaits'])}\n")
    if options.record:
        record(tables, "python benchmarks/robots.py FOLDER --record", RESULTS)
        path = RESULTS / "robot_gaits.json"
        recorded = json.loads(path.read_text()) | {"models": models, "trials": trials}
        path.write_text(compact(recorded) + "\n")


if __name__ == "__main__":
    main()
