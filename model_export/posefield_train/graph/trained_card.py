"""Model card of a trained model."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from importlib.metadata import version
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from posefield.common.units import Floats, Frames
from posefield.kriging import support
from posefield.kriging.kriging_model import Hyper, LabelKernel
from posefield.kriging.support import half_ranges
from posefield.model_file.model_card import (
    ACCELERATION_RATE,
    USUAL_PERCENTILE,
    CapturedAcceleration,
    Control,
    LabelSet,
    Level,
    ModelCard,
    Preset,
    TrainingParameters,
    mean_accelerations,
    rounded,
)
from posefield.motion.clip import Clip
from posefield_train.align import phase_alignment
from posefield_train.graph import captured_hinges, truncation_cost
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import sample_points
from posefield_train.kriging.kriging_bank import EVENT
from posefield_train.kriging.sample_points import LabelNames, SamplePoints
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.source import common_topology, measured_controls
from posefield_train.source.canonical import Finding
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.tensor import truncation_error

MOST_ALIKE = 3
"""Clips that are noted one by one for the same kind of finding."""
SAME_MOTION = 0.7
"""Share of the differences between any clips from which clips of equal controls differ as much."""
LEAST_DIFFERENCE = 0.01
"""Smallest differences between clips of equal controls that are noted, m."""

WASHED_OUT = 0.6
"""Share of the captured acceleration that left-out predictions have, below which it is noted."""

LARGEST_DISAGREEMENT = 0.02
"""Difference of the errors of two tunings of a large family from which it is noted."""

MEANINGS = {
    "far": "close to half a turn from the family's mean",
    "wrap": "followed past half a turn from the family's mean",
    "jump": "jumps between two frames taken out",
    "twist": "jumps about the bone moved to the joint's children",
    "flip": "half turns taken out",
}
"""Kinds of findings in joints, those that say the most about the model first."""


def training_notes(trained: TrainedModel) -> list[str]:
    """Return all notes of a training, the most consequential first."""
    return [
        *trained.outlier_notes(),
        *movement_notes(trained),
        *repeat_notes(trained),
        *disagreement_notes(trained),
        *sample_points.data_notes(trained.recipe, trained.examples),
        *trained.notes,
        *finding_notes(trained.findings, trained.examples, trained.skeleton.names),
        *phase_alignment.shift_notes(trained.examples),
        *trained.contact_notes,
        *trained.soles.notes,
    ]


def movement_notes(trained: TrainedModel) -> list[str]:
    """Return a note if movements average out in left-out predictions; none for a cycle.

    A cycle has detail in place of what is lost.
    """
    if "travel" in trained.residuals or trained.acceleration >= WASHED_OUT:
        return []
    return [
        f"predictions of left-out clips have {100 * trained.acceleration:.0f} % of the captured "
        "acceleration: movements whose phase or number differs from clip to clip average out; "
        "landmarks bring phases together, and posefield discover --like cuts single repetitions"
    ]


def disagreement_notes(trained: TrainedModel) -> list[str]:
    """Return a note if parameters tuned on two draws of a large family predict unequally well."""
    disagreement = trained.pose.disagreement
    if disagreement is None or disagreement <= LARGEST_DISAGREEMENT:
        return []
    tuned = sample_points.tuned_count(len(trained.examples))
    return [
        f"parameters tuned on two draws of {tuned} of {len(trained.examples)} clips differ: with "
        f"one a clip left out lies {100 * disagreement:.1f} % farther away than with the other, "
        "which is used"
    ]


def repeat_notes(trained: TrainedModel) -> list[str]:
    """Return a note if clips of equal controls differ about as much as any clips do."""
    tensor = trained.tensor
    motions = trained.values["pose"] / np.sqrt(tensor.weight * tensor.values.shape[1])
    points = trained.samples.points
    _, groups, counts = np.unique(points, axis=0, return_inverse=True, return_counts=True)
    groups = np.ravel(groups)
    repeated = counts[groups] > 1
    if not repeated.any():
        return []
    means = np.stack([motions[groups == group].mean(axis=0) for group in range(len(counts))])
    freedoms = repeated.sum() - np.sum(counts > 1)
    within = float(np.sqrt(np.sum(np.square(motions - means[groups])) / freedoms))
    about = motions - motions.mean(axis=0)
    spread = float(np.sqrt(np.sum(np.square(about)) / (len(motions) - 1)))
    if within < max(SAME_MOTION * spread, LEAST_DIFFERENCE):
        return []
    example = trained.examples[int(np.flatnonzero(repeated)[0])]
    return [
        f"{repeated.sum()} of {len(motions)} clips share their controls with others, such as "
        f"{example.row.named}, and differ from them by {100 * within:.1f} cm where all clips "
        f"differ by {100 * spread:.1f} cm: a control that tells them apart may be missing"
    ]


def finding_notes(
    findings: Sequence[Finding], examples: Sequence[Example], names: Sequence[str]
) -> list[str]:
    """Return notes on joints by kind of finding: one per clip if they are few, else one in all."""
    notes = []
    for kind, meaning in MEANINGS.items():
        of_kind = [finding for finding in findings if finding.kind == kind]
        clips = sorted({finding.clip for finding in of_kind})
        if len(clips) > MOST_ALIKE:
            largest = max(of_kind, key=lambda finding: finding.angle)
            notes.append(
                f"{meaning} in {len(clips)} of {len(examples)} clips, the largest in "
                f"{examples[largest.clip].row.named}: {_turned(largest, names)}"
            )
            continue
        for clip in clips:
            entries = ", ".join(_turned(turned, names) for turned in of_kind if turned.clip == clip)
            notes.append(f"{examples[clip].row.named}: {meaning}: {entries}")
    return notes


def _turned(finding: Finding, names: Sequence[str]) -> str:
    return f"{names[finding.joint]} by {np.degrees(finding.angle):.0f} degrees"


# A control with more distinct values than this is continuous, and they are not listed.
MAX_LISTED_VALUES = 10


def build_card(
    trained: TrainedModel, levels: tuple[Level, ...], notes: list[str], parity: float
) -> ModelCard:
    """Return the card of a trained model. parity: largest joint error of the parity check, m."""
    recipe, examples, listed = trained.recipe, trained.examples, trained.listed
    durations = trained.aligned.durations
    listed_examples = [examples[clip] for clip in listed]
    roles = _roles(recipe, trained)
    return ModelCard(
        name=recipe.name,
        description=recipe.description,
        controls=_controls(recipe, trained),
        skeleton=trained.skeleton,
        cyclic=recipe.motion.cyclic,
        root=recipe.motion.root,
        rate=float(np.median([example.clip.rate for example in examples])),
        frames=recipe.motion.frames,
        samples=len(listed_examples),
        levels=levels,
        durations=(float(durations.min()), float(durations.max())),
        examples=tuple(tuple(map(float, example.controls)) for example in listed_examples),
        labels=card_labels(trained.model.bank.labels, trained.samples.subset(listed)),
        feet=tuple(map(trained.skeleton.names.index, recipe.motion.feet)),
        diagnostics=_diagnostics(trained, notes, parity),
        provenance=_provenance(recipe, examples),
        sources=tuple(example.row.source for example in listed_examples),
        kriging=plain_parameters(trained.pose.hyper),
        roles=roles,
        left_out=tuple(map(rounded, np.sqrt(trained.left_out_errors[listed]))),
        event=truncation_error.event(recipe, examples),
        beside=_covariance_root(trained),
        joint_sigma=tuple(round(float(share), 2) for share in trained.joints),
        making=_making(recipe, trained),
        presets=tuple(
            Preset(name, preset.values, preset.labels) for name, preset in recipe.presets.items()
        ),
        curves=trained.tensor.curves,
        contacts=trained.contacts.statistics if trained.contacts else (),
        captured_acceleration=captured_acceleration(examples),
        hinges=captured_hinges.measure_hinges(examples, roles),
        robot=examples[0].robot,
        soles=trained.soles.points,
    )


def _roles(recipe: Recipe, trained: TrainedModel) -> dict[str, str]:
    if recipe.skeleton.is_unified:
        return common_topology.model_roles(trained.skeleton.names)
    return {str(role): joint for role, joint in recipe.roles.items()}


def captured_acceleration(examples: Sequence[Example]) -> CapturedAcceleration | None:
    """Return the accelerations of captured clips; None for clips of less than three frames.

    Cycles count as they were before their seams were closed, which bends their ends.
    """
    accelerations = [clip_accelerations(example.captured or example.clip) for example in examples]
    values = np.concatenate(accelerations)
    if len(values) == 0:
        return None
    return CapturedAcceleration(
        rounded(np.median(values)), rounded(np.percentile(values, USUAL_PERCENTILE))
    )


def clip_accelerations(clip: Clip) -> Frames:
    """Return the accelerations (F,) of a clip in its own time at `RATE`, m/s².

    Between its frames the joints move along cubic splines: straight lines would have all of their
    acceleration in the frames.
    """
    positions = clip.positions()
    positions = positions - positions[:, :1]
    step = clip.rate / ACCELERATION_RATE
    # Tolerance of a millionth of a frame for the rounding of products.
    times = step * np.arange(int((len(positions) - 1) / step + 1e-6) + 1)
    if step == round(step):
        sampled = positions[:: round(step)]
    else:
        sampled = CubicSpline(np.arange(len(positions)), positions, axis=0)(times)
    return mean_accelerations(sampled, ACCELERATION_RATE)


def _covariance_root(trained: TrainedModel) -> tuple[tuple[float, ...], ...]:
    """Return the root of the covariance of log duration and travel residuals.

    The residuals are scaled to a sigma of one metre.
    """
    if "travel" not in trained.residuals:
        return ()
    strays = np.hstack([trained.residuals["duration"], trained.residuals["travel"]])
    sigmas = np.sqrt(trained.model.bank.sill * trained.pose.variances)
    standard = strays / sigmas[:, None]
    covariance = standard.T @ standard / len(standard)
    # The covariance is singular for clips of one duration or without turns.
    root = np.linalg.cholesky(covariance + 1e-9 * np.eye(len(covariance)))
    return tuple(tuple(map(rounded, row)) for row in root)


def _making(recipe: Recipe, trained: TrainedModel) -> TrainingParameters:
    marks = [example.landmarks for example in trained.examples]
    times = np.array(marks).reshape(len(marks), -1).mean(axis=0)
    bank = trained.model.bank
    fields = {**bank.other_models, EVENT: bank.event}.items()
    return TrainingParameters(
        {
            name: kriging_settings(field.hyper)
            for name, field in fields
            if isinstance(field, UniversalKriging)
        },
        dict(zip(recipe.landmark_names, map(float, times), strict=True)),
        {joint: weight for joint, weight in recipe.motion.joint_weights.items() if weight != 1.0},
        recipe.motion.cyclic and recipe.alignment.begin == "in_phase",
        _recordings([trained.examples[clip] for clip in trained.listed]),
        trained.examples[0].facing,
        chart=trained.tensor.chart.chart,
    )


def card_labels(label_names: LabelNames, samples: SamplePoints) -> tuple[LabelSet, ...]:
    """Return the label sets of a card from their names and the samples."""
    pairs = zip(label_names.items(), samples.label_indices, strict=True)
    return tuple(LabelSet(name, names, tuple(indices.tolist())) for (name, names), indices in pairs)


def _recordings(examples: Sequence[Example]) -> tuple[int, ...]:
    """Return the number (N,) of each example's recording; empty where each file is one."""
    recordings = sample_points.recording_numbers(examples)
    files = np.unique([example.row.file.name for example in examples], return_inverse=True)[1]
    pairs = len({*zip(recordings.tolist(), files.tolist(), strict=True)})
    one_each = pairs == len(np.unique(recordings)) == len(np.unique(files))
    return () if one_each else tuple(recordings.tolist())


def kriging_settings(hyper: Hyper) -> tuple[float, ...]:
    """Return nugget, trend and offsets with six digits, as adaptation reads them."""
    offsets = (kernel.offset for kernel in hyper.labels)
    return tuple(float(f"{x:.6g}") for x in (hyper.nugget, hyper.trend, *offsets))


def _controls(recipe: Recipe, trained: TrainedModel) -> tuple[Control, ...]:
    values = np.stack([trained.examples[clip].controls for clip in trained.listed])
    landmarks = np.array([example.landmarks for example in trained.examples])
    controls = []
    typical = typical_controls(values)
    for control, column, default in zip(recipe.controls, values.T, typical, strict=True):
        distinct = np.unique(column)
        controls.append(
            Control(
                control.name,
                control.unit,
                control.description,
                float(distinct[0]),
                float(distinct[-1]),
                float(default),
                tuple(map(float, distinct)) if len(distinct) <= MAX_LISTED_VALUES else (),
                measured_controls.card_measure(recipe, control, trained.skeleton, landmarks),
            )
        )
    return tuple(controls)


def typical_controls(values: Floats) -> Floats:
    """Return the controls (d,) of the medoid of captured clips with controls (N, d)."""
    points = half_ranges(values, values.min(axis=0), values.max(axis=0))
    return values[support.medoid(points)]


def _diagnostics(trained: TrainedModel, notes: list[str], parity: float) -> dict[str, Any]:
    """Return training statistics, in metres and shares, rounded."""
    cut = {
        f"truncation_{k}_m": v
        for k, v in asdict(trained.truncation_errors).items()
        if v is not None
    }
    ranks, controls = trained.model.decoder.reduced.core.shape, len(trained.model.bank.low)
    compression = asdict(
        truncation_cost.shape_compression(trained.tensor.values.shape, ranks, controls)
    )
    hyper = trained.pose.hyper
    contacts = {}
    if trained.contacts is not None:
        accuracy = asdict(trained.contacts.accuracy).items()
        contacts["contacts"] = {name: rounded(value) for name, value in accuracy}
    return {
        **{name: rounded(distance) for name, distance in cut.items()},
        "compression": {name: rounded(ratio) for name, ratio in compression.items()},
        "leave_one_out_rms_m": rounded(np.sqrt(trained.left_out_errors.mean())),
        "explained": {name: rounded(share) for name, share in trained.explained.items()},
        "covariance": hyper.covariance,
        "drift": list(hyper.drifts),
        "scales": [rounded(scale) for scale in hyper.scales],
        "nugget": rounded(hyper.nugget),
        "trend": rounded(hyper.trend),
        "labels": {
            name: {"correlation": rounded(value.correlation), "offset": rounded(value.offset)}
            for name, value in zip(trained.model.bank.labels, hyper.labels, strict=True)
        },
        "tensor": [*trained.tensor.values.shape[:2], len(trained.listed)],
        **_large_family(trained),
        "parity_m": float(f"{parity:.1e}"),
        "notes": list(notes),
        **contacts,
    }


def _large_family(trained: TrainedModel) -> dict[str, Any]:
    """Return the numbers of inducing and tuned clips of a large family; empty for others."""
    if trained.samples.inducing is None:
        return {}
    disagreement = trained.pose.disagreement
    tuned = {} if disagreement is None else {"disagreement": rounded(disagreement)}
    clips = len(trained.examples)
    counts = {"clips": clips, "tuned": sample_points.tuned_count(clips)}
    return {"projected": {**counts, "inducing": len(trained.listed), **tuned}}


def plain_parameters(hyper: Hyper) -> Hyper:
    """Return the parameters with Python floats, which a model card can hold."""
    return replace(
        hyper,
        nugget=float(hyper.nugget),
        trend=float(hyper.trend),
        labels=tuple(
            LabelKernel(kernel.count, float(kernel.correlation), float(kernel.offset))
            for kernel in hyper.labels
        ),
    )


def _provenance(recipe: Recipe, examples: Sequence[Example]) -> dict[str, Any]:
    return {
        "licence": recipe.licence,
        "recipe_sha256": hashlib.sha256(recipe.model_dump_json().encode()).hexdigest(),
        "data_sha256": data_digest({str(e.row.file.name): e for e in examples}),
        "clips": len(examples),
        "versions": {name: version(name) for name in ("posefield", "numpy", "scipy", "onnx")},
    }


def data_digest(files: Mapping[str, Example]) -> str:
    """Return one SHA-256 digest over the names and contents of files, sorted by name.

    files: clips by the names of their motion files. Files of curves count as well.
    """
    total = hashlib.sha256()
    locations = {name: example.row.file for name, example in files.items()}
    curves = (example.row.curve_place for example in files.values())
    locations |= {location.name: location for location in curves if location is not None}
    for name in sorted(locations):
        with locations[name].open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").digest()
        total.update(name.encode() + b"\0" + digest)
    return total.hexdigest()
