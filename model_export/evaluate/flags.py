"""Whether the support flag does what it promises, on clips that it has not seen.

It is made of what is left where a clip is held out, limits and all, and asked of the held-out clips
as they are and moved beyond the range of each control in turn.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from model_export.evaluate import folds
from model_export.evaluate.folds import Fold
from model_export.ingest import Example
from model_export.recipe import Recipe
from service.motion import support
from service.motion.conventions import Floats
from service.motion.errors import InvalidField

BEYOND = 0.25
"""Share of a control's range by which clips are moved beyond it."""
ACROSS = (0.25, 0.5, 0.75)
"""Where in a gap clips are moved to, as shares of it."""


@dataclass(frozen=True)
class Flags:
    """What was flagged, as shares.

    alarms: of the held-out clips as they are. beyond: by control, of those moved beyond its range.
    gap: the control in which two families lie apart, and of clips moved into that gap; none for one
    family.
    """

    alarms: float
    beyond: dict[str, float]
    gap: tuple[str, float] | None = None


def measure(controls: Floats, names: Sequence[str], parts: Sequence[Fold]) -> Flags:
    """Flags over clips' controls (N, d), held out by folds."""
    alarms, beyond = [], []
    for held, own in _held(controls, parts):
        alarms.append(~own.holds(held))
        beyond.append(np.stack([_beyond(own, held, c) for c in range(len(names))], axis=1))
    shares = np.concatenate(beyond).mean(axis=0).tolist()
    return Flags(float(np.concatenate(alarms).mean()), dict(zip(names, shares, strict=True)))


def joined(recipe: Recipe, one: list[Example], other_recipe: Recipe, other: list[Example]) -> Flags:
    """Flags over two families as one, of the controls that both have.

    InvalidField where they have none, or overlap in all of them.
    """
    known = [[control.name for control in each.controls] for each in (recipe, other_recipe)]
    names = _shared(*known)
    both = [_columns(each, own, names) for each, own in zip((one, other), known, strict=True)]
    found = measure(np.vstack(both), names, folds.clips([*one, *other]))
    return replace(found, gap=_flagged_between(names, *both))


def _flagged_between(names: Sequence[str], one: Floats, other: Floats) -> tuple[str, float]:
    """The control in which controls (N, d) and (M, d) lie farthest apart, and the share of them
    that is flagged in the gap."""
    both = np.vstack([one, other])
    control, low, high = _gap(names, one, other, np.ptp(both, axis=0))
    own = support.of(both)
    flagged = []
    for share in ACROSS:
        moved = both.copy()
        moved[:, control] = low + share * (high - low)
        flagged.append(~own.holds(moved))
    return names[control], float(np.mean(flagged))


def _shared(one: Sequence[str], other: Sequence[str]) -> list[str]:
    """Names of controls that two families have in common, in the order of the first; InvalidField
    for none."""
    both = [name for name in one if name in other]
    if not both:
        expected = f"expected one of {', '.join(one)}"
        raise InvalidField("joined", f"its controls are {', '.join(other)}, {expected}")
    return both


def _columns(examples: Sequence[Example], names: Sequence[str], wanted: Sequence[str]) -> Floats:
    """Controls (N, d) of examples, those that are wanted."""
    return np.stack([example.controls for example in examples])[:, [names.index(n) for n in wanted]]


def _held(controls: Floats, parts: Sequence[Fold]) -> Iterator[tuple[Floats, support.Support]]:
    """Controls that a fold holds out, and the support of all others."""
    for fold in parts:
        held = np.isin(np.arange(len(controls)), fold.held)
        yield controls[held], support.of(controls[~held])


def _beyond(own: support.Support, held: Floats, control: int) -> Floats:
    """Share (H,) of the ends of a control beyond which each held clip is flagged."""
    room = BEYOND * (own.high - own.low)[control]
    flagged = []
    for end in (own.low[control] - room, own.high[control] + room):
        moved = held.copy()
        moved[:, control] = end
        flagged.append(~own.holds(moved))
    return np.asarray(np.mean(flagged, axis=0))


def _gap(
    names: Sequence[str], one: Floats, other: Floats, widths: Floats
) -> tuple[int, float, float]:
    """Control, end of the lower family and beginning of the higher, of the widest gap."""
    up, down = other.min(axis=0) - one.max(axis=0), one.min(axis=0) - other.max(axis=0)
    control = int(np.argmax(np.maximum(up, down) / widths))
    if max(up[control], down[control]) <= 0.0:
        raise InvalidField("joined", f"both families overlap in {', '.join(names)}, expected a gap")
    lower, higher = (one, other) if up[control] > 0.0 else (other, one)
    return control, float(lower[:, control].max()), float(higher[:, control].min())
