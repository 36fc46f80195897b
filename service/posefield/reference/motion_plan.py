"""Evaluation of a robot's model for many commands at once, by NumPy, torch or JAX.

A plan holds what depends on a command alone: its cycle, with standing soles, as rows of numbers at
the canonical frames. A sample reads two rows of it and is linear between them, as the model is. All
functions are written for the module of arrays that `Arrays` names, are the same for each, and pass
gradients on. The answers are those of the service, which evaluates the same file in single
precision.
"""

from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from posefield.common.errors import ModelError
from posefield.common.units import Floats
from posefield.inference import reduced_motion, session
from posefield.kriging import kriging_model, support
from posefield.kriging.kriging_model import COVARIANCE_MODELS
from posefield.model_file import onnx_file
from posefield.model_file.model_card import ModelCard
from posefield.motion import cycle_velocities, quat
from posefield.motion.cycle_velocities import QUANTITIES
from posefield.reference import array_rotations as rotations
from posefield.robots import robot_clip, standing_soles
from posefield.robots.standing_soles import Array, StandingSoles
from posefield.validation import question_validation

TO_Z_UP = [2, 0, 1]


class Arrays(NamedTuple):
    """A module of arrays.

    xp: `numpy`, `torch` or `jax.numpy`. constant: makes an array from one of NumPy, or from one of
    another precision. whole: an array's numbers, rounded down, as indices. take: rows of an array
    (R, C) at indices.
    """

    xp: Any
    constant: Callable[[Floats], Array]
    whole: Callable[[Array], Array]
    take: Callable[[Array, Array], Array]


NUMPY = Arrays(np, np.asarray, lambda a: a.astype(int), lambda rows, indices: rows[indices])


class Plan(NamedTuple):
    """Cycles of E commands.

    rows (E, T, C): numbers of each canonical frame. warps (E, P): of the phase. travels (E, 3): of
    a cycle, m, m and rad: ahead, to the left, and of the heading. durations (E,): of a cycle, s.
    sigmas (E,), m. supported (E,): 1 where clips of like commands were captured, else 0.
    """

    rows: Array
    warps: Array
    travels: Array
    durations: Array
    sigmas: Array
    supported: Array


class Reference(NamedTuple):
    """Reference of E robots of H hinges and K feet, each at its phase. Z up, in SI units.

    base_positions (E, 3) and base_rotations (E, 4), w x y z, are in the frame in which the cycle
    begins, X ahead; base_velocities (E, 3), m/s, and base_turn_rates (E, 3), rad/s, too. Velocities
    are central differences over canonical frames. contacts (E, K): 1 while a foot stands.
    phase_rates (E,): cycles a second. sigmas (E, H): standard deviation of the place of each joint
    from that of a captured gait, m. supported (E,): 1 where gaits of like commands were captured.
    travels (E, 3): of a whole cycle: ahead, to the left, m, and of the heading, rad.
    """

    joint_positions: Array
    joint_velocities: Array
    base_positions: Array
    base_rotations: Array
    base_velocities: Array
    base_turn_rates: Array
    contacts: Array
    phase_rates: Array
    sigmas: Array
    supported: Array
    travels: Array


class ReferenceModel:
    """Model of a robot's gaits in a file; raises ModelError for a file of another kind.

    labels: name or weights by label set, such as a style; sets that are not given are open.
    hinges, feet: names, in the order of the reference. controls: names, in that of commands.
    """

    def __init__(self, path: str | Path, labels: Mapping[str, Any] | None = None) -> None:
        opened = session.load(Path(path))
        card = opened.card
        _check(path, card)
        assert card.robot is not None
        self.card, self.robot = card, card.robot
        self.controls = tuple(control.name for control in card.controls)
        self.hinges = self.robot.hinges
        self.feet = tuple(self.robot.bodies[body] for body in self._foot_bodies)
        # Copies: torch takes no arrays that are read alone.
        self._weights = {n: w.copy() for n, w in onnx_file.initializers(opened.content).items()}
        self.labels = question_validation.label_weights(card, None, labels or {})[0]
        self.bounds = opened.bounds

    @cached_property
    def _foot_bodies(self) -> list[int]:
        return list(dict.fromkeys(point.body for point in self.card.soles))

    def constants(self) -> dict[str, Floats]:
        """Return the arrays of the evaluation by name, in double precision."""
        card, weights, bounds = self.card, self._weights, self.bounds
        hyper = card.kriging
        count, columns = len(self.labels), weights["linear_weights"].shape[1]
        samples = weights["samples"].T.astype(np.float64)
        sizes = {"travel": 3, "offsets": len(weights["offset_directions"]), "duration": 1}
        sizes["warp"] = len(weights["warp_still"])
        sizes["pose"] = columns - 2 - sum(sizes.values())
        duals = [np.zeros((len(samples), 1))]
        for name, size in sizes.items():
            duals.append(weights.get(f"{name}_weights", np.zeros((len(samples), size))))
        shares = np.ones(len(samples))
        for index, (kernel, named) in enumerate(
            zip(hyper.labels, kriging_model.label_columns(0, hyper.label_counts), strict=True)
        ):
            same = self.labels[weights[f"whose_{index}"]]
            assert named.stop <= count
            shares *= kernel.correlation + (1.0 - kernel.correlation) * same
        form = np.zeros((count + 1 + len(bounds.low) + len(samples),) * 2)
        form[np.tril_indices(len(form))] = weights["precision"]
        exponents = weights.get("duration_exponents", np.zeros((samples.shape[1], 1)))
        quantities = [control.measure and control.measure.quantity for control in card.controls]
        captured = support.fit_support(np.array(card.examples)).table()
        return {
            "low": bounds.low,
            "high": bounds.high,
            "least": bounds.limits[0],
            "greatest": bounds.limits[1],
            "scales": np.asarray(hyper.scales),
            "samples": samples,
            "label_shares": shares,
            "leading": np.append(self.labels, 1.0),
            "weights": np.vstack([weights["linear_weights"][:, 1:], np.hstack(duals)]),
            "splits": np.cumsum([1, *sizes.values()]),
            "form": form + np.tril(form, -1).T,
            "sill": weights["sill"].astype(np.float64)[0],
            "shortest": np.array(bounds.duration_limits),
            "floor": weights.get("duration_floor", np.ones(samples.shape[1]))[: samples.shape[1]],
            "exponents": exponents[: samples.shape[1], 0],
            "warp_still": weights["warp_still"],
            "warp_form": weights["warp_form"],
            "warp_breaks": weights["warp_breaks"][3:, 0, 0],
            "joint_sigma": np.array(card.joint_sigma)[list(robot_clip.of(self.robot).hinge_joints)],
            **{f"support_{name}": np.asarray(value) for name, value in captured.items()},
            **self._tensor(),
            "contacts": self._contacts(),
            "ranges": self.robot.ranges.T,
            "products": rotations.PRODUCTS,
            "matrices": rotations.MATRICES,
            "conjugate": np.array([1.0, -1.0, -1.0, -1.0]),
            "commanded": 1.0 * np.array([[q == name for name in QUANTITIES] for q in quantities]),
        }

    def _tensor(self) -> dict[str, Floats]:
        """Return the decoder: moves of the root, the base's rotation and the angles alone."""
        reduced = reduced_motion.read(self._weights, self.card.levels[0], self.card)
        rig = robot_clip.of(self.robot)
        rows = np.vstack([reduced.mean, reduced.directions])
        numbers = rows[:, 3:].reshape(len(rows), -1, 3)
        joints = list(rig.hinge_joints)
        turned = np.sum(numbers[:, joints] * rig.axes, axis=-1)
        rest = np.array(
            [
                quat.twist(reduced.rotations[joint], axis)
                for joint, axis in zip(joints, rig.axes, strict=True)
            ]
        )
        # Between turns of the whole circle, angles are those nearest to their ranges.
        means = rest + turned[0] - self.robot.ranges.mean(axis=1)
        rest -= 2.0 * np.pi * np.round(means / (2.0 * np.pi))
        moves = np.hstack([rows[:, :3][:, TO_Z_UP], numbers[:, 0][:, TO_Z_UP], turned])
        base = reduced.rotations[0]
        moves[0, 6:] += rest
        return {
            "core": reduced.core.reshape(-1, reduced.core.shape[2]).T,
            "time": reduced.time,
            "mean": moves[0],
            "moves": moves[1:],
            "base": np.append(base[:1], base[1:][TO_Z_UP]),
        }

    def _contacts(self) -> Floats:
        """Return 1 for canonical frames (T, K) in which a foot stands, else 0."""
        steps = self.card.frames - 1
        contacts = np.zeros((steps, len(self._foot_bodies)))
        for point in self.card.soles:
            for first, last in point.stances:
                frames = np.arange(first, last + 1) % steps
                contacts[frames, self._foot_bodies.index(point.body)] = 1.0
        return np.vstack([contacts, contacts[:1]])


def _check(path: str | Path, card: ModelCard) -> None:
    """Raise ModelError for a model that is not of the gaits of a robot."""
    measured = [
        control.name
        for control in card.controls
        if control.measure and control.measure.quantity not in QUANTITIES
    ]
    if card.robot is None:
        raise ModelError(path, "no robot's, expected a model whose recipe has [robot]")
    if not card.cyclic or card.root != "travelling":
        raise ModelError(path, "of motions that are no cycles or stay in place, expected gaits")
    if card.making.chart != "rotation_vector":
        raise ModelError(path, "of an earlier version, whose angles are curved: train it again")
    if measured:
        raise ModelError(
            path,
            f"{measured[0]} is measured, expected columns or some of {', '.join(QUANTITIES)}",
        )


class Evaluator:
    """Evaluation of a model by one module of arrays.

    fine: arrays in which plans are made. fast: those in which feet are solved, and samples made.

    Attributes: controls, hinges, feet and bodies are names in the order of commands, joints,
    contacts and poses of bodies.
    """

    def __init__(self, model: ReferenceModel, fine: Arrays = NUMPY, fast: Arrays = NUMPY) -> None:
        self._model, self._xp = model, fine.xp
        self.controls, self.hinges, self.feet = model.controls, model.hinges, model.feet
        self.bodies = model.robot.bodies
        constants = model.constants()
        self._splits = [int(end) for end in constants.pop("splits")]
        self._fine = {name: fine.constant(values) for name, values in constants.items()}
        self._fast = {
            name: fast.constant(constants[name])
            for name in ("warp_breaks", "base", "joint_sigma", "products", "matrices", "ranges")
        }
        links = (standing_soles.links(model.robot, [body]) for body in range(1, len(self.bodies)))
        self._links = [(hinges, *map(fast.constant, arrays)) for hinges, *arrays in links]
        self._whole, self._take, self._steps = fast.whole, fast.take, model.card.frames - 1
        self._single = fast.constant
        soles = model.card.soles
        self._soles = StandingSoles(fast.xp, fast.constant, model.robot, soles, self._steps)
        self._covariance = COVARIANCE_MODELS[model.card.kriging.covariance]

    def plan(self, commands: Array) -> Plan:
        """Return the cycles of commands (E, d), in the model's units and the order of controls."""
        xp, w = self._xp, self._fine
        limited = xp.clip(commands, w["least"], w["greatest"])
        inside = xp.clip(commands, w["low"], w["high"])
        # Duration keeps to what it is inside, and sigma is that of the commands as they are.
        cases, count = xp.concatenate([limited, inside, commands], 0), len(commands)
        bases = self._basis(cases)
        basis = bases[2 * count :]
        powers = xp.log(xp.maximum(cases[: 2 * count], w["floor"])) @ w["exponents"]
        both = bases[: 2 * count] @ w["weights"]
        logarithms, travel, _, _, warp, pose = (
            both[:count, first:end]
            for first, end in zip([0, *self._splits[:-1]], self._splits, strict=True)
        )
        both = xp.exp(both[:, self._splits[2]] + powers)
        nearest, (shortest, longest) = both[count:], w["shortest"]
        durations = xp.clip(
            both[:count], xp.minimum(nearest, shortest), xp.maximum(nearest, longest)
        )
        variance = w["sill"] * xp.sum((basis @ w["form"]) * basis, -1)
        variance = variance + xp.exp(logarithms[:, 0])
        goals, chosen = limited @ w["commanded"], xp.sum(w["commanded"], 0)
        travel = cycle_velocities.matched(xp, travel, durations, goals, chosen)
        travels = xp.stack([travel[:, 1], travel[:, 0], travel[:, 2]], -1)
        shares = xp.exp(warp + w["warp_still"])
        shares = shares / xp.sum(shares, -1)[:, None]
        return Plan(
            self._rows(pose, travels),
            shares @ w["warp_form"].T,
            travels,
            durations,
            xp.sqrt(xp.clip(variance, rotations.TINY, None)),
            self._supported(commands),
        )

    def _basis(self, commands: Array) -> Array:
        """Return labels, one, controls and covariances (E, p + 1 + d + n) at commands (E, d)."""
        xp, w = self._xp, self._fine
        half = (2.0 * commands - w["low"] - w["high"]) / (w["high"] - w["low"])
        gaps = (half[:, None] - w["samples"]) * w["scales"]
        near = self._covariance(xp.sum(gaps * gaps, -1) + rotations.TINY, xp) * w["label_shares"]
        leading = half[:, :1] * 0.0 + w["leading"]
        return xp.concatenate([leading, half, near], -1)

    def _supported(self, commands: Array) -> Array:
        xp, w = self._xp, self._fine
        scale, bounds = w["support_scale"], w["support_bounds"]
        squares = xp.sum((commands * scale[:, 0] - scale[:, 1]) ** 2, -1)
        near = xp.exp(commands @ w["support_slopes"].T + w["support_offsets"])
        explained = xp.exp(-2.0 * w["support_rate"] * squares)
        explained = explained * xp.sum((near @ w["support_inverse"]) * near, -1)
        inside = (bounds[:, 0] <= commands) & (commands <= bounds[:, 1])
        within = (1.0 - explained <= w["support_limit"]) & inside.all(-1)
        return 1.0 * within

    def _rows(self, pose: Array, travel: Array) -> Array:
        """Return the rows (E, T, C) of coefficients (E, r3) and travels (E, 3).

        Columns: base position without travel and rotation numbers, angles, then the changes of
        angles, position and rotation by frame, and contacts.
        """
        xp, w, steps = self._xp, self._fine, self._steps
        reduced = (pose @ w["core"]).reshape(len(pose), -1, len(w["moves"]))
        numbers = w["mean"] + (w["time"] @ reduced) @ w["moves"]
        share = (xp.cumsum(numbers[:1, :, 0] * 0.0 + 1.0, -1) - 1.0) / steps
        path, turns = placed(xp, w, numbers, travel, share)
        angles = numbers[..., 6:]
        if self._model.card.soles:
            matrices = rotations.bilinear(turns, turns, w["matrices"])
            matrices = matrices.reshape(*turns.shape[:2], 3, 3)
            cycle = [self._single(values) for values in (path, matrices, angles)]
            angles = angles + (self._soles.corrected(*cycle) - self._soles.limited(cycle[2]))
        before = turns[:, :-1] * w["conjugate"]
        spins = rotations.bilinear(turns[:, 1:], before, w["products"])
        spins = rotations.rotation_vectors(xp, spins)
        moves = xp.stack([path[:, 1:] - path[:, :-1], spins], 2)
        moves = central(xp, moves, travel[:, 2:]).reshape(*path.shape[:2], 6)
        turned = central(xp, angles[:, 1:] - angles[:, :-1], None)
        contacts = w["contacts"] + 0.0 * numbers[..., : len(self.feet)]
        return xp.concatenate([numbers[..., :6], angles, turned, moves, contacts], -1)

    def sample(self, plan: Plan, phase: Array) -> Reference:
        """Return the reference at phases (E,), in cycles; whole cycles do not count."""
        xp, w, steps = self._xp, self._fast, self._steps
        u = phase - xp.floor(phase)
        late = xp.clip(u[:, None] - w["warp_breaks"], 0.0, None)
        powers = xp.concatenate([u[:, None], (u * u)[:, None], (u**3)[:, None], late**3], -1)
        frame = xp.clip(xp.sum(powers * plan.warps, -1), 0.0, float(steps))
        slopes = [u[:, None] * 0.0 + 1.0, 2.0 * u[:, None], 3.0 * (u * u)[:, None], 3.0 * late**2]
        pace = xp.sum(xp.concatenate(slopes, -1) * plan.warps, -1) / plan.durations
        first = xp.clip(self._whole(frame), 0, steps - 1)
        count, frames, columns = plan.rows.shape
        flat = plan.rows.reshape(count * frames, columns)
        at = first + self._whole(xp.cumsum(phase * 0.0 + float(frames), -1)) - frames
        share = (frame - first)[:, None]
        before, after = (self._take(flat, index) for index in (at, at + 1))
        row = before + share * (after - before)
        h = len(self.hinges)
        numbers, changes = row[:, : 6 + h], row[:, 6 + h : 12 + 2 * h] * pace[:, None]
        done = (frame / steps)[:, None]
        path, turns = placed(xp, w, numbers[:, None], plan.travels, done)
        sigmas = plan.sigmas[:, None] * w["joint_sigma"]
        return Reference(
            xp.clip(numbers[:, 6:], *w["ranges"]),
            changes[:, :h],
            path[:, 0],
            turns[:, 0],
            changes[:, h : h + 3],
            changes[:, h + 3 :],
            row[:, 12 + 2 * h :],
            1.0 / plan.durations,
            sigmas,
            # Copies: torch's plans change where commands do.
            plan.supported + 0.0,
            plan.travels + 0.0,
        )

    def body_poses(self, reference: Reference) -> Array:
        """Return matrices (E, B, 3, 4) of all bodies: rotations, and positions, m, behind them.

        They lead from the frame of each body to that of the reference's base.
        """
        xp, turns = self._xp, reference.base_rotations
        turned = rotations.bilinear(turns, turns, self._fast["matrices"]).reshape(-1, 3, 3)
        poses = [xp.concatenate([turned, reference.base_positions[..., None]], -1)]
        angles = reference.joint_positions[..., None]
        shares = xp.concatenate([angles * 0.0 + 1.0, xp.sin(angles), 1.0 - xp.cos(angles)], -1)
        parents = self._model.robot.parents[1:]
        for parent, (hinges, links, fixed) in zip(parents, self._links, strict=True):
            pose = poses[parent]
            for hinge, link in zip(hinges, links, strict=True):
                pose = pose @ (shares[:, hinge] @ link.T).reshape(-1, 4, 4)
            poses.append(pose @ fixed)
        return xp.stack(poses, 1)


def placed(
    xp: Any, w: Mapping[str, Array], numbers: Array, travel: Array, share: Array
) -> list[Array]:
    """Return base positions (E, S, 3), m, and rotations (E, S, 4) with the travel in them.

    w: constants. numbers (E, S, 6 or more): position without travel and rotation about the mean.
    travel (E, 3): ahead, to the left and of the heading. share (E or 1, S): of the cycle done.
    """
    done = travel[:, None] * share[..., None]
    flat = xp.stack([done[..., 0], done[..., 1], done[..., 0] * 0.0], -1)
    half = 0.5 * numbers[..., 3:6]
    size = xp.sqrt(xp.sum(half * half, -1) + rotations.TINY)[..., None]
    turn = xp.concatenate([xp.cos(size), half * (xp.sin(size) / size)], -1)
    angle = 0.5 * done[..., 2]
    zero = angle * 0.0
    heading = xp.stack([xp.cos(angle), zero, zero, xp.sin(angle)], -1)
    products = w["products"]
    turned = rotations.bilinear(heading, rotations.bilinear(w["base"], turn, products), products)
    return [numbers[..., :3] + flat, turned]


def central(xp: Any, steps: Array, turn: Array | None) -> Array:
    """Return central differences (E, N + 1, ...) of a cycle's steps (E, N, ...) between frames.

    turn (E, 1): of the next cycle about the vertical, rad; None for values that it does not turn.
    """
    before, after = steps[:, -1:], steps[:, :1]
    if turn is not None:
        before, after = (
            rotations.about_vertical(xp, before, -turn),
            rotations.about_vertical(xp, after, turn),
        )
    return 0.5 * (xp.concatenate([before, steps], 1) + xp.concatenate([steps, after], 1))
