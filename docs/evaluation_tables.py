"""Tables of results, made of the files that `make evaluate` writes."""

import json
from collections.abc import Callable, Iterator, Sequence
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "results/evaluation"
ALL_FAMILIES = {
    "cmu_walk": "walk",
    "hdm05_grab_high": "grab",
    "hdm05_deposit_floor": "deposit",
    "hdm05_kick": "kick",
    "hdm05_hop": "hop",
    "hdm05_squat": "squat",
    "bandai_raise_hand": "raise hand",
    "reaching": "procedural",
}
"""Families, and the heading of each one's column."""
FAMILIES = {
    family: name for family, name in ALL_FAMILIES.items() if (FOLDER / f"{family}.json").exists()
}
"""Those with a file in the folder, as `make evaluate` writes them."""
CLIPS, PERFORMERS, TRUTH = (
    "leave_one_clip_out",
    "leave_one_performer_out",
    "truth",
)
OPEN = "_no_performer"
"""End of the name of a method that is not told the performer."""
GOALS = "required, desired"
BEYOND = "detected 25 % beyond a control, worst control"
SHOWN = (1, 3, 5)
"""Numbers of clips that a model is adapted with."""
Rows = Iterator[list[str]]
Found = dict[str, Any]


@cache
def protocols(family: str) -> Found:
    """Return the results of a family by protocol."""
    found = json.loads((FOLDER / f"{family}.json").read_text(encoding="utf-8"))
    by_name = {each["protocol"]: each for each in (found, *found["others"])}
    # The file's own figures, on all protocols, stand beside those of the first.
    return {**by_name, "first": found}


def known_performer(family: str) -> Found:
    """Return the results with performers known: takes held out, or the noise-free truth."""
    found = protocols(family)
    return found.get(TRUTH) or found[CLIPS]


def new_performer(family: str) -> Found:
    """Return the results with performers held out; without methods where that was not run."""
    return protocols(family).get(PERFORMERS) or {"clips": 0, "methods": {}}


def headings(first: str, results: Callable[[str], Found]) -> list[str]:
    """Return the columns of a table with the number of clips of each family."""
    shown = [f"{name} ({results(family)['clips']:,})" for family, name in FAMILIES.items()]
    return [first, *shown]


def errors(results: Callable[[str], Found]) -> Rows:
    """Yield root-relative, global and effector error of each method told the performer, cm."""
    methods = dict.fromkeys(
        name
        for family in FAMILIES
        for name in results(family)["methods"]
        if not name.endswith(OPEN)
    )
    for method in methods:
        cells = [_errors(results(family)["methods"].get(method)) for family in FAMILIES]
        name = method.replace("_", " ")
        yield (
            [f"**{name}**", *(f"**{cell}**" for cell in cells)]
            if method == "posefield"
            else [name, *cells]
        )


def _errors(found: Found | None) -> str:
    if not found or "relative_cm" not in found:
        return ""
    distances = [f"{found['relative_cm']:.2f}", f"{found['global_cm']:.1f}"]
    effector = found.get("effector_cm")
    return " / ".join(distances if effector is None else [*distances, f"{effector:.1f}"])


def adapted() -> Rows:
    """Yield the root-relative error after adaptation by some clips, cm, and its excess."""
    found = [protocols(family)["first"]["performers"] for family in adapted_families().values()]
    label = "posefield_adapt_{}".format
    yield ["none (an unseen performer)", *(f"{f[label(1)]['shown_none_cm']:.2f}" for f in found)]
    for count in SHOWN:
        rows = [f[label(count)] for f in found]
        cells = [
            f"{row['relative_cm']:.2f} (+{100 * row['farther_than_all']:.2g} %)" for row in rows
        ]
        yield [f"{count} clip{'s' * (count > 1)}", *cells]
    yield [
        "trained with all other clips (leave one clip out)",
        *(f"{f[label(1)]['shown_all_cm']:.2f}" for f in found),
    ]


def adapted_families() -> dict[str, str]:
    """Return the families with adapted models, by heading."""
    found = {name: protocols(family)["first"] for family, name in FAMILIES.items()}
    families = dict(zip(FAMILIES.values(), FAMILIES, strict=True))
    return {name: families[name] for name, each in found.items() if each.get("performers")}


def exact() -> Rows:
    """Yield how exactly targets at captured places are met, and what becomes of those beyond."""
    found = {family: known_performer(family)["methods"] for family in FAMILIES}
    found = {family: own for family, own in found.items() if "posefield_exact" in own}
    before = [each["posefield"]["effector_cm"] for each in found.values()]
    after = [each["posefield_exact"]["exact"] for each in found.values()]
    pairs = zip(before, after, strict=True)
    cells = [f"{first:.1f} → {_plain(own['effector_cm'], 1)}" for first, own in pairs]
    yield ["effector before → after, cm", *cells, ""]
    for name, form, goal in EXACT_ROWS:
        yield [name, *(form(own) for own in after), goal]


def _mean_and_worst(key: str, digits: int) -> Callable[[Found], str]:
    """Return the text of a figure; empty for the hips, which no limb carries beyond its reach."""
    return lambda own: (
        f"{own[key]:.{digits}f} ({own[key + '_worst']:.{digits}f})" if key in own else ""
    )


def _plain(value: float, digits: int) -> str:
    """Return a number with some significant digits and without an exponent."""
    return format(Decimal(f"{value:.{digits}g}"), "f")


def _percent(key: str, sign: str = "") -> Callable[[Found], str]:
    return lambda own: f"{100 * own[key]:{sign}.1f} %" if key in own else ""


EXACT_ROWS: tuple[tuple[str, Callable[[Found], str], str], ...] = (
    ("worst clip, cm", lambda own: _plain(own["effector_cm_worst"], 3), "0.1, 0.01"),
    ("steps, mean (most)", _mean_and_worst("steps", 1), "at most 5"),
    ("root-relative error", _percent("relative_change", "+"), "at most +2 %"),
    ("global error", _percent("global_change", "+"), "reaches −2 %, −6 %"),
    (
        "acceleration after / before, mean (worst)",
        _mean_and_worst("acceleration", 2),
        "1.10 (1.35)",
    ),
    ("distance of captured places, deviations", lambda own: f"{own['distance']:.2f}", "1.3 to 1.8"),
    ("captured places reported as out of reach", _percent("out_of_reach"), "5, 3 %"),
    ("places 10 cm beyond, reported", _percent("out_of_reach_10cm"), ""),
    ("20 cm beyond, reported", _percent("out_of_reach_20cm"), "90, 94 %"),
    ("30 cm beyond, reported", _percent("out_of_reach_30cm"), "100 %"),
    ("one metre beyond, reported", _percent("far_out_of_reach"), "100 %"),
    (
        "one metre beyond: acceleration, mean (worst)",
        _mean_and_worst("far_acceleration", 2),
        "1.35",
    ),
    ("one metre beyond: root moved, mean (most), cm", _mean_and_worst("far_root_cm", 1), "12"),
    ("a clip, ms (median, beside other work)", lambda own: f"{own['ms']:.1f}", "5, 2.5"),
)
"""Rows of the table of targets: name, text of a family's figures, required and desired value."""


def support() -> Rows:
    """Yield false alarms of the support flag on held-out clips, and detections beyond controls."""
    for family, name in FAMILIES.items():
        found = protocols(family)[CLIPS]
        if found.get("support"):
            beyond = min(found["support"]["beyond"].values())
            controls = f"{found['clips']} clips, {len(found['support']['beyond'])} controls"
            false_alarms = f"{100 * found['support']['false_alarms']:.1f} %"
            yield [f"{name} ({controls})", false_alarms, f"{100 * beyond:.0f} %"]
    yield ["required, desired", "15, 12 %", "95, 100 %"]


def feet_families() -> list[str]:
    """Return the families whose evaluation has clips with standing feet."""
    return [family for family in FAMILIES if protocols(family).get(CLIPS, {}).get("feet")]


def feet() -> Rows:
    """Yield the feet of clips held out, as predicted and standing, and what standing costs."""
    found = [protocols(family)[CLIPS]["feet"] for family in feet_families()]
    for name, text, goal in FEET_ROWS:
        if any(cells := [text(own) for own in found]):
            yield [name, *cells, goal]


def _change(key: str) -> Callable[[Found], str]:
    """Return the text of a ratio, as predicted and standing; empty where it was not measured."""
    return lambda own: (
        f"{own[key]['predicted']:.2f} → {own[key]['standing']:.2f}" if key in own else ""
    )


def _worst_peak(own: Found) -> str:
    """Return the mean and worst ratio of peaks, as predicted and standing; empty if unmeasured."""
    if "peak" not in own:
        return ""
    peaks = (
        f"{own['peak'][name]:.2f} ({own['worst_peak'][name]:.1f})"
        for name in ("predicted", "standing")
    )
    return " → ".join(peaks)


def _locked(key: str) -> Callable[[Found], str]:
    """Return the text of feet that are locked without swing rules; empty where not measured."""
    return lambda own: f"{own[key]['locked']:.2f}" if "locked" in own[key] else ""


FEET_ROWS: tuple[tuple[str, Callable[[Found], str], str], ...] = (
    ("speed of planted feet over captured", _change("skate"), "1.2, 1.0"),
    (
        "weighted speed of low feet over captured (Zhang et al. 2018)",
        _change("weighted_skate"),
        "1.0, 0.8",
    ),
    ("speed of planted feet, locked without rules of swings", _locked("skate"), ""),
    ("weighted speed of low feet, locked without rules of swings", _locked("weighted_skate"), ""),
    (
        "relative distance, cm",
        lambda own: f"{own['predicted_error_cm']:.2f} → {own['standing_error_cm']:.2f}",
        "+0.15, +0.05",
    ),
    ("acceleration over captured", _change("acceleration"), "× 1.15, × 1.05"),
    ("peak acceleration of a frame over captured, mean (worst)", _worst_peak, "1.3, 1.1"),
    ("acceleration of the first three frames over captured", _change("first_frames"), "1.4, 1.1"),
    ("acceleration of the last three frames over captured", _change("last_frames"), ""),
    ("99th percentile of the knees' acceleration over captured", _change("knee_peak"), "3, 1.5"),
    (
        "pelvis lowered, worst clip, cm",
        lambda own: f"{own['lowered_worst_cm']:.1f}",
        # Below the limit itself, which is 2 cm.
        "1.5, 0.5",
    ),
)
"""Rows of the table of feet: name, text of a family's figures, required and desired value."""


def take_families() -> list[str]:
    """Return the families whose evaluation has takes of held-out clips."""
    return [family for family in FAMILIES if "clips" in _takes(family)]


def takes() -> Rows:
    """Yield the takes of clips held out, each value with the negative control beside it."""
    found = [_takes(family) for family in take_families()]
    for name, text, goal in TAKE_ROWS:
        yield [name, *(text(own) for own in found), goal]


def _takes(family: str) -> Found:
    """Return the figures of a family's takes; empty where none were measured."""
    found: Found = protocols(family).get(CLIPS, {}).get("takes", {})
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
