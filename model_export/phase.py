"""Cycles cut at different moments, brought to begin at the same one.

A cycle has no first frame: where it was cut is a choice of whoever cut it. A warp keeps its ends,
so it cannot move a cut, and bends hard beside one that is late. Every cycle is therefore first
turned by the share of itself at which it agrees best with the family, and begins there.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from model_export import align, ingest, measured
from model_export.ingest import Example
from model_export.recipe import Recipe
from service.motion import quat
from service.motion.clip import Clip
from service.motion.conventions import UP, Floats
from service.motion.errors import RecipeError

# Steps of a cycle at which it is compared; a cut is found between them.
STEPS = 96
# A cycle that is nearly two equal halves fits almost as well from its other half: it begins there
# only where that is this much nearer, in squared distance, than all within a quarter of the cycle.
NEAR, FAR_WORTH = 0.25, 0.5
# A shift beyond this share of a cycle is worth a note.
LARGE = 0.08


def in_phase(
    recipe: Recipe, examples: tuple[Example, ...], joint_weights: Floats
) -> tuple[Example, ...]:
    """Examples that begin at the family's phase, where they are cycles and the recipe wants it.

    The medoid says the phase first, then the mean of the others. The circular mean of the shifts
    is zero: on average the cycles begin where the data did. Raises RecipeError where a landmark
    would pass from one end of a cycle to the other.
    """
    if not recipe.motion.cyclic or recipe.alignment.begin == "as_cut":
        return examples
    traces = np.stack([_even(align.trace(e.clip, np.sqrt(joint_weights))) for e in examples])
    found = shifts(traces, recipe.alignment.rounds)
    in_place = recipe.motion.root == "in_place"
    begun = tuple(
        _measured(recipe, begin(example, share, in_place))
        for example, share in zip(examples, found, strict=True)
    )
    _refuse_parted_landmarks(begun)
    return begun


def _measured(recipe: Recipe, begun: Example) -> Example:
    """The example with what is measured of it from where it begins now: of a cycle on an arc, the
    way from one phase is not that from another."""
    controls = measured.controls(recipe, begun.row, begun.clip, begun.landmarks)
    return replace(begun, controls=controls)


def in_phase_with(
    examples: Sequence[Example], references: Floats, joint_weights: Floats, in_place: bool
) -> tuple[Example, ...]:
    """Cyclic examples that begin at the phase of their references (N, F, features), traces of
    closed cycles in even steps."""
    traces = np.stack([_even(align.trace(e.clip, np.sqrt(joint_weights))) for e in examples])
    found = _to(traces, np.stack([_even(reference) for reference in references]))
    return tuple(begin(e, share, in_place) for e, share in zip(examples, found, strict=True))


def shifts(traces: Floats, rounds: int) -> Floats:
    """Shares of their cycles (N,) at which traces (N, STEPS, features) are at one phase."""
    found = _gauge(_to(traces, traces[_medoid(traces)]))
    for _ in range(rounds):
        turned = _turned(traces, found)
        others = (turned.sum(axis=0) - turned) / (len(turned) - 1)
        found = _gauge(found + _to(turned, others))
    return found


def _even(trace: Floats) -> Floats:
    """Rows (STEPS, features) of a closed trace (F, features), its end left to its beginning."""
    u = np.arange(STEPS) / STEPS
    return align.at(trace, u)


def _spectra(traces: Floats) -> npt.NDArray[np.complex128]:
    return np.fft.rfft(traces, axis=-2)


def _costs(traces: Floats, references: Floats) -> Floats:
    """Squared distances (N, STEPS) of cycles (N, STEPS, features), begun at each of their steps,
    from references (STEPS, features), or one each."""
    cross = np.sum(_spectra(traces) * np.conj(_spectra(references)), axis=-1)
    own = np.sum(np.square(traces), axis=(-2, -1)) + np.sum(np.square(references), axis=(-2, -1))
    return np.maximum(own[..., None] - 2.0 * np.fft.irfft(cross, STEPS, axis=-1), 0.0)


def _medoid(traces: Floats) -> int:
    """The cycle nearest to all others, wherever they begin."""
    totals = [np.sum(np.sqrt(_costs(traces, one).min(axis=1))) for one in traces]
    return int(np.argmin(np.round(totals, 9)))


def _to(traces: Floats, references: Floats) -> Floats:
    """Shares of a cycle (N,) in [-0.5, 0.5) at which traces begin where their references do."""
    costs = _costs(traces, references)
    shares = np.fft.fftfreq(STEPS)
    near = np.where(np.abs(shares) <= NEAR, costs, np.inf)
    clear = costs.min(axis=1) < FAR_WORTH * near.min(axis=1)
    best = np.argmin(np.where(clear[:, None], costs, near), axis=1)
    return shares[best] + _beside(costs, best) / STEPS


def _beside(costs: Floats, best: Floats) -> Floats:
    """Lowest points (N,) of parabolas through each best step and its neighbours, in steps."""
    rows = np.arange(len(costs))
    before, at, after = (costs[rows, (best + side) % STEPS] for side in (-1, 0, 1))
    bend = before - 2.0 * at + after
    return np.where(bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1.0), 0.0)


def _turned(traces: Floats, shifts: Floats) -> Floats:
    """Traces (N, STEPS, features) begun at shares (N,) of their cycles."""
    turn = np.exp(2j * np.pi * np.arange(STEPS // 2 + 1) * shifts[:, None])
    return np.fft.irfft(_spectra(traces) * turn[:, :, None], STEPS, axis=1)


def _gauge(shifts: Floats) -> Floats:
    """The same shifts, in [-0.5, 0.5), their circular mean zero."""
    around = np.exp(2j * np.pi * shifts)
    return np.angle(around * np.conj(around.sum())) / (2 * np.pi)


def begin(example: Example, share: float, in_place: bool = False) -> Example:
    """A cyclic example begun a share of its cycle later, to the nearest frame.

    What is cut off at one end goes on at the other, carried and turned by the cycle's travel.
    """
    cycle = len(example.clip) - 1
    frames = round(share * cycle) % cycle
    if frames == 0:
        return example
    own = frames / cycle
    clip = _rolled(example.clip, frames)
    # The line through the cycle's heading sets out straight ahead and goes on: a line fitted anew
    # would swing with the pelvis.
    clip = ingest.place(clip, clip.root_path[0] * (1.0 - UP), _turned_by(example.clip) * own)
    return replace(
        example,
        # Turned by the cycle's change of heading, what was in place is so no longer.
        clip=ingest.stay(clip) if in_place else clip,
        landmarks=tuple((mark - own) % 1.0 for mark in example.landmarks),
        shift=own - np.rint(own),
    )


def _turned_by(clip: Clip) -> Floats:
    """By how much a closed cycle's heading changes, rad."""
    first, last = clip.rotations[[0, -1], 0]
    return quat.twist(quat.mul(last, quat.conj(first)), UP)


def _rolled(clip: Clip, frames: int) -> Clip:
    """Closed cycle begun so many frames later."""
    turn = np.broadcast_to(quat.about(UP, _turned_by(clip)), (frames, 4))
    rotations, translations = clip.rotations[1 : frames + 1], clip.translations[1 : frames + 1]
    rotations, translations = rotations.copy(), translations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    gone = quat.rotate(turn, translations[:, 0] - clip.root_path[0])
    translations[:, 0] = clip.root_path[-1] + gone
    return replace(
        clip,
        rotations=np.concatenate([clip.rotations[frames:], rotations]),
        translations=np.concatenate([clip.translations[frames:], translations]),
    )


def notes(examples: Sequence[Example]) -> list[str]:
    """One sentence for every clip that was cut at quite another phase."""
    return [
        f"{example.row.named}: begun {abs(example.shift):.0%} of its cycle "
        f"{'later' if example.shift > 0 else 'earlier'} than it was cut"
        for example in examples
        if abs(example.shift) > LARGE
    ]


def _refuse_parted_landmarks(examples: Sequence[Example]) -> None:
    """A landmark near the cut may come to lie at the other end of some cycles."""
    marks = np.array([example.landmarks for example in examples]).reshape(len(examples), -1)
    usual = np.median(marks, axis=0)
    for example, own in zip(examples, marks, strict=True):
        if np.any(np.diff(own) <= 0) or np.any(np.abs(own - usual) >= 0.5) or np.any(own == 0):
            raise RecipeError(
                example.row.table,
                f"landmarks lie at {_shares(own)} of the cycle once it begins at the family's "
                f"phase ({example.shift:+.0%}), expected near {_shares(usual)} and in that order; "
                "cut the cycles away from a landmark, or say alignment.begin = 'as_cut'",
                example.row.line,
            )


def _shares(marks: Floats) -> str:
    return ", ".join(f"{mark:.0%}" for mark in marks)
