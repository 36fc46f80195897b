"""A trained model to one file, and the gate that it passes before it may be written.

The gate asks the very session that the service will use, and compares joints in metres.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from typing import Any

import numpy as np

from model_export import cost, fidelity, levels, measured, phase, samples, strangers, threads
from model_export.flips import Finding
from model_export.ingest import Example
from model_export.kriging import Kriging
from model_export.model import Model, Outputs
from model_export.recipe import Recipe
from model_export.train import Trained
from service import __version__
from service.motion import card
from service.motion.card import Control, Making, ModelCard
from service.motion.conventions import Floats
from service.motion.detail import Level
from service.motion.errors import ExportRefused
from service.motion.field import Hyper
from service.synthesis import session
from service.synthesis.ports import OUTPUTS
from service.synthesis.session import Session

POINTS, BATCH = 10_000, 1_000
# No joint of the graph's answer may lie farther from the reference's, m.
ALLOWED = 1e-4
# With more distinct values than this a control is a continuum, and they are not listed.
FEW_VALUES = 10


@dataclass(frozen=True)
class Exported:
    """A model of all its levels, its file's content and card, and the largest joint error that the
    gate saw, m."""

    model: Model
    content: bytes
    card: ModelCard
    parity: float


@threads.one()
def export(recipe: Recipe, trained: Trained, notes: list[str]) -> Exported:
    """File of a trained model; the same data give the same bytes.

    Raises TrainingError for levels of detail that there cannot be, ExportRefused where onnxruntime
    answers anything else than the float64 reference does.
    """
    notes = [*notes, *samples.notes(recipe, trained.examples)]
    laddered = levels.build(recipe, trained)
    return finished(
        laddered.model, lambda parity: _card(recipe, trained, laddered.levels, notes, parity)
    )


def finished(model: Model, own_card: Callable[[float], ModelCard]) -> Exported:
    """File of a model of all its levels, whose card says the largest joint error, m, that the gate
    saw.

    Raises ExportRefused as `gate` does.
    """
    about = _about()
    # The gate's finding is part of the card, so the weights are judged before it is written.
    draft = own_card(0.0)
    parity = gate(model, model.onnx(card.dump(draft), about), draft)
    written = own_card(parity)
    return Exported(model, model.onnx(card.dump(written), about), written, parity)


@threads.one()
def finest(recipe: Recipe, trained: Trained) -> bytes:
    """File of the finest level alone, that no gate has judged: to be measured, not to be served."""
    alone = recipe.model_copy(update={"size": recipe.size.model_copy(update={"levels": []})})
    laddered = levels.build(alone, trained)
    own_card = _card(recipe, trained, laddered.levels, [], parity=0.0)
    return laddered.model.onnx(card.dump(own_card), _about())


def _about() -> dict[str, str]:
    return {"producer_name": "posefield", "producer_version": __version__}


def gate(model: Model, content: bytes, own_card: ModelCard) -> float:
    """Largest joint distance, m, between file and reference over random questions at every level.

    Raises ExportRefused where it exceeds what is allowed, and says by how much and where.
    """
    opened = session.open_bytes(content, f"{own_card.name}.onnx")
    rng = np.random.Generator(np.random.PCG64(10_000))
    worst = 0.0
    for question in range(POINTS // BATCH):
        asked = _draw(rng, model, own_card, question % len(own_card.levels))
        gaps = _gaps(model, opened, asked)
        at = np.unravel_index(int(np.argmax(gaps)), gaps.shape)
        worst = max(worst, float(gaps[at]))
        if worst > ALLOWED:
            raise ExportRefused(
                f"the graph puts {own_card.skeleton.names[at[2]]} {100 * worst:.4f} cm from where "
                f"the reference does, expected at most {100 * ALLOWED:g} cm; at "
                f"{asked.said(own_card, int(at[0]))}. Fewer controls, or a larger nugget, "
                "condition it better"
            )
    return worst


@dataclass(frozen=True)
class _Asked:
    """Questions of the gate: points (B, d) in the controls' units, times (B, 1), s, labels (B, p),
    and the level of detail.

    All are numbers of float32: the graph sees no others, and so must the reference.
    """

    points: Floats
    times: Floats
    labels: Floats
    level: int

    def said(self, own_card: ModelCard, row: int) -> str:
        """One of the questions in words."""
        names = (control.name for control in own_card.controls)
        point = dict(zip(names, self.points[row].tolist(), strict=True))
        own = np.flatnonzero(self.labels[row])
        who = f"{own_card.performers[own[0]]}, " if len(own) else ""
        return f"{who}{point}, {self.times[row, 0]:.3f} s, level {self.level}"


def _draw(rng: np.random.Generator, model: Model, own_card: ModelCard, level: int) -> _Asked:
    """Random controls, performers (nobody as often as each of them) and times of their clips."""
    low, high = ([getattr(c, end) for c in own_card.controls] for end in ("minimum", "maximum"))
    points = rng.uniform(low, high, (BATCH, len(low))).astype(np.float32).astype(np.float64)
    performers = len(own_card.performers)
    labels = np.eye(performers + 1, performers)[rng.integers(0, performers + 1, BATCH)]
    durations = model.evaluate(points, np.zeros((BATCH, 1)), labels).duration
    times = rng.uniform(0.0, 1.0, (BATCH, 1)) * durations[:, None]
    return _Asked(points, times.astype(np.float32).astype(np.float64), labels, level)


def _gaps(model: Model, opened: Session, asked: _Asked) -> Floats:
    """Distances (B, 1, J) between the joints of graph and reference, m."""
    question, parents = (asked.points, asked.times), opened.card.skeleton.parents
    expected = model.evaluate(*question, asked.labels, asked.level).positions(parents)
    answers = opened.run(*question, *OUTPUTS, labels=asked.labels, level=asked.level)
    found = Outputs(*answers).positions(parents)
    return np.asarray(np.linalg.norm(found - expected, axis=-1))


def _card(
    recipe: Recipe,
    trained: Trained,
    ladder: tuple[Level, ...],
    notes: list[str],
    parity: float,
) -> ModelCard:
    examples, durations = trained.examples, trained.aligned.durations
    return ModelCard(
        name=recipe.name,
        description=recipe.description,
        controls=_controls(recipe, trained),
        skeleton=trained.skeleton,
        cyclic=recipe.motion.cyclic,
        root=recipe.motion.root,
        rate=float(np.median([example.clip.rate for example in examples])),
        frames=recipe.motion.frames,
        samples=len(examples),
        levels=ladder,
        durations=(float(durations.min()), float(durations.max())),
        performers=trained.model.bank.performers,
        examples=tuple(tuple(map(float, example.controls)) for example in examples),
        moved_by=tuple(map(int, trained.laid.moved_by)),
        feet=tuple(map(trained.skeleton.names.index, recipe.motion.feet)),
        diagnostics=_diagnostics(trained, notes, parity),
        provenance=_provenance(recipe, examples),
        sources=tuple(example.row.source for example in examples),
        kriging=plainly(trained.pose.hyper),
        roles={str(role): joint for role, joint in recipe.roles.items()},
        left_out=tuple(map(_round, np.sqrt(trained.missed))),
        event=fidelity.event(recipe, examples),
        beside=_beside(trained),
        joint_sigma=tuple(round(float(share), 2) for share in trained.joints),
        making=_making(recipe, trained),
    )


def _beside(trained: Trained) -> tuple[tuple[float, ...], ...]:
    """Root of the covariance of what strays beside a cycle's poses, for a sigma of one metre."""
    if "travel" not in trained.residuals:
        return ()
    strays = np.hstack([trained.residuals["duration"], trained.residuals["travel"]])
    sigmas = np.sqrt(trained.model.bank.sill * trained.pose.variances)
    standard = strays / sigmas[:, None]
    covariance = standard.T @ standard / len(standard)
    # A walk of one duration, or a straight one, has no variance there.
    root = np.linalg.cholesky(covariance + 1e-9 * np.eye(len(covariance)))
    return tuple(tuple(map(_round, row)) for row in root)


def _making(recipe: Recipe, trained: Trained) -> Making:
    marks = [example.landmarks for example in trained.examples]
    times = np.array(marks).reshape(len(marks), -1).mean(axis=0)
    fields = trained.model.bank.others.items()
    return Making(
        {name: solved_with(field.hyper) for name, field in fields if isinstance(field, Kriging)},
        dict(zip(recipe.clips.landmarks, map(float, times), strict=True)),
        {joint: weight for joint, weight in recipe.motion.joint_weights.items() if weight != 1.0},
        recipe.motion.cyclic and recipe.alignment.begin == "in_phase",
    )


def solved_with(hyper: Hyper) -> tuple[float, ...]:
    """Nugget and drifts; six digits of the one, for all that is made of it takes it as it stands
    there."""
    return (float(f"{hyper.nugget:.6g}"), *hyper.drifts)


def _controls(recipe: Recipe, trained: Trained) -> tuple[Control, ...]:
    values = np.stack([example.controls for example in trained.examples])
    landmarks = np.array([example.landmarks for example in trained.examples])
    controls = []
    for asked, own in zip(recipe.controls, values.T, strict=True):
        distinct = np.unique(own)
        controls.append(
            Control(
                asked.name,
                asked.unit,
                asked.description,
                float(distinct[0]),
                float(distinct[-1]),
                float(np.sort(own)[len(own) // 2]),
                tuple(map(float, distinct)) if len(distinct) <= FEW_VALUES else (),
                measured.on_the_card(recipe, asked, trained.skeleton, landmarks),
            )
        )
    return tuple(controls)


def _diagnostics(trained: Trained, notes: list[str], parity: float) -> dict[str, Any]:
    """What training measured, in metres and plain shares, rounded to what is worth reading."""
    cut = {f"truncation_{k}_m": v for k, v in asdict(trained.fidelity).items() if v is not None}
    kept, controls = trained.model.decoder.reduced.core.shape, len(trained.model.bank.low)
    compression = asdict(cost.compression(trained.tensor, kept, controls))
    hyper = trained.pose.hyper
    return {
        **{name: _round(distance) for name, distance in cut.items()},
        "compression": {name: _round(ratio) for name, ratio in compression.items()},
        "leave_one_out_rms_m": _round(np.sqrt(trained.missed.mean())),
        "explained": {name: _round(share) for name, share in trained.explained.items()},
        "covariance": hyper.covariance,
        "drift": list(hyper.drifts),
        "scales": [_round(scale) for scale in hyper.scales],
        "nugget": _round(hyper.nugget),
        "tensor": list(trained.tensor.values.shape),
        "parity_m": float(f"{parity:.1e}"),
        "notes": [
            *notes,
            *strangers.notes(trained),
            *phase.notes(trained.examples),
            *found(trained.findings, trained.examples, trained.skeleton.names),
        ],
    }


def plainly(hyper: Hyper) -> Hyper:
    """The same in numbers of Python, which a card can hold."""
    return replace(hyper, nugget=float(hyper.nugget), label=float(hyper.label))


def _round(value: Any) -> float:
    return float(f"{float(value):.4g}")


def found(
    findings: Sequence[Finding], examples: Sequence[Example], names: Sequence[str]
) -> list[str]:
    """One sentence for every clip that a joint was cleaned in or watched in."""
    said: dict[tuple[int, str], list[str]] = {}
    for finding in findings:
        entry = f"{names[finding.joint]} by {np.degrees(finding.angle):.0f} degrees"
        said.setdefault((finding.clip, finding.kind), []).append(entry)
    return [
        f"{examples[clip].row.named}: {_MEANING[kind]}: {', '.join(entries)}"
        for (clip, kind), entries in sorted(said.items())
    ]


_MEANING = {
    "jump": "jumps between two frames taken out",
    "flip": "half turns taken out",
    "wrap": "followed past half a turn from the family's mean",
    "far": "close to half a turn from the family's mean",
}


def _provenance(recipe: Recipe, examples: Sequence[Example]) -> dict[str, Any]:
    return {
        "licence": recipe.licence,
        "recipe_sha256": hashlib.sha256(recipe.model_dump_json().encode()).hexdigest(),
        "data_sha256": digest({str(e.row.place.name): e for e in examples}),
        "clips": len(examples),
        "versions": {name: version(name) for name in ("posefield", "numpy", "scipy", "onnx")},
    }


def digest(files: Mapping[str, Example]) -> str:
    """One hash over the content of every motion file, in the order of their names."""
    total = hashlib.sha256()
    for name in sorted(files):
        total.update(
            name.encode() + b"\0" + hashlib.sha256(files[name].row.place.read_bytes()).digest()
        )
    return total.hexdigest()
