"""Every method's answers to the same queries, from the same training."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from model_export import hosvd, naive, samples, travel, variogram
from model_export.evaluate import motion
from model_export.evaluate.motion import EVEN, Event, Motion
from model_export.evaluate.peers import PEERS, Peer
from model_export.recipe import Recipe
from model_export.samples import Samples
from model_export.train import Trained
from service.motion import skeleton
from service.motion.conventions import Floats


@dataclass(frozen=True)
class Asked:
    """Controls (Q, d) and performers' names of queries."""

    controls: Floats
    performers: Sequence[str]


@dataclass(frozen=True)
class _Values:
    """What is predicted for Q queries: pose vectors (Q, T, D) in canonical time, and the rest."""

    numbers: Floats
    beside: dict[str, Floats]


def answers(recipe: Recipe, trained: Trained, asked: Asked) -> dict[str, list[Motion]]:
    """Motions of every method, ours first."""
    made = {"posefield": _ours(recipe, trained, asked)}
    for name, predict in _methods(recipe, trained).items():
        made[name] = _restore(recipe, trained, predict(asked))
    return made


def event(recipe: Recipe, trained: Trained) -> Event:
    """..."""
    names = trained.skeleton.names
    joint = names.index(recipe.event.joint) if recipe.event else len(names) - 1
    return Event(joint, 1.0)


def _labels(trained: Trained, asked: Asked) -> Floats:
    return samples.labels(asked.performers, trained.model.bank.performers)


def _ours(recipe: Recipe, trained: Trained, asked: Asked) -> list[Motion]:
    """The model as it ships: truncated, with its own bones and timing."""
    labels = _labels(trained, asked)
    own = trained.model.evaluate(asked.controls, np.zeros((len(asked.controls), 1)), labels)
    found = trained.model.evaluate(asked.controls, own.duration[:, None] * EVEN, labels)
    translations = np.repeat(found.bone_offsets[:, None], len(EVEN), axis=1)
    translations[:, :, 0] = found.root_position
    return _motions(recipe, trained, found.rotations, translations, found.duration)


def _motions(
    recipe: Recipe, trained: Trained, rotations: Floats, translations: Floats, durations: Floats
) -> list[Motion]:
    parents, own = trained.skeleton.parents, event(recipe, trained)
    return [
        motion.posed(parents, *parts, own)
        for parts in zip(rotations, translations, map(float, durations), strict=True)
    ]


def _methods(recipe: Recipe, trained: Trained) -> dict[str, Callable[[Asked], _Values]]:
    laid, _ = samples.lay(recipe, trained.examples)
    beside = trained.values

    def of_peer(peer: Peer) -> Callable[[Asked], _Values]:
        def predict(asked: Asked) -> _Values:
            points = trained.model.bank.points(asked.controls, _labels(trained, asked))
            found = {name: peer(laid, values, points) for name, values in beside.items()}
            coefficients = found.pop("pose")
            return _Values(_numbers(trained, coefficients), found)

        return predict

    def by_frame(asked: Asked) -> _Values:
        points = trained.model.bank.points(asked.controls, _labels(trained, asked))
        return _naive(trained, laid, beside, points)

    return {"naive": by_frame, **{name: of_peer(peer) for name, (peer, _) in PEERS.items()}}


def _numbers(trained: Trained, coefficients: Floats) -> Floats:
    """Pose vectors (Q, T, D) of motions (Q, N) in the coordinates of the sample mode."""
    lengths = np.linalg.norm(hosvd.unfold(trained.full.core, 2), axis=1)
    unit = trained.full.core / np.maximum(lengths, 1e-12 * lengths[0])
    whole = hosvd.mode_dot(hosvd.mode_dot(unit, trained.full.bases[0], 0), trained.full.bases[1], 1)
    table = np.einsum("dtn,qn->qtd", whole, coefficients, optimize=True)
    return trained.tensor.mean + table @ trained.tensor.unwhiten.T


def _naive(trained: Trained, laid: Samples, beside: dict[str, Floats], points: Floats) -> _Values:
    """Kriging of every frame by itself; all else the same way, as one frame."""
    known, asked = laid.points[:, : laid.controls], points[:, : laid.controls]
    vectors = _numbers(trained, beside["pose"])
    positions = _positions(trained, vectors)

    def krige(shown: Floats, values: Floats) -> Floats:
        return naive.fit(known, shown, values, "matern52", variogram.fit).numpy(asked)

    rest = {name: values for name, values in beside.items() if name != "pose"}
    found = {n: krige(v[:, None, :, None], v[:, None])[:, 0] for n, v in rest.items()}
    return _Values(krige(positions, vectors), found)


def _positions(trained: Trained, vectors: Floats) -> Floats:
    """Joint positions (N, T, J, 3) of the samples' pose vectors, m."""
    rotations, path = trained.tensor.chart.poses(vectors)
    offsets = np.stack([example.offsets for example in trained.examples])
    translations = np.repeat(offsets[:, None], vectors.shape[1], axis=1)
    translations[:, :, 0] = path
    return skeleton.forward(trained.skeleton.parents, rotations, translations)[0]


def _restore(recipe: Recipe, trained: Trained, values: _Values) -> list[Motion]:
    """Motions of predicted values, by the model's own timing, travel, chart and bones."""
    timing = trained.model.timing
    steps = np.tile(EVEN, (len(values.numbers), 1))
    zero = np.zeros((len(steps), 1))
    _, place = timing.numpy(zero, values.beside["warp"], steps)
    rotations, path = trained.tensor.chart.poses(_between(values.numbers, place))
    if "travel" in values.beside:
        share = place / (timing.frames - 1)
        rotations, path = travel.put_back(rotations, path, values.beside["travel"], share)
    translations = np.repeat(
        trained.model.proportions.numpy(values.beside["offsets"])[:, None], len(EVEN), axis=1
    )
    translations[:, :, 0] = path
    durations = np.exp(values.beside["duration"][:, 0])
    return _motions(recipe, trained, rotations, translations, durations)


def _between(table: Floats, place: Floats) -> Floats:
    """Rows (Q, S, D) of tables (Q, T, D) at frames (Q, S)."""
    before = np.minimum(place.astype(np.int64), table.shape[1] - 2)
    share = (place - before)[..., None]
    first = np.take_along_axis(table, before[..., None], axis=1)
    second = np.take_along_axis(table, before[..., None] + 1, axis=1)
    return (1.0 - share) * first + share * second
