"""Model file of an adapted model: levels of detail, model card and parity check."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from typing import Any

import numpy as np

from posefield.common.errors import InvalidField, did_you_mean
from posefield.common.units import Floats
from posefield.inference import reduced_motion
from posefield.model_file.model_card import PERFORMER, Control, LabelSet, Level, ModelCard, rounded
from posefield_train.adapt import adaptation, canonical_clips, new_clips
from posefield_train.adapt.adaptation import AdaptedModel
from posefield_train.adapt.model_reconstruction import ReconstructedModel
from posefield_train.graph import (
    captured_hinges,
    levels,
    onnx_export,
    trained_card,
    truncation_cost,
)
from posefield_train.graph.float_model import FloatModel
from posefield_train.graph.levels import FINALS, TEST_INPUTS, LevelBuilder, LevelTest
from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.graph.trained_card import MAX_LISTED_VALUES
from posefield_train.jobs import single_threaded
from posefield_train.kriging import kriging_bank, sample_points
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.source import clip_table
from posefield_train.source.ingest import Example
from posefield_train.tensor import truncation_error
from posefield_train.tensor.truncation_error import EventFrame, TruncationReference


@dataclass(frozen=True)
class NewPerformer:
    """Clips of a new performer.

    performer: name. examples: the clips. licence: of the clips. notes: findings of the import.
    """

    performer: str
    examples: Sequence[Example]
    licence: str
    notes: Sequence[str] = ()


def check_name(card: ModelCard, performer: str) -> None:
    """Raise InvalidField for a model without performers, or for a known or invalid name."""
    if not card.performers:
        raise InvalidField(
            "performer", f"model {card.name} tells no performers apart, expected one that does"
        )
    if performer in card.performers:
        performers = ", ".join(card.performers)
        raise InvalidField("performer", f"{performer!r} is known already, as are: {performers}")
    if not clip_table.is_label(performer):
        raise InvalidField("performer", f"{performer!r}, expected {clip_table.LABEL_FORM}")


def check_labels(card: ModelCard, labels: Mapping[str, str]) -> None:
    """Raise InvalidField for names of other label sets than the model's, or unknown ones.

    Names of further label sets have to be known: only the performer is new.
    """
    names_by_set = {
        label_set.name: label_set.names for label_set in card.labels if label_set.name != PERFORMER
    }
    for name, label in labels.items():
        if name not in names_by_set:
            suggestion = f"{name!r}{did_you_mean(name, names_by_set)}"
            raise InvalidField("label", f"{suggestion}, expected {_one_of(names_by_set)}")
        if label not in names_by_set[name]:
            suggestion = f"{name}={label}{did_you_mean(label, names_by_set[name])}"
            raise InvalidField("label", f"{suggestion}, expected {_one_of(names_by_set[name])}")


def _one_of(names: Collection[str]) -> str:
    return f"one of {', '.join(names)}" if names else "none: there are no label sets but performers"


def export_adapted(reopened: ReconstructedModel, newcomer: NewPerformer) -> ExportedModel:
    """Return the exported model with the new performer; equal inputs give equal bytes.

    Raises InvalidField for an invalid or known name, TrainingError for clips of another action, and
    ExportRefused as `onnx_export.check_and_export` does.
    """
    check_name(reopened.card, newcomer.performer)
    with single_threaded():
        shifted = canonical_clips.align_phase(reopened.adaptable, newcomer.examples)
        examples = new_clips.remeasure(reopened, newcomer.examples, shifted)
        clips = canonical_clips.to_canonical(reopened.adaptable, examples)
        canonical_clips.refuse_outliers(reopened.adaptable, clips)
        adapted = adaptation.solve(reopened.adaptable, clips, newcomer.performer)
        model, model_levels = _build_levels(reopened, adapted)
        return onnx_export.check_and_export(
            model, lambda parity: _card(reopened, adapted, newcomer, model_levels, parity)
        )


def _build_levels(
    reopened: ReconstructedModel, adapted: AdaptedModel
) -> tuple[FloatModel, tuple[Level, ...]]:
    """Build the levels of detail with the error bounds of the parent model's levels.

    Joints are compared with the finest level; the errors of the parent's finest level are added.
    """
    builder = _level_builder(reopened, adapted)
    finest, *coarser = reopened.card.levels
    model = builder.model
    for level in coarser:
        allowed = np.sqrt(max(level.rms**2 - finest.rms**2, finest.rms**2))
        model = builder.with_coarser_level(model, level.joints, float(allowed))
    count = len(model.decoder.level_sizes)
    built = (builder.level(model, level) for level in range(count))
    return model, tuple(_add_parent_errors(level, finest) for level in built)


def _add_parent_errors(level: Level, finest: Level) -> Level:
    """Add the errors of the parent's finest level in quadrature; the two are independent."""

    def both(name: str) -> float:
        return rounded(np.hypot(getattr(level, name), getattr(finest, name)))

    return replace(
        level,
        rms=both("rms"),
        p99=both("p99"),
        max=both("max"),
        pose=both("pose"),
        effector=None if level.effector is None else both("effector"),
    )


def _level_builder(reopened: ReconstructedModel, adapted: AdaptedModel) -> LevelBuilder:
    adaptable, extended = reopened.adaptable, adapted.extended
    parents, moment = adaptable.skeleton.parents, _event_frame(reopened.card)
    bank = kriging_bank.sort_samples(adapted.model.bank)
    offsets = adapted.model.proportions.numpy(adapted.model.bank.sample_values("offsets"))
    points = truncation_error.positions(extended.tensor, extended.tensor.values, parents, offsets)
    pose = adapted.model.bank.pose.samples
    labels = tuple(map(len, adapted.model.bank.labels.values()))
    samples = SamplePoints(pose, len(adapted.model.bank.low), np.arange(len(pose)), labels)
    uncut = levels.untruncated(adapted.model, extended.full, samples, extended.full.bases[2])

    def exam(questions: int) -> LevelTest:
        return levels.level_test_against(uncut, parents, moment, questions)

    weights = np.append(adaptable.joint_weights, np.ones(len(extended.tensor.curves)))
    return LevelBuilder(
        extended.full,
        replace(adapted.model, bank=bank),
        {"rms": 1.0},
        TruncationReference(extended.tensor, parents, offsets, weights, moment, points),
        exam(TEST_INPUTS),
        exam(FINALS),
        kriging_bank.thinning_data(bank),
    )


def _event_frame(card: ModelCard) -> EventFrame | None:
    if card.event is None:
        return None
    return EventFrame(card.event.joint, round((card.frames - 1) * card.event.share))


def _card(
    reopened: ReconstructedModel,
    adapted: AdaptedModel,
    newcomer: NewPerformer,
    levels: tuple[Level, ...],
    parity: float,
) -> ModelCard:
    """Return the parent's card updated for the new performer.

    The rest pose of the skeleton stays that of the parent, so bound characters stay valid. Captured
    accelerations stay those of the parent's clips.
    """
    old, bank, clips = reopened.card, adapted.model.bank, adapted.new_clips.examples
    new_controls = tuple(tuple(map(float, clip.controls)) for clip in clips)
    seconds = (*old.durations, *adapted.new_clips.aligned.durations.tolist())
    left_out = (*old.left_out, *map(rounded, np.sqrt(adapted.left_out_errors)))
    fields = bank.other_models.items()
    fields_settings = {
        n: trained_card.kriging_settings(f.hyper)
        for n, f in fields
        if isinstance(f, UniversalKriging)
    }
    return replace(
        old,
        controls=_controls(old.controls, np.array([*old.examples, *new_controls])),
        samples=len(bank.pose.samples),
        levels=levels,
        durations=(min(seconds), max(seconds)),
        examples=(*old.examples, *new_controls),
        labels=_labels(adapted),
        sources=(*old.sources, *(clip.row.source for clip in clips)),
        left_out=left_out,
        kriging=trained_card.plain_parameters(bank.pose.hyper),
        # The root and the detail are in the parent's bases, which the new clips change.
        making=replace(
            reopened.card.making,
            fields=fields_settings,
            takes=_recordings(old, clips),
            take_root=(),
            detail=b"",
        ),
        diagnostics=_diagnostics(reopened, adapted, newcomer, left_out, parity),
        provenance=_provenance(reopened, newcomer),
        contacts=adapted.contacts.statistics if adapted.contacts else (),
        hinges=captured_hinges.widened(old.hinges, clips),
    )


def _labels(adapted: AdaptedModel) -> tuple[LabelSet, ...]:
    bank = adapted.model.bank
    counts, indices = tuple(map(len, bank.labels.values())), np.arange(len(bank.pose.samples))
    samples = SamplePoints(bank.pose.samples, len(bank.low), indices, counts)
    return trained_card.card_labels(bank.labels, samples)


def _recordings(old: ModelCard, clips: Sequence[Example]) -> tuple[int, ...]:
    """Return the number (N,) of each clip's recording, new ones last; empty if each is a file."""
    if not old.making.takes:
        return ()
    before = reduced_motion.take_numbers(old)
    after = 1 + before.max() + sample_points.recording_numbers(clips)
    return (*before.tolist(), *after.tolist())


def _controls(old: Sequence[Control], values: Floats) -> tuple[Control, ...]:
    typical = trained_card.typical_controls(values)
    return tuple(
        replace(
            control,
            minimum=float(column.min()),
            maximum=float(column.max()),
            default=float(default),
            values=tuple(np.unique(column).tolist())
            if len(np.unique(column)) <= MAX_LISTED_VALUES
            else (),
        )
        for control, column, default in zip(old, values.T, typical, strict=True)
    )


def _diagnostics(
    reopened: ReconstructedModel,
    adapted: AdaptedModel,
    newcomer: NewPerformer,
    left_out: Sequence[float],
    parity: float,
) -> dict[str, Any]:
    """Return the parent's diagnostics with those updated that depend on the new clips.

    `explained`, the truncation cost, `joint_sigma`, `beside` and the accuracy of contacts depend on
    the parent's data alone and are copied.
    """
    old, model = dict(reopened.card.diagnostics), adapted.model
    if adapted.contacts is None:
        old.pop("contacts", None)
    freedoms, frames, samples = old["tensor"]
    shape = freedoms, frames, samples + len(newcomer.examples)
    ranks = model.decoder.reduced.core.shape
    compression = asdict(truncation_cost.shape_compression(shape, ranks, len(model.bank.low)))
    # The statistics of takes are not carried over.
    kept_facts = {name: fact for name, fact in old.items() if name != "detail"}
    return {
        **kept_facts,
        "compression": {name: rounded(ratio) for name, ratio in compression.items()},
        "leave_one_out_rms_m": rounded(np.sqrt(np.mean(np.square(left_out)))),
        "scales": [rounded(scale) for scale in model.bank.pose.hyper.scales],
        "tensor": list(shape),
        "parity_m": float(f"{parity:.1e}"),
        "notes": [*old["notes"], *_notes(reopened, adapted, newcomer)],
    }


def _notes(
    reopened: ReconstructedModel, adapted: AdaptedModel, newcomer: NewPerformer
) -> list[str]:
    clips, names = adapted.new_clips, reopened.card.skeleton.names
    listed = ", ".join(example.row.source for example in clips.examples)
    parent = f"{reopened.card.name}@{reopened.digest[:16]}"
    summary = f"adapted from {parent} to {newcomer.performer!r} by {len(clips.examples)} clips"
    adapting = f"{summary}: {listed}"
    return [
        adapting,
        *newcomer.notes,
        *trained_card.finding_notes(clips.findings, clips.examples, names),
        *adaptation.contact_notes(reopened.adaptable, adapted.contacts),
    ]


def _provenance(reopened: ReconstructedModel, newcomer: NewPerformer) -> Mapping[str, Any]:
    """Return the parent's provenance with its digest and the source of the new clips appended."""
    old = reopened.card.provenance
    step = {
        "parent_sha256": reopened.digest,
        "performer": newcomer.performer,
        "clips": len(newcomer.examples),
        "data_sha256": trained_card.data_digest(
            {f"{i} {e.row.file.name}": e for i, e in enumerate(newcomer.examples)}
        ),
        "licence": newcomer.licence,
    }
    return {
        **old,
        "licence": f"{old['licence']}; clips of {newcomer.performer}: {newcomer.licence}",
        "clips": old["clips"] + len(newcomer.examples),
        "adapted": [*old.get("adapted", []), step],
        "versions": {name: version(name) for name in old["versions"]},
    }
