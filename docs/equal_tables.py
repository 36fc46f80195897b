"""Tables of comparisons with equal information, made of the files of `make evaluate`."""

import math
from collections.abc import Iterator
from typing import Any

from evaluation_tables import FAMILIES, OPEN, known_performer, protocols

BEST_COLUMNS = [
    "family (takes)",
    "measure",
    "posefield",
    "best single peer",
    "its error",
    "difference ± standard error",
    "posefield is",
]
POOLED_COLUMNS = ["measure", "best single peer", "posefield's error", "posefield is", "goal"]
CALIBRATION_GOAL = "required, desired"
UNITS = {"relative": "cm", "global": "cm", "effector": "cm", "duration": "%"}
GOALS = {"relative": "0, −2 %", "global": "−3, −5 %", "effector": "−8, −15 %"}
"""Required and desired differences from the best single peer, over all captured families."""
NOT_POOLED = ("reaching",)
"""The procedural family is synthetic and has no performers."""
BETTER, WITHIN, WORSE = "better", "within one standard error", "worse"
Rows = Iterator[list[str]]
Found = dict[str, Any]


def tables(information: str) -> dict[str, Found]:
    """Return the comparison of each family: "known" or "open", as the performer is."""
    every = {family: known_performer(family).get("equal_information", {}) for family in FAMILIES}
    return {family: own[information] for family, own in every.items() if information in own}


def best(information: str) -> Rows:
    """Yield posefield and the best single peer of each family and measure, good and bad rows."""
    for family, own in tables(information).items():
        for measure, row in own["best"].items():
            unit, worse = UNITS[measure], row["verdict"] == WORSE
            verdict = f"**{row['verdict']}**" if worse else row["verdict"]
            yield [
                f"{FAMILIES[family]} ({own['takes']:,})",
                f"{measure}, {unit}",
                f"{row['posefield']:.2f}",
                _plain_name(row["peer"], information),
                f"{row['error']:.2f}",
                f"{row['difference']:+.2f} ± {row['standard_error']:.2f}",
                verdict,
            ]


def counts(information: str) -> str:
    """Return how many rows of `best` are better, within a standard error, and worse."""
    verdicts = [row[-1].strip("*") for row in best(information)]
    shown = (f"{verdicts.count(name)} {name}" for name in (BETTER, WITHIN, WORSE))
    return f"Rows of this table: {', '.join(shown)}."


def pooled(information: str) -> Rows:
    """Yield the geometric mean over captured families of posefield's error over a single peer's.

    The peer is the one with the least geometric mean. Standard errors are those of the families'
    paired differences, carried through the logarithm.
    """
    found = {f: own for f, own in tables(information).items() if f not in NOT_POOLED}
    for measure, goal in GOALS.items():
        peers = [
            name
            for name in next(iter(found.values()), {"peers": {}})["peers"]
            if all(measure in own["peers"].get(name, {}) for own in found.values())
        ]
        if not peers:
            continue
        ratios = {name: _pooled_ratio(found, measure, name) for name in peers}
        name = max(peers, key=lambda one: ratios[one][0])
        ratio, error = ratios[name]
        share = ratio - 1.0
        verdict = BETTER if share < -error else f"**{WORSE}**" if share > error else WITHIN
        cells = [
            measure,
            _plain_name(name, information),
            f"{100 * share:+.1f} ± {100 * error:.1f} %",
        ]
        yield [*cells, verdict, goal]


def _pooled_ratio(found: dict[str, Found], measure: str, name: str) -> tuple[float, float]:
    """Return the geometric mean of posefield's error over a peer's, and its standard error."""
    rows = [own["peers"][name][measure] for own in found.values()]
    ratio = math.exp(sum(math.log(row["posefield"] / row["error"]) for row in rows) / len(rows))
    shares = [row["standard_error"] / row["error"] for row in rows]
    return ratio, ratio * math.sqrt(sum(share**2 for share in shares)) / len(rows)


def _plain_name(name: str, information: str) -> str:
    """Return a peer's name; where it could have known the performer, that it does not."""
    end = " without the performer" if information == "known" and name.endswith(OPEN) else ""
    return name.removesuffix(OPEN).replace("_", " ") + end


def calibration() -> Rows:
    """Yield calibration, duration, acceleration, foot speed and reachability of each family."""
    found = {family: known_performer(family) for family in FAMILIES}
    ours = [own["methods"]["posefield"] for own in found.values()]
    exact = [own["methods"].get("posefield_exact", {}).get("exact", {}) for own in found.values()]
    sigma = [own.get("sigma_ratio") for own in found.values()]
    yield ["sigma ratio", *(_number(value) for value in sigma), "0.8 to 1.25, 0.9 to 1.15"]
    duration = [_percent(own.get("duration_error")) for own in ours]
    yield ["error of the duration", *duration, "0.5 % where controls fix it"]
    unreachable = [_percent(own.get("out_of_reach")) for own in exact]
    yield ["captured targets reported as out of reach", *unreachable, "at most 5 %"]
    yield ["acceleration over that of the captures", *_numbers(ours, "acceleration_ratio"), ""]
    if any(peaks := [_peak(own) for own in ours]):
        yield ["peak acceleration of a frame, mean (worst)", *peaks, "1.3, 1.1"]
        biased = [own["methods"].get("posefield_uncorrected", {}) for own in found.values()]
        yield ["the same without the correction of time functions", *map(_peak, biased), ""]
        first, last = (_numbers(ours, f"{end}_frames_ratio") for end in ("first", "last"))
        yield ["acceleration of the first three frames", *first, "1.4, 1.1"]
        yield ["acceleration of the last three frames", *last, ""]
    yield ["speed of feet on the ground, the same", *_numbers(ours, "skate_ratio"), ""]
    named = [protocols(f)["first"].get("performers", {}).get("named_nearer") for f in FAMILIES]
    yield ["nearer by the performer's name", *map(_percent, named), ""]


def _numbers(found: list[Found], key: str) -> list[str]:
    return [_number(own.get(key)) for own in found]


def _peak(own: Found) -> str:
    if own.get("peak_ratio") is None:
        return ""
    return f"{own['peak_ratio']:.2f} ({own['worst_peak_ratio']:.1f})"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"


def _percent(value: float | None) -> str:
    return "" if value is None else f"{100 * value:.1f} %"
