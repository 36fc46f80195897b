"""Accuracy of the support flag on clips that it has not seen.

The flag, with its limits, is built from the clips that are not held out. It is evaluated at the
controls of the held-out clips, and at the same controls moved beyond the range of each control.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield.common.units import Floats
from posefield.kriging import support
from posefield_train.evaluate.folds import Fold
from posefield_train.report.drawing import significant_digits

BEYOND_SHARE = 0.25
"""Share of a control's range by which clips are moved beyond it."""


@dataclass(frozen=True)
class SupportFlags:
    """Shares of clips that were flagged as unsupported.

    alarms: of held-out clips. beyond: of clips moved beyond the range of a control, by control.
    """

    alarms: float
    beyond: dict[str, float]

    def facts(self) -> dict[str, Any]:
        """Return the shares as JSON values."""
        beyond = {name: significant_digits.round_number(s) for name, s in self.beyond.items()}
        return {"false_alarms": significant_digits.round_number(self.alarms), "beyond": beyond}

    def text(self) -> str:
        """Return the shares in a sentence."""
        beyond = ", ".join(f"{name} {100 * share:.0f} %" for name, share in self.beyond.items())
        return (
            f"support: {100 * self.alarms:.1f} % of held-out clips are flagged; of clips moved "
            f"{100 * BEYOND_SHARE:.0f} % of the range beyond a control: {beyond}"
        )


def measure_flags(controls: Floats, names: Sequence[str], parts: Sequence[Fold]) -> SupportFlags:
    """Return the flags over controls (N, d) of clips held out by folds."""
    alarms, beyond = [], []
    for fold in parts:
        is_held = np.isin(np.arange(len(controls)), fold.held)
        held, fitted = controls[is_held], support.fit_support(controls[~is_held])
        alarms.append(~fitted.supported(held))
        flagged = [_flagged_beyond(fitted, held, control) for control in range(len(names))]
        beyond.append(np.stack(flagged, axis=1))
    shares = np.concatenate(beyond).mean(axis=0).tolist()
    return SupportFlags(float(np.concatenate(alarms).mean()), dict(zip(names, shares, strict=True)))


def _flagged_beyond(fitted: support.Support, held: Floats, control: int) -> Floats:
    """Return the share (H,) of both ends of a control beyond which each held clip is flagged."""
    room = BEYOND_SHARE * (fitted.high - fitted.low)[control]
    flagged = []
    for end in (fitted.low[control] - room, fitted.high[control] + room):
        moved = held.copy()
        moved[:, control] = end
        flagged.append(~fitted.supported(moved))
    return np.asarray(np.mean(flagged, axis=0))
