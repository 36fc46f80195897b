"""Alignment of cycles that were cut at different phases.

A cycle has no natural first frame. A warp keeps its ends, so it cannot move a cut, and is distorted
near a late one. Every cycle is therefore first shifted by the share at which it agrees best with
the family.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np
import numpy.typing as npt

from posefield.common.errors import RecipeError
from posefield.common.units import UP, Floats, Indices, JointWeights, PerClip, Traces
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.curves import CurveValues
from posefield_train.align import time_alignment
from posefield_train.source import canonical, measured_controls
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

# Steps of a cycle at which it is compared; shifts are interpolated between them.
PHASE_STEPS = 96
# A cycle of two nearly equal halves also fits shifted by half. A shift beyond NEAR of the cycle
# must reduce the squared distance below FAR_WORTH times the best within NEAR.
NEAR, FAR_WORTH = 0.25, 0.5
# A shift beyond this share of a cycle is noted.
NOTED_SHIFT = 0.08
# Clips beyond this number are noted together.
MOST_NOTED = 3


def align_phases(
    recipe: Recipe, examples: tuple[Example, ...], joint_weights: JointWeights
) -> tuple[Example, ...]:
    """Shift examples to the family's phase, if they are cycles and the recipe requests it.

    The first reference is the medoid, then the mean of the others. The circular mean of the shifts
    is zero. Raises RecipeError if a landmark would pass from one end of a cycle to the other.
    """
    if not recipe.motion.cyclic or recipe.alignment.begin == "as_cut":
        return examples
    traces = np.stack(
        [_resample(time_alignment.trace(e.clip, np.sqrt(joint_weights))) for e in examples]
    )
    shares = shifts(traces, recipe.alignment.rounds)
    in_place = recipe.motion.root == "in_place"
    shifted = tuple(
        _remeasure(recipe, shift_start(example, share, in_place))
        for example, share in zip(examples, shares, strict=True)
    )
    _refuse_split_landmarks(shifted)
    return shifted


def _remeasure(recipe: Recipe, shifted: Example) -> Example:
    """Measure the controls of a shifted example again; travel on an arc depends on the phase."""
    controls = measured_controls.control_values(
        recipe, shifted.row, shifted.clip, shifted.landmarks
    )
    return replace(shifted, controls=controls)


def align_phases_to(
    examples: Sequence[Example], references: Traces, joint_weights: JointWeights, in_place: bool
) -> tuple[Example, ...]:
    """Shift cyclic examples to the phase of their references (N, F, features).

    The references are traces of closed cycles at uniform steps.
    """
    traces = np.stack(
        [_resample(time_alignment.trace(e.clip, np.sqrt(joint_weights))) for e in examples]
    )
    shares = _shifts_to(traces, np.stack([_resample(reference) for reference in references]))
    return tuple(shift_start(e, share, in_place) for e, share in zip(examples, shares, strict=True))


def shifts(traces: Annotated[Floats, "clips steps features"], rounds: int) -> PerClip:
    """Return shares of a cycle (N,) at which traces (N, STEPS, features) have a common phase."""
    shares = _centre(_shifts_to(traces, traces[_medoid(traces)]))
    for _ in range(rounds):
        turned = _shift_traces(traces, shares)
        means = (turned.sum(axis=0) - turned) / (len(turned) - 1)
        shares = _centre(shares + _shifts_to(turned, means))
    return shares


def _resample(trace: Annotated[Floats, "frames features"]) -> Annotated[Floats, "steps features"]:
    """Resample a closed trace (F, features) to (STEPS, features), without its repeated end."""
    u = np.arange(PHASE_STEPS) / PHASE_STEPS
    return time_alignment.interpolate(trace, u)


def _spectra(
    traces: Annotated[Floats, "*clips steps features"],
) -> Annotated[npt.NDArray[np.complex128], "*clips half features"]:
    return np.fft.rfft(traces, axis=-2)


def _costs(
    traces: Annotated[Floats, "*clips steps features"],
    references: Annotated[Floats, "... steps features"],
) -> Annotated[Floats, "*clips steps"]:
    """Return squared distances (N, STEPS) of cycles (N, STEPS, features), at every shift.

    references: (STEPS, features), or one per cycle.
    """
    cross = np.sum(_spectra(traces) * np.conj(_spectra(references)), axis=-1)
    squares = np.sum(np.square(traces), axis=(-2, -1)) + np.sum(
        np.square(references), axis=(-2, -1)
    )
    return np.maximum(squares[..., None] - 2.0 * np.fft.irfft(cross, PHASE_STEPS, axis=-1), 0.0)


def _medoid(traces: Annotated[Floats, "clips steps features"]) -> int:
    """Return the cycle nearest to all others, each at its best shift."""
    totals = [np.sum(np.sqrt(_costs(traces, one).min(axis=1))) for one in traces]
    return int(np.argmin(np.round(totals, 9)))


def _shifts_to(
    traces: Annotated[Floats, "clips steps features"],
    references: Annotated[Floats, "... steps features"],
) -> PerClip:
    """Return shares of a cycle (N,) in [-0.5, 0.5) that bring traces to their references' phase."""
    costs = _costs(traces, references)
    shares = np.fft.fftfreq(PHASE_STEPS)
    near = np.where(np.abs(shares) <= NEAR, costs, np.inf)
    clear = costs.min(axis=1) < FAR_WORTH * near.min(axis=1)
    best = np.argmin(np.where(clear[:, None], costs, near), axis=1)
    return shares[best] + _parabola_offsets(costs, best) / PHASE_STEPS


def _parabola_offsets(
    costs: Annotated[Floats, "clips steps"], best: Annotated[Indices, "clips"]
) -> PerClip:
    """Return offsets (N,), in steps, of the minima of parabolas through the best steps."""
    rows = np.arange(len(costs))
    before, at, after = (costs[rows, (best + side) % PHASE_STEPS] for side in (-1, 0, 1))
    bend = before - 2.0 * at + after
    return np.where(bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1.0), 0.0)


def _shift_traces(
    traces: Annotated[Floats, "clips steps features"], shifts: PerClip
) -> Annotated[Floats, "clips steps features"]:
    """Shift traces (N, STEPS, features) by shares (N,) of their cycles."""
    turn = np.exp(2j * np.pi * np.arange(PHASE_STEPS // 2 + 1) * shifts[:, None])
    return np.fft.irfft(_spectra(traces) * turn[:, :, None], PHASE_STEPS, axis=1)


def _centre(shifts: PerClip) -> PerClip:
    """Return the shifts, in [-0.5, 0.5), minus their circular mean."""
    around = np.exp(2j * np.pi * shifts)
    return np.angle(around * np.conj(around.sum())) / (2 * np.pi)


def shift_start(example: Example, share: float, in_place: bool = False) -> Example:
    """Shift a cyclic example to begin a share of its cycle later, to the nearest frame.

    The frames cut off at the start are appended, moved and turned by the cycle's travel.
    """
    cycle = len(example.clip) - 1
    frames = round(share * cycle) % cycle
    if frames == 0:
        return example
    shift = frames / cycle
    clip = _shift_clip(example.clip, frames)
    # The heading changes linearly over the cycle. A line fitted again to the shifted clip would
    # vary with the swing of the pelvis.
    clip = canonical.place(
        clip, clip.root_path[0] * (1.0 - UP), _heading_change(example.clip) * shift
    )
    return replace(
        example,
        # The appended frames are turned by the change of heading, which moves the root again.
        clip=canonical.remove_drift(clip) if in_place else clip,
        landmarks=tuple((mark - shift) % 1.0 for mark in example.landmarks),
        shift=shift - np.rint(shift),
    )


def _heading_change(clip: Clip) -> Floats:
    """Return the change of heading over a closed cycle, rad."""
    first, last = clip.rotations[[0, -1], 0]
    return quat.twist(quat.mul(last, quat.conj(first)), UP)


def _shift_clip(clip: Clip, frames: int) -> Clip:
    """Shift a closed cycle to begin some frames later."""
    turn = np.broadcast_to(quat.from_axis_angle(UP, _heading_change(clip)), (frames, 4))
    rotations, translations = clip.rotations[1 : frames + 1], clip.translations[1 : frames + 1]
    rotations, translations = rotations.copy(), translations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    gone = quat.rotate(turn, translations[:, 0] - clip.root_path[0])
    translations[:, 0] = clip.root_path[-1] + gone
    return replace(
        clip,
        rotations=np.concatenate([clip.rotations[frames:], rotations]),
        translations=np.concatenate([clip.translations[frames:], translations]),
        curves=clip.curves and _shift_curves(clip.curves, frames),
    )


def _shift_curves(curves: CurveValues, frames: int) -> CurveValues:
    values = np.concatenate([curves.values[frames:], curves.values[1 : frames + 1]])
    return replace(curves, values=values)


def shift_notes(examples: Sequence[Example]) -> list[str]:
    """Return notes on clips that were shifted by a large share of their cycle.

    A few have a note each, many have one together.
    """
    shifted = [example for example in examples if abs(example.shift) > NOTED_SHIFT]
    if len(shifted) <= MOST_NOTED:
        return [f"{example.row.named}: {_shift_text(example)}" for example in shifted]
    farthest = max(shifted, key=lambda example: abs(example.shift))
    return [
        f"{len(shifted)} of {len(examples)} clips begin elsewhere in their cycle than they were "
        f"cut, the most {farthest.row.named}: {_shift_text(farthest)}"
    ]


def _shift_text(example: Example) -> str:
    direction = "later" if example.shift > 0 else "earlier"
    return f"begun {abs(example.shift):.0%} of its cycle {direction} than it was cut"


def _refuse_split_landmarks(examples: Sequence[Example]) -> None:
    """Raise RecipeError for landmarks that the shift moves across the end of some cycles."""
    marks = np.array([example.landmarks for example in examples]).reshape(len(examples), -1)
    median = np.median(marks, axis=0)
    for example, row in zip(examples, marks, strict=True):
        rising = np.diff(row[np.argsort(median)]) > 0
        if not rising.all() or np.any(np.abs(row - median) >= 0.5) or np.any(row == 0):
            raise RecipeError(
                example.row.table,
                f"landmarks lie at {_percentages(row)} of the cycle once it begins at the family's "
                f"phase ({example.shift:+.0%}), expected near "
                f"{_percentages(median)} and in that order; "
                "cut the cycles away from a landmark, or say alignment.begin = 'as_cut'",
                example.row.line,
            )


def _percentages(marks: Annotated[Floats, "..."]) -> str:
    return ", ".join(f"{mark:.0%}" for mark in marks)
