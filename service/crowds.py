"""The `crowd` command: writes a walking crowd of a model to a file and reports on it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from service.cli.progress import Bar
from service.encode import crowd, crowd_arrays
from service.encode.crowd import writer
from service.motion.conventions import Floats
from service.motion.crowd import CrowdClip, Motions
from service.motion.errors import FileError, InvalidField
from service.synthesis.synthesizer import Synthesizer
from service.synthesis.walk import gait, given, order, skating
from service.synthesis.walk.gait import Gait
from service.synthesis.walk.given import Route
from service.synthesis.walk.order import Order

ENDINGS = (*crowd.FILES, "npz")


def write(model: Synthesizer, asked: Order, instancing: str, output: Path) -> dict[str, Any]:
    """Write a crowd to a file, and return its report as plain values.

    Raises InvalidField for an invalid query or extension, and FileError if the file cannot be
    written.
    """
    ending = output.suffix.removeprefix(".")
    if ending not in ENDINGS:
        raise InvalidField("output", f"{output.name!r} ends in none of {', '.join(ENDINGS)}")
    opened = gait.of(model.session)
    made = order.crowd(model, opened, asked)
    feet = _Feet(opened, asked.fps)
    watched = _watched(made, asked.motions or len(made.motion), feet)
    if ending == "npz":
        crowd_arrays.write(watched, output)
    else:
        writer.write(watched, output, instancing)
    return {
        "file": str(output),
        "model": made.facts["model"],
        "characters": len(made.motion),
        "motions": asked.motions or len(made.motion),
        "frames": made.frames,
        "rate": made.rate,
        "seed": asked.seed,
        "level_shares": made.facts["level_shares"],
        "outside_share": made.facts["outside_share"],
        **feet.facts(),
    }


def routes(path: Path) -> Sequence[Route]:
    """Return the routes of a JSON file.

    Raises FileError for a file that is not JSON, and InvalidField for invalid routes.
    """
    return given.parse(_json(path))


def _json(path: Path) -> Any:
    try:
        return orjson.loads(path.read_bytes())
    except OSError as fault:
        raise FileError(path, f"cannot be read: {fault.strerror}") from fault
    except orjson.JSONDecodeError as fault:
        raise FileError(path, f"not JSON: {fault}") from fault


@dataclass(frozen=True)
class _Feet:
    """Foot skate of motions as they are written; empty if the model's card names no feet."""

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


def _watched(made: CrowdClip, motions: int, feet: _Feet) -> CrowdClip:
    """Return the crowd with a progress bar on standard error while its motions are computed."""

    def batches() -> Iterator[Motions]:
        with Bar("motions", motions) as bar:
            for batch in made.batches:
                feet.look(batch)
                yield batch
                bar.advance(len(batch))

    return replace(made, batches=batches())


def said(facts: dict[str, Any]) -> str:
    """Return the report of a crowd as text."""
    shares = (f"{100.0 * share:.3g} %" for share in facts["level_shares"])
    lines = [
        f"{facts['file']}: {facts['characters']} characters, {facts['frames']} frames at "
        f"{facts['rate']:g} a second, seed {facts['seed']}",
        f"poses at each level of detail, the finest first: {', '.join(shares)}",
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
