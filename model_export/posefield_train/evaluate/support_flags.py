"""Accuracy of the support flag on clips that it has not seen.

The flag, with its limits, is built from the clips that are not held out. It is evaluated at the
controls of the held-out clips, and at the same controls moved beyond the range of each control.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.kriging import support
from posefield_train.evaluate import folds
from posefield_train.evaluate.folds import Fold
from posefield_train.report.drawing import significant_digits
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

BEYOND_SHARE = 0.25
"""Share of a control's range by which clips are moved beyond it."""
GAP_POSITIONS = (0.25, 0.5, 0.75)
"""Positions in a gap to which clips are moved, as shares of it."""


@dataclass(frozen=True)
class SupportFlags:
    """Shares of clips that were flagged as unsupported.

    alarms: of held-out clips. beyond: of clips moved beyond the range of a control, by control.
    gap: control that separates two families, and share of clips moved into the gap between them;
    None for one family.
    """

    alarms: float
    beyond: dict[str, float]
    gap: tuple[str, float] | None = None

    def facts(self) -> dict[str, Any]:
        """Return the shares as JSON values."""
        facts: dict[str, Any] = {
            "false_alarms": significant_digits.round_number(self.alarms),
            "beyond": {
                name: significant_digits.round_number(share) for name, share in self.beyond.items()
            },
        }
        if self.gap:
            control, share = self.gap
            facts["gap"] = {"control": control, "flagged": significant_digits.round_number(share)}
        return facts

    def text(self) -> str:
        """Return the shares in a sentence."""
        beyond = ", ".join(f"{name} {100 * share:.0f} %" for name, share in self.beyond.items())
        text = (
            f"support: {100 * self.alarms:.1f} % of held-out clips are flagged; of clips moved "
            f"{100 * BEYOND_SHARE:.0f} % of the range beyond a control: {beyond}"
        )
        if self.gap is None:
            return text
        control, share = self.gap
        return f"{text}; of clips moved into the gap of {control}: {100 * share:.0f} %"


def measure_flags(controls: Floats, names: Sequence[str], parts: Sequence[Fold]) -> SupportFlags:
    """Return the flags over controls (N, d) of clips held out by folds."""
    alarms, beyond = [], []
    for held, own in _held_out_supports(controls, parts):
        alarms.append(~own.supported(held))
        beyond.append(np.stack([_flagged_beyond(own, held, c) for c in range(len(names))], axis=1))
    shares = np.concatenate(beyond).mean(axis=0).tolist()
    return SupportFlags(float(np.concatenate(alarms).mean()), dict(zip(names, shares, strict=True)))


def measure_joined(
    recipe: Recipe, one: list[Example], other_recipe: Recipe, other: list[Example]
) -> SupportFlags:
    """Return the flags over two families joined, by the controls that both have.

    Raises InvalidField if they have none in common, or overlap in all of them.
    """
    known = [[control.name for control in each.controls] for each in (recipe, other_recipe)]
    names = _common_controls(*known)
    both = [
        _control_columns(each, own, names) for each, own in zip((one, other), known, strict=True)
    ]
    found = measure_flags(np.vstack(both), names, folds.clip_folds([*one, *other]))
    return replace(found, gap=_flagged_between(names, *both))


def _flagged_between(names: Sequence[str], one: Floats, other: Floats) -> tuple[str, float]:
    """Return the control with the widest gap between two families, and the share flagged in it.

    one, other: controls (N, d) and (M, d). The share is of all clips, moved into the gap.
    """
    both = np.vstack([one, other])
    control, low, high = _widest_gap(names, one, other, np.ptp(both, axis=0))
    own = support.fit_support(both)
    flagged = []
    for share in GAP_POSITIONS:
        moved = both.copy()
        moved[:, control] = low + share * (high - low)
        flagged.append(~own.supported(moved))
    return names[control], float(np.mean(flagged))


def _common_controls(one: Sequence[str], other: Sequence[str]) -> list[str]:
    """Return the controls that two families have in common, in the order of the first.

    Raises InvalidField if there are none.
    """
    both = [name for name in one if name in other]
    if not both:
        expected = f"expected one of {', '.join(one)}"
        raise InvalidField("joined", f"its controls are {', '.join(other)}, {expected}")
    return both


def _control_columns(
    examples: Sequence[Example], names: Sequence[str], wanted: Sequence[str]
) -> Floats:
    """Return the wanted controls (N, d) of examples."""
    return np.stack([example.controls for example in examples])[:, [names.index(n) for n in wanted]]


def _held_out_supports(
    controls: Floats, parts: Sequence[Fold]
) -> Iterator[tuple[Floats, support.Support]]:
    """Yield the controls that a fold holds out, and the support of all others."""
    for fold in parts:
        held = np.isin(np.arange(len(controls)), fold.held)
        yield controls[held], support.fit_support(controls[~held])


def _flagged_beyond(own: support.Support, held: Floats, control: int) -> Floats:
    """Return the share (H,) of both ends of a control beyond which each held clip is flagged."""
    room = BEYOND_SHARE * (own.high - own.low)[control]
    flagged = []
    for end in (own.low[control] - room, own.high[control] + room):
        moved = held.copy()
        moved[:, control] = end
        flagged.append(~own.supported(moved))
    return np.asarray(np.mean(flagged, axis=0))


def _widest_gap(
    names: Sequence[str], one: Floats, other: Floats, widths: Floats
) -> tuple[int, float, float]:
    """Return the control with the widest gap, and the ends of the gap."""
    up, down = other.min(axis=0) - one.max(axis=0), one.min(axis=0) - other.max(axis=0)
    control = int(np.argmax(np.maximum(up, down) / widths))
    if max(up[control], down[control]) <= 0.0:
        raise InvalidField("joined", f"both families overlap in {', '.join(names)}, expected a gap")
    lower, higher = (one, other) if up[control] > 0.0 else (other, one)
    return control, float(lower[:, control].max()), float(higher[:, control].min())
