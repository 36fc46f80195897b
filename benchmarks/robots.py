"""Gaits of a robot by command: posefield against the interpolations that people write themselves.

    python benchmarks/robots.py build/data/robot_go_bdx --record

All methods have the same commands and the same cycles: joint angles by phase, and the travel of a
cycle. Each tenth of the gaits is left out in turn; then all but the 27 gaits nearest to the nodes
of a grid of 3 × 3 × 3 commands. The gaits are NVIDIA's, for other than commercial use: not shipped.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
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
from posefield.motion import quat
from posefield.robots import robot_clip
from posefield.robots.robot import Robot
from posefield.robots.robot_motion import RobotMotion
from posefield_train import training
from posefield_train.robots import robot_file
from posefield_train.source import ingest, recipe
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

Numbers = NDArray[np.float64]
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


def read(folder: Path, work: Path) -> Gaits:
    """Return the gaits of a folder with a robot and JSON files; work: empty folder."""
    for entry in ("go_bdx.xml", "gaits", "meshes"):
        (work / entry).symlink_to((folder / entry).absolute())
    family = recipe.read(robot_recipe.write(work))
    examples, _ = ingest.ingest(family, work)
    robot = robot_file.read(work / "go_bdx.xml")
    body = robot_clip.of(robot)
    motions = [body.motion(example.clip, "gait") for example in examples]
    commands = np.array([example.controls for example in examples])
    return Gaits(robot, family, list(examples), commands, motions)


def travel(motion: RobotMotion) -> Numbers:
    """Return the way ahead and to the left, m/s, and the turn, rad/s, over a motion."""
    turns = quat.mul(quat.conj(motion.base_rotations[0]), motion.base_rotations[-1])
    heading = 2.0 * np.arctan2(motion.base_rotations[0, 3], motion.base_rotations[0, 0])
    way = (motion.base_path[-1] - motion.base_path[0])[:2]
    ahead = np.cos(heading) * way[0] + np.sin(heading) * way[1]
    left = -np.sin(heading) * way[0] + np.cos(heading) * way[1]
    return np.array([ahead, left, 2.0 * np.arctan2(turns[3], turns[0])]) / motion.duration


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
        values.append(np.concatenate([motion.angles[:PERIOD].ravel(), travel(motion)]))
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
    }


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


def rows_of(report: dict[str, Any]) -> list[Row]:
    """Return the figures that have goals."""
    rows = []
    for trial, facts in report.items():
        (ours,) = [row for row in facts["methods"] if row["method"] == "posefield"]
        best = min(row["joints_deg"] for row in facts["methods"][1:])
        against = f"best of the others {best:.2f}"
        must = 0.75 if trial == "tenths" else None
        rows += [
            Row(f"{trial}: joints", ours["joints_deg"], "degrees", against, None, must),
            Row(f"{trial}: travel", 100 * ours["travel_share"], "%", "", None, 1.0),
            # Too small by a factor is as wrong as too large.
            Row(
                f"{trial}: factor between error and sigma",
                max(facts["sigma_ratio"], 1.0 / facts["sigma_ratio"]),
                "",
                f"error over sigma {facts['sigma_ratio']:.2f}",
                None,
                1.25,
            ),
            Row(f"{trial}: seam", facts["seam_rad"], "rad", "", None, 1e-6),
        ]
    return rows


def main() -> None:
    """Measure, and print or record the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder with go_bdx.xml and gaits")
    parser.add_argument("--record", action="store_true", help="write docs/results/robot_gaits.json")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        report = measure(read(options.folder, Path(work)))
    tables = {"robot_gaits": rows_of(report)}
    sys.stdout.write(f"{table(tables['robot_gaits'])}\n")
    if options.record:
        record(tables, "python benchmarks/robots.py FOLDER --record", RESULTS)
        path = RESULTS / "robot_gaits.json"
        path.write_text(compact(json.loads(path.read_text()) | {"trials": report}) + "\n")


if __name__ == "__main__":
    main()
