"""The `crowd` command: from a model file to a file of characters who walk, and what to tell."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import typer

from service.encode import crowd_arrays
from service.motion.conventions import Floats
from service.motion.crowd import CrowdClip, Motions
from service.motion.errors import FileError, InvalidField
from service.synthesis import session
from service.synthesis.walk import company, gait, given, skating
from service.synthesis.walk.gait import Gait
from service.synthesis.walk.march import Plan

COUNT = 500


@dataclass(frozen=True)
class Order:
    """What was asked for: `count` characters that wander, or as many as the file of `paths` has."""

    count: int | None
    paths: Path | None
    seconds: float
    fps: float
    seed: int


def write(model: Path, order: Order, output: Path) -> dict[str, Any]:
    """Write a crowd and tell what it is, as plain values.

    Raises InvalidField and FileError.
    """
    if output.suffix != ".npz":
        raise InvalidField("output", f"{output.name!r}, expected a name that ends in .npz")
    opened = gait.of(session.load(model))
    plan = _plan(opened, order)
    crowd = company.crowd(opened.session, plan)
    feet = _Feet(opened, order.fps)
    crowd_arrays.write(_watched(crowd, feet), output)
    characters = len(plan.who)
    return {
        "file": str(output),
        "model": crowd.facts["model"],
        "characters": characters,
        "frames": crowd.frames,
        "rate": crowd.rate,
        "seed": order.seed,
        "outside_share": crowd.facts["outside_share"],
        **feet.facts(),
    }


def _plan(opened: Gait, order: Order) -> Plan:
    if order.paths is None:
        count = COUNT if order.count is None else order.count
        return company.wandering(opened, count, order.seconds, order.fps, order.seed)
    if order.count is not None:
        raise InvalidField("count", f"{order.count}, expected none: every path has one character")
    routes = given.parse(_json(order.paths))
    return company.following(opened, routes, order.seconds, order.fps, order.seed)


def _json(path: Path) -> Any:
    try:
        return orjson.loads(path.read_bytes())
    except OSError as fault:
        raise FileError(path, f"cannot be read: {fault.strerror}") from fault
    except orjson.JSONDecodeError as fault:
        raise FileError(path, f"not JSON: {fault}") from fault


@dataclass(frozen=True)
class _Feet:
    """Looks at motions as they pass, for how their feet slide; blind where no feet are named."""

    gait: Gait
    rate: float
    seen: list[Floats] = field(default_factory=list)

    def look(self, motions: Motions) -> None:
        card = self.gait.session.card
        if card.feet:
            self.seen.append(skating.of(card, motions, self.rate).ravel())

    def facts(self) -> dict[str, float]:
        if not self.seen:
            return {}
        return {
            "skate_cm_per_s": round(100.0 * float(np.concatenate(self.seen).mean()), 2),
            "skate_strides_cm_per_s": round(100.0 * skating.usual(self.gait, self.rate), 2),
        }


def _watched(crowd: CrowdClip, feet: _Feet) -> CrowdClip:
    """The crowd, with a bar on standard error that grows as its motions are made."""

    def batches() -> Iterator[Motions]:
        with typer.progressbar(length=len(crowd.motion), label="walking", file=sys.stderr) as bar:
            for motions in crowd.batches:
                feet.look(motions)
                yield motions
                bar.update(len(motions))

    return replace(crowd, batches=batches())


def said(facts: dict[str, Any]) -> str:
    """What to tell of a crowd on a few lines."""
    lines = [
        f"{facts['file']}: {facts['characters']} characters, {facts['frames']} frames at "
        f"{facts['rate']:g} a second, seed {facts['seed']}"
    ]
    if "skate_cm_per_s" in facts:
        lines.append(
            f"feet on the ground slide at {facts['skate_cm_per_s']:.1f} cm/s, those of the model's "
            f"own strides at the captured controls at {facts['skate_strides_cm_per_s']:.1f} cm/s"
        )
    if facts["outside_share"]:
        lines.append(
            f"{100 * facts['outside_share']:.1f} % of the poses have some control outside what was "
            "sampled"
        )
    return "\n".join(lines)
