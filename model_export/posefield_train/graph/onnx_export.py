"""Export of a trained model to one file, after a parity check."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from posefield import __version__
from posefield.common.errors import ExportRefused
from posefield.common.units import ClipPositions, Floats, PerClip
from posefield.inference import onnx_runtime, reduced_motion, session
from posefield.inference.reduced_motion import Deviations
from posefield.inference.session import Session
from posefield.model_file import model_card
from posefield.model_file.model_card import ModelCard, rounded
from posefield_train.graph import levels, trained_card
from posefield_train.graph.float_model import FloatModel, ModelOutputs
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.jobs import single_threaded
from posefield_train.kriging import kriging_bank, performer_means, sample_points
from posefield_train.tensor import truncation_error
from posefield_train.tensor.hosvd import TuckerTensor

POINTS, BATCH = 10_000, 1_000
# Largest distance of a joint of the graph from the reference's, m.
PARITY_LIMIT = 1e-4
# Largest difference of the probability of a contact.
CONTACT_LIMIT = 2e-3


def check_parity(model: FloatModel, content: bytes, card: ModelCard) -> float:
    """Return the largest joint distance, m, between file and reference at random inputs.

    Every level is checked. Raises ExportRefused, naming the joint and the input, if the distance
    exceeds PARITY_LIMIT.
    """
    opened = session.open_bytes(content, f"{card.name}.onnx")
    rng = np.random.Generator(np.random.PCG64(10_000))
    worst = 0.0
    for question in range(POINTS // BATCH):
        inputs = _draw_inputs(rng, model, card, question % len(card.levels))
        gaps = _joint_distances(model, opened, inputs)
        _check_contacts(model, opened, inputs)
        at = np.unravel_index(int(np.argmax(gaps)), gaps.shape)
        worst = max(worst, float(gaps[at]))
        if worst > PARITY_LIMIT:
            point_names = [*card.skeleton.names, *(curve.name for curve in card.curves)]
            notes = card.diagnostics.get("notes", ())
            doubts = [note for note in notes if note.endswith("?")]
            raise ExportRefused(
                f"the graph puts {point_names[at[2]]} {100 * worst:.4f} cm from where "
                f"the reference does, expected at most {100 * PARITY_LIMIT:g} cm; at "
                f"{inputs.said(card, int(at[0]))}. Fewer controls, or a larger nugget, "
                f"condition it better{''.join(f'; {doubt}' for doubt in doubts)}"
            )
    return worst


@dataclass(frozen=True)
class _ParityInputs:
    """Inputs of the parity check.

    points: controls (B, d) in their own units. times: (B, 1), s. labels: (B, p). level: of detail.
    All are float32 values, the only ones that the graph can receive.
    """

    points: Floats
    times: Floats
    labels: Floats
    level: int

    def said(self, card: ModelCard, row: int) -> str:
        """Describe one of the inputs in words."""
        controls = (control.name for control in card.controls)
        point = dict(zip(controls, self.points[row].tolist(), strict=True))
        names = [name for label_set in card.labels for name in label_set.names]
        label_text = "".join(f"{names[i]}, " for i in np.flatnonzero(self.labels[row]))
        return f"{label_text}{point}, {self.times[row, 0]:.3f} s, level {self.level}"


def _draw_inputs(
    rng: np.random.Generator, model: FloatModel, card: ModelCard, level: int
) -> _ParityInputs:
    """Draw random controls, labels and times of their clips.

    In each label set no name is as likely as each of the names.
    """
    low, high = ([getattr(c, end) for c in card.controls] for end in ("minimum", "maximum"))
    points = rng.uniform(low, high, (BATCH, len(low))).astype(np.float32).astype(np.float64)
    weights = kriging_bank.random_labels(rng, model.bank.labels, BATCH)
    labels = np.hstack([np.zeros((BATCH, 0)), *weights])
    durations = model.durations(points, labels)
    times = rng.uniform(0.0, 1.0, (BATCH, 1)) * durations[:, None]
    return _ParityInputs(points, times.astype(np.float32).astype(np.float64), labels, level)


def _joint_distances(model: FloatModel, opened: Session, inputs: _ParityInputs) -> Floats:
    """Return distances (B, 1, J + C), m, between joints and curves of graph and reference."""
    question, card = (inputs.points, inputs.times), opened.card
    parents, names = card.skeleton.parents, onnx_runtime.outputs(card)
    expected = model.evaluate(*question, inputs.labels, inputs.level).points(parents, card.curves)
    answers = opened.run(*question, *names, labels=inputs.labels, level=inputs.level)
    points = ModelOutputs(*answers).points(parents, card.curves)
    return np.asarray(np.linalg.norm(points - expected, axis=-1))


def _check_contacts(model: FloatModel, opened: Session, inputs: _ParityInputs) -> None:
    """Raise ExportRefused where the graph's contacts differ from the reference's."""
    question, level = (inputs.points, inputs.times), inputs.level
    expected = model.evaluate(*question, inputs.labels, level).contacts
    if expected is None:
        return
    (contacts,) = opened.run(*question, onnx_runtime.CONTACTS, labels=inputs.labels, level=level)
    gaps = np.abs(contacts - expected)
    if gaps.max() > CONTACT_LIMIT:
        row = int(np.unravel_index(int(np.argmax(gaps)), gaps.shape)[0])
        raise ExportRefused(
            f"the graph's probability of a contact is {gaps.max():.5f} off the reference's, "
            f"expected at most {CONTACT_LIMIT:g}; at {inputs.said(opened.card, row)}"
        )


MAX_HARMONICS = 30
"""Harmonics of the detail. Thirty reach 97 % of a walk's acceleration."""
DRAWS, ROUNDS = 2, 3
"""Draws of each clip and rounds of the search for the gain."""
REPEAT_LAG = 0.1
"""Distance of controls, root mean square in half-ranges, at which repeats count less (Gaussian)."""
ENOUGH = 0.99
"""Acceleration of left-out predictions over captured, from which on no detail is stored."""
JITTER = 1e-9
"""Added to a covariance that clips of one duration or without turns make singular."""


@dataclass(frozen=True)
class DetailFit:
    """Detail of a cycle.

    deviations: of the harmonics, with the gain. without, sampled: acceleration of left-out
    predictions over that of captured clips, without detail and with it.
    """

    deviations: Deviations
    without: float
    sampled: float

    @property
    def facts(self) -> dict[str, float]:
        """Return the facts of the model card."""
        harmonics, directions = self.deviations.shape
        sizes = {"harmonics": harmonics, "directions": directions}
        return sizes | {"acceleration": rounded(self.without), "sampled": rounded(self.sampled)}


@dataclass(frozen=True)
class TakeStatistics:
    """Statistics of the takes of a model.

    root: `take_root`. detail: None for none. duration: `repeat_duration`.
    """

    root: tuple[tuple[float, ...], ...] = ()
    detail: DetailFit | None = None
    duration: float = 0.0

    def on_card(self, card: ModelCard) -> ModelCard:
        """Return the card with the statistics."""
        stored = reduced_motion.to_bytes(self.detail.deviations) if self.detail else b""
        facts = {"detail": self.detail.facts} if self.detail else {}
        return replace(
            card,
            making=replace(
                card.making, take_root=self.root, detail=stored, repeat_duration=self.duration
            ),
            diagnostics={**card.diagnostics, **facts},
        )


def estimate(trained: TrainedModel) -> TakeStatistics:
    """Return the statistics of a trained model."""
    return TakeStatistics(take_root(trained), fit_detail(trained), repeat_duration(trained))


def repeat_duration(trained: TrainedModel) -> float:
    """Return the standard deviation of the logarithm of the duration of repeats; 0 for a cycle.

    It is a semivariance at small lags (Matheron 1963): half the squared differences of clips of one
    performer in other recordings, weighted by the likeness of their controls. The left-out
    residuals, which also have the errors of the prediction, count as one more pair, and are its
    upper limit.
    """
    if "travel" in trained.residuals:
        return 0.0
    clips, samples = trained.listed, trained.samples
    recordings = sample_points.recording_numbers(trained.examples)
    labels = np.array(samples.label_indices).reshape(-1, len(recordings))
    first, second = (clips[side] for side in np.triu_indices(len(clips), 1))
    repeats = (labels[:, first] == labels[:, second]).all(axis=0)
    repeats &= recordings[first] != recordings[second]
    first, second = first[repeats], second[repeats]
    points, logarithms = samples.points[:, : samples.controls], np.log(trained.aligned.durations)
    lags = np.square(points[first] - points[second]).mean(axis=1)
    weights = np.exp(-0.5 * lags / REPEAT_LAG**2)
    halves = 0.5 * np.square(logarithms[first] - logarithms[second])
    largest = float(np.mean(np.square(trained.residuals["duration"])))
    variance = (weights @ halves + largest) / (weights.sum() + 1.0)
    return rounded(np.sqrt(min(variance, largest)))


def take_root(trained: TrainedModel) -> tuple[tuple[float, ...], ...]:
    """Return the last rows (4, r3 + 4) of a root of the covariance of residuals.

    The residuals are those of the coefficients, then of log duration and travel, scaled to a sigma
    of one metre. Empty for motions without cycle. With it a take's steps and its travel agree.
    """
    if "travel" not in trained.residuals:
        return ()
    duration_and_travel = np.hstack([trained.residuals["duration"], trained.residuals["travel"]])
    residuals = np.hstack(
        [_left_out(trained) @ trained.model.decoder.reduced.bases[2], duration_and_travel]
    )
    standard = residuals / np.sqrt(trained.model.bank.sill * trained.pose.variances)[:, None]
    covariance = standard.T @ standard / len(standard)
    sizes = np.sqrt(np.diagonal(covariance)) + JITTER
    root = np.linalg.cholesky(covariance / np.outer(sizes, sizes) + JITTER * np.eye(len(sizes)))
    rows = (sizes[:, None] * root)[-duration_and_travel.shape[1] :]
    return tuple(tuple(map(rounded, row)) for row in rows)


def fit_detail(trained: TrainedModel) -> DetailFit | None:
    """Return the detail of a cycle; None for other motions, and where none is missing.

    Its gain makes the acceleration of left-out predictions that of the captured clips.
    """
    if "travel" not in trained.residuals:
        return None
    deviations = _harmonic_deviations(trained)
    captured = _accelerations(trained, trained.tensor.values).mean()
    # The left-out predictions of the finest level.
    first, times, samples = trained.model.decoder.reduced.bases
    bases = first, times, samples - _left_out(trained) @ samples
    predicted = TuckerTensor(trained.model.decoder.reduced.core, bases).restored()
    without = _accelerations(trained, predicted).mean() / captured
    gain = reached = 1.0
    for _ in range(ROUNDS):
        detailed = [_sampled(trained, predicted, gain * deviations, draw) for draw in range(DRAWS)]
        reached = (
            float(np.mean([_accelerations(trained, sample).mean() for sample in detailed]))
            / captured
        )
        if without >= ENOUGH or reached <= without:
            return None
        last, gain = gain, gain * np.sqrt((1.0 - without**2) / (reached**2 - without**2))
    return DetailFit(last * deviations, float(without), reached)


def _left_out(trained: TrainedModel) -> Floats:
    """Return the matrix (N, N) from sample values to leave-one-out residuals."""
    return performer_means.leave_out(trained.pose, trained.samples)


def _harmonic_deviations(trained: TrainedModel) -> Deviations:
    """Return standard deviations (H, r1) of the residuals' harmonics, pooled over all clips.

    Of the part alone that the time functions cannot follow: takes vary the rest.
    """
    first, times, _ = trained.model.decoder.reduced.bases
    residuals = np.tensordot(first.T, trained.full.slices(trained.pose.residuals), axes=1)
    residuals = residuals - np.einsum("dtn,tk,sk->dsn", residuals, times, times)
    # The last frame is the first one of the next cycle.
    period = residuals.shape[1] - 1
    harmonics = min(MAX_HARMONICS, (period - 1) // 2)
    waves = reduced_motion.waves(period + 1, harmonics)[:-1]
    amplitudes = 2.0 / period * np.einsum("dtn,tw->wdn", residuals[:, :-1], waves)
    powers = np.mean(np.square(amplitudes), axis=2).reshape(2, harmonics, -1)
    return np.asarray(np.sqrt(powers.mean(axis=0)))


def _sampled(trained: TrainedModel, predicted: Floats, deviations: Deviations, draw: int) -> Floats:
    """Return predictions (D', T, N) with detail, a seed of its own for each clip and draw."""
    frames, clips = predicted.shape[1:]
    seeds = 1 + draw * clips + np.arange(clips)
    detail = [reduced_motion.sample(deviations, frames, int(seed)) for seed in seeds]
    first = trained.model.decoder.reduced.bases[0]
    return predicted + np.tensordot(first, np.stack(detail, axis=2), axes=(1, 1))


def _accelerations(trained: TrainedModel, values: Floats) -> PerClip:
    """Return the mean acceleration (N,), m/s², of the joints relative to the root.

    values: whitened, on canonical time (D', T, N), which is taken as even time.
    """
    parents = trained.skeleton.parents
    offsets = np.stack([example.offsets for example in trained.examples])
    points = truncation_error.positions(trained.tensor, values, parents, offsets)
    joints: ClipPositions = points[:, :, : len(parents)]
    second = np.diff(joints - joints[:, :, :1], 2, axis=1)
    rates = (values.shape[1] - 1) / trained.aligned.durations
    return np.asarray(np.mean(np.linalg.norm(second, axis=-1), axis=(1, 2)) * rates**2)


@dataclass(frozen=True)
class ExportedModel:
    """An exported model.

    model: of all levels. content: bytes of its file. card: its model card. parity: largest joint
    error of the parity check, m.
    """

    model: FloatModel
    content: bytes
    card: ModelCard
    parity: float


@single_threaded()
def export_model(trained: TrainedModel) -> ExportedModel:
    """Return the exported model with all its levels; equal data give equal bytes.

    Raises TrainingError for levels of detail that cannot be made, and ExportRefused if the parity
    check fails.
    """
    notes = trained_card.training_notes(trained)
    model, model_levels = levels.build_levels(trained)
    statistics = estimate(trained)

    def make_card(parity: float) -> ModelCard:
        card = trained_card.build_card(trained, model_levels, notes, parity)
        return statistics.on_card(card)

    return check_and_export(model, make_card)


def check_and_export(model: FloatModel, make_card: Callable[[float], ModelCard]) -> ExportedModel:
    """Check a model of all its levels and return it with its file.

    make_card: makes the model card from the parity error, m. Raises ExportRefused as
    `check_parity` does.
    """
    about = producer()
    # The card contains the parity error, so the weights are checked with a draft of the card.
    draft = make_card(0.0)
    parity = check_parity(model, model.onnx(model_card.dump(draft), about), draft)
    card = make_card(parity)
    return ExportedModel(model, model.onnx(model_card.dump(card), about), card, parity)


def producer() -> dict[str, str]:
    """Return the names that a file gives of the program that made it."""
    return {"producer_name": "posefield", "producer_version": __version__}
