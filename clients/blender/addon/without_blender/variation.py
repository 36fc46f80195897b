"""Take and feet of a request, and feet of an answer in words."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

LARGEST_SEED = 999_999_999
"""Largest seed of a take; 0 is the prediction."""

LARGEST_HEIGHT = 10.0
"""Largest height of a floor, up or down, m."""

VARIETY = 0.7
"""Default size of a take's deviations; 1 is that of captured clips."""

MODEL_DEFAULT = "default"
"""Value of `feet` that leaves the choice to the model: the field is not sent."""

FEET = (MODEL_DEFAULT, "stand", "as_predicted")

SMALL = 0.05
"""Lowering, cm, that rounds to none."""


@dataclass(frozen=True)
class Variation:
    """Fields of a request that vary the prediction.

    seed: of the take, 0 for the prediction. variety: size of the take's deviations, 0 to 1. detail:
    True for sampled details that no control predicts. feet: one of FEET. floor: height of the floor
    on which feet stand, m.
    """

    seed: int = 0
    variety: float = VARIETY
    detail: bool = False
    feet: str = MODEL_DEFAULT
    floor: float = 0.0

    def fields(self) -> dict[str, Any]:
        """Return the fields of a request; what is as by default is left out.

        Services older than 3.3.0 refuse takes, and those older than 4.0.0 feet, by their names.
        """
        take = {"take": self.seed, "variety": self.variety} if self.seed else {}
        detail = {"detail": True} if self.detail else {}
        feet = {} if self.feet == MODEL_DEFAULT else {"feet": self.feet}
        floor = {"floor": self.floor} if self.floor else {}
        return {**take, **detail, **feet, **floor}

    def matches(self, trust: Mapping[str, Any]) -> bool:
        """Return True if an answer with this trust information can be of this variation.

        Whether feet are as asked is told only where they were asked for.
        """
        found = trust.get("take", {})
        same = (found.get("seed", 0), bool(found.get("detail"))) == (self.seed, self.detail)
        stands = {"stand": True, "as_predicted": False}.get(self.feet, "feet" in trust)
        varied = not self.seed or found.get("variety") == self.variety
        floor = trust.get("feet", {}).get("floor", {}).get("height", 0.0)
        return same and varied and stands == ("feet" in trust) and floor == self.floor

    def feet_sentences(self, trust: Mapping[str, Any], why: str) -> list[str]:
        """Return sentences on the feet of an answer: what was planned, or why nothing was done.

        why: reason for which the model's default is `as_predicted`; empty if it is another.
        """
        found = trust.get("feet")
        if found is not None:
            return [*(_placed(found) if found["stances"] else []), *map(str, found["left"])]
        why = why if self.feet == MODEL_DEFAULT else "as asked"
        return [f"Feet are as predicted: {why}" if why else "Feet are as predicted"]


def next_seed(seed: int) -> int:
    """Return the seed of the next take; the last is followed by 1."""
    return seed + 1 if seed < LARGEST_SEED else 1


def of_sliders(seed: int, variety: float, detail: bool, feet: str, floor: float = 0.0) -> Variation:
    """Return the variation of settings that hold float32: 0.7 becomes 0.699999988."""
    variety, floor = (float(str(np.float32(value))) for value in (variety, floor))
    return Variation(seed, variety, detail, feet, floor)


def why_no_stances(card: Mapping[str, Any]) -> str:
    """Return why feet are as predicted unless asked to stand, by a card; empty if they stand."""
    if card.get("root") == "in_place":
        return "the root of this motion stays in place"
    if not card.get("feet"):
        return "the model names no feet"
    return "" if card.get("contacts") else "the model knows no contacts of its feet"


def check_feet(found: Any) -> None:
    """Raise ValueError for other than a FeetResult of the contract; none is needed."""
    if found is None:
        return
    if not isinstance(found, dict):
        raise ValueError(f"feet are {found!r}, expected stances and measures by name")
    numbers = [found[name] for name in ("swings", "skate_before", "skate", "lowered")]
    if not all(isinstance(each, int | float) and math.isfinite(each) for each in numbers):
        raise ValueError(f"feet have swings, skates and lowering {numbers}, expected numbers")
    if not (isinstance(found["stances"], list) and isinstance(found["left"], list)):
        raise ValueError("feet have no lists of stances and of feet left as predicted")


def _placed(found: Mapping[str, Any]) -> list[str]:
    stances, swings = len(found["stances"]), found["swings"]
    before, after = 100 * found["skate_before"], 100 * found["skate"]
    lowered = 100 * found["lowered"]
    said = [
        f"Feet stand: {_counted(stances, 'stance')}, {_counted(swings, 'swing')}",
        f"Feet slide at {after:.1f} cm/s, as predicted at {before:.1f}",
    ]
    return [*said, f"Pelvis lowered by up to {lowered:.1f} cm"] if lowered >= SMALL else said


def _counted(count: int, name: str) -> str:
    return f"{count} {name}" + "s" * (count != 1)
