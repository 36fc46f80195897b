"""Table of the takes of held-out clips, made of the files of `make evaluate`."""

from collections.abc import Callable, Sequence

import evaluation_tables as tables
from evaluation_tables import Found, Rows


def take_families() -> list[str]:
    """Return the families whose evaluation has takes of held-out clips."""
    return [family for family in tables.FAMILIES if "clips" in _takes(family)]


def takes() -> Rows:
    """Yield the takes of clips held out, each value with the negative control beside it."""
    found = [_takes(family) for family in take_families()]
    for name, text, goal in TAKE_ROWS:
        yield [name, *(text(own) for own in found), goal]


def _takes(family: str) -> Found:
    """Return the figures of a family's takes; empty where none were measured."""
    found: Found = tables.protocols(family).get(tables.CLIPS, {}).get("takes", {})
    return found


def _bins(own: Sequence[float]) -> str:
    return f"{own[0]:.2f} to {own[1]:.2f}"


def _beside(value: str, control: str) -> str:
    return f"{value} ({control})"


def _with_control(key: str, control: str) -> Callable[[Found], str]:
    return lambda own: _beside(f"{own[key]:.2f}", f"{own['controls'][control]:.1f}")


def _of_takes(key: str, name: str, control: str) -> Callable[[Found], str]:
    """Return the text of a ratio to captured clips; empty where a family has no such answer."""

    def text(own: Found) -> str:
        ratios = own[key]
        if name not in ratios:
            return ""
        beside = f"{ratios[control]:.2f}" if control in ratios else ""
        return _beside(f"{ratios[name]:.2f}", beside) if beside else f"{ratios[name]:.2f}"

    return text


TAKE_ROWS: tuple[tuple[str, Callable[[Found], str], str], ...] = (
    (
        "variogram over the model's, six distances (half the scales)",
        lambda own: _beside(
            _bins(own["variogram"]), _bins(own["controls"]["variogram_of_half_scales"])
        ),
        "0.9 to 1.1, 0.97 to 1.03",
    ),
    (
        "variance over kriging variance (without conditioning)",
        _with_control("variance", "variance_without_conditioning"),
        "0.9 to 1.1, 0.97 to 1.03",
    ),
    (
        "mean over seeds in standard errors, RMS (equal errors at samples)",
        _with_control("mean_in_standard_errors", "mean_in_standard_errors_of_equal_errors"),
        "1.3",
    ),
    (
        "acceleration of the prediction over captured",
        _of_takes("acceleration", "predicted", ""),
        "",
    ),
    (
        "acceleration of a take over captured (all time functions varied)",
        _of_takes("acceleration", "take", "unlimited"),
        "walk 0.8 to 1.2; grab 0.7 to 1.2; deposit 1.35",
    ),
    (
        "acceleration with detail over captured (without)",
        _of_takes("acceleration", "detailed", "predicted"),
        "0.85 to 1.15, 0.95 to 1.05",
    ),
    (
        "acceleration of a take with detail over captured",
        _of_takes("acceleration", "detailed_take", ""),
        "0.8 to 1.2, 0.9 to 1.1",
    ),
    (
        "speed of planted feet of a take over captured (before feet stand)",
        _of_takes("skate", "take", "sliding"),
        "1.2, 0.9 to 1.1",
    ),
    (
        "weighted speed of low feet of a take over captured (before feet stand)",
        _of_takes("weighted_skate", "take", "sliding"),
        "1.2",
    ),
)
"""Rows of the table of takes: name, text of a family's figures, required and desired value."""
