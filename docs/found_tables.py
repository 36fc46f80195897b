"""Tables of families that are found in long takes, of their models, and of roles of joints.

`found_families.json` is written by benchmarks/found_models.py, `proposed_controls.json` by
benchmarks/proposed_controls.py, `roles.json` by benchmarks/roles.py.
"""

from typing import Any

import measured_tables
from measured_tables import Rows

FAMILY_COLUMNS = ["action", "families", "clips", "right", "cuts", "found"]
PRECISION, RECALL = (0.90, 0.95), (0.80, 0.95)
"""Share of right clips and of found cuts that families must have, and that is wished for."""
MODEL_COLUMNS = [
    "action",
    "clips found, cut by hand",
    "of found clips, cm",
    "of clips cut by hand, cm",
    "difference",
    "must",
    "with the root's travel, cm",
]
MOST_WORSE = 5.0
"""Percent that a model of found clips may be worse."""
ENDS = (0.10, 0.30)
"""Median and 90th percentile, s, of the distance of ends, without the convention of each family."""
SECONDS_PER_MINUTE = 60.0 / 12.0
"""Processor time for a minute of takes."""
CONTROL_COLUMNS = [
    "recipe",
    "controls by hand",
    "not proposed",
    "variance that remains with the proposed ones",
    "with those by hand",
]
INCLUDED = (4, 6)
"""Recipes whose controls must be among those proposed, and for which that is wished."""
ROLE_COLUMNS = ["conventions", "roles", "right", "asked", "wrong", "right in the first run", "must"]
RIGHT_ROLES = 0.95
SETS = {
    "development": "of development",
    "held_out": "held out",
    "held_out_later": "held out, written after the first rule that followed",
    "held_out_last": "held out, written after all rules that followed",
}


def families() -> Rows:
    """Yield the clips of offered families and the cuts by hand of each action."""
    own = measured_tables.read("found_families")["families"]
    for row in own["actions"]:
        yield _family(f"`{row['action']}`", row)
    yield _family("all", own["all"])


def _family(name: str, row: dict[str, Any]) -> list[str]:
    share = f" ({_percent(row['right'], row['clips'])})" if row["clips"] else ""
    found = f"{row['found']} ({_percent(row['found'], row['cuts'])})"
    counts = [str(row[key]) for key in ("families", "clips")]
    return [name, *counts, f"{row['right']}{share}", str(row["cuts"]), found]


def families_remark() -> str:
    """Return sentences on precision, recall, distances of ends and processor time."""
    own = measured_tables.read("found_families")["families"]
    every, ends = own["all"], own["ends"]
    allowed = SECONDS_PER_MINUTE * own["minutes"]
    said = [
        f"Precision {_judged(every['right'] / every['clips'], PRECISION)}.",
        f"Recall {_judged(every['found'] / every['cuts'], RECALL)}.",
        f"Ends lie {ends['median']:.2f} s from those of the cuts in the median and "
        f"{ends['p90']:.2f} s in the 90th percentile; without the median of each family "
        f"{ends['convention_median']:.2f} s (must {ENDS[0]:g} s, "
        f"{_verdict(round(ends['convention_median'], 2) <= ENDS[0])}) and "
        f"{ends['convention_p90']:.2f} s (must {ENDS[1]:g} s, "
        f"{_verdict(round(ends['convention_p90'], 2) <= ENDS[1])}).",
        f"`posefield discover` takes {own['seconds']:.0f} s of processor time for "
        f"{own['minutes']:.1f} minutes of takes (must {allowed:.0f} s, "
        f"{_verdict(own['seconds'] <= allowed)}).",
    ]
    return " ".join(said)


def models() -> Rows:
    """Yield the errors of models of found clips and of clips cut by hand."""
    for own in measured_tables.read("found_families")["models"]:
        found, by_hand = (own["relative_cm"][key] for key in ("found", "by_hand"))
        more = 100.0 * (found / by_hand - 1.0)
        travel = own["absolute_rms_cm"]
        yield [
            f"`{own['action']}`",
            f"{own['clips']['found']}, {own['clips']['by_hand']}",
            f"{found:.2f}",
            f"{by_hand:.2f}",
            f"{more:+.1f} %",
            f"{MOST_WORSE:+g} %, {_verdict(more <= MOST_WORSE)}",
            f"{travel['found']:.2f}, {travel['by_hand']:.2f}",
        ]


def controls() -> Rows:
    """Yield the controls of shipped recipes, and those that are not among the proposed ones."""
    for own in measured_tables.read("proposed_controls")["recipes"]:
        yield [
            f"`{own['recipe']}`",
            ", ".join(own["by_hand"]),
            ", ".join(own["lacking"]) or "none",
            *(f"{100.0 * own[key]:.0f} %" for key in ("remaining", "remaining_by_hand")),
        ]


def controls_remark() -> str:
    """Return a sentence on the number of recipes whose controls are all proposed."""
    found = measured_tables.read("proposed_controls")["recipes"]
    count = sum(not own["lacking"] for own in found)
    alike = sum(own["remaining"] <= own["remaining_by_hand"] for own in found)
    must, wish = (f"{limit}, {_verdict(count >= limit)}" for limit in INCLUDED)
    return (
        f"All controls by hand are proposed for {count} of {len(found)} recipes (must {must}; wish "
        f"{wish}); the proposed ones explain as much for {alike}."
    )


def roles() -> Rows:
    """Yield the roles of each set of conventions, and of all that were held out."""
    tables = measured_tables.read("roles")["tables"]
    held = [own for own in tables if own["first"]]
    for own in tables:
        yield [*_roles(SETS[own["table"]], [own]), ""]
    several = sum(sum(own["now"].values()) for own in held)
    runs = [(_sum(held, run, "right"), _sum(held, run, "wrong")) for run in ("now", "first")]
    met = [_verdict(right >= RIGHT_ROLES * several and not wrong) for right, wrong in runs]
    verdict = f"{100 * RIGHT_ROLES:g} % and none wrong: now {met[0]}, in the first run {met[1]}"
    yield [*_roles("all held out", held), verdict]


def _roles(name: str, tables: list[dict[str, Any]]) -> list[str]:
    right, asked, wrong = (_sum(tables, "now", key) for key in ("right", "asked", "wrong"))
    several = right + asked + wrong
    first = ""
    if all(own["first"] for own in tables):
        before = _sum(tables, "first", "right")
        first = f"{before} ({_percent(before, several)}; {_sum(tables, 'first', 'wrong')} wrong)"
    count = sum(len(own["conventions"]) for own in tables)
    shown = f"{right} ({_percent(right, several)})"
    return [f"{count} {name}", str(several), shown, str(asked), str(wrong), first]


def _sum(tables: list[dict[str, Any]], run: str, key: str) -> int:
    return sum(own[run][key] for own in tables)


def roles_remark() -> str:
    """Return a sentence with the names of the conventions that were held out."""
    tables = measured_tables.read("roles")["tables"]
    said = [", ".join(own["conventions"]) for own in tables if own["first"]]
    return f"Held out were, in three sets: {'; '.join(said)}."


def _judged(share: float, limits: tuple[float, float]) -> str:
    must, wish = (f"{limit:g}, {_verdict(share >= limit)}" for limit in limits)
    return f"{share:.3f} (must {must}; wish {wish})"


def _percent(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.1f} %"


def _verdict(is_met: bool) -> str:
    return "met" if is_met else "**missed**"
