"""Requests for clips, and their results with Z up."""

import io
import json
import math
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from . import axes, faults, label_choice, variation
from .cards import parents_by_name
from .label_choice import LabelValue
from .service import Service, fetch, path_of
from .variation import Variation

Floats = npt.NDArray[np.float64]

UNIT = 1e-3
"""Largest deviation of a quaternion's length from one."""


@dataclass(frozen=True)
class Question:
    """Request for a clip of a model.

    model: name, or name@hash. controls: in the units of its card. fps: frames per second.
    labels: name or weights by label set, `performer` among them; sets that are not given are left
    open. level: of detail, 0 is the finest. variation: take and feet.
    """

    model: str
    controls: dict[str, float]
    fps: float = 30.0
    labels: dict[str, LabelValue] = field(default_factory=dict)
    level: int = 0
    root: str = "travelling"
    loop: bool = False
    variation: Variation = field(default_factory=Variation)

    def body(self) -> dict[str, Any]:
        """Return the request as the service's JSON."""
        return {
            "controls": self.controls,
            "fps": self.fps,
            **label_choice.fields(self.labels),
            "level": self.level,
            "root": self.root,
            "loop": self.loop,
            **self.variation.fields(),
            "unit": "m",
            "up": "y",
        }


@dataclass(frozen=True)
class Clip:
    """A motion with Z up, in metres.

    parents: of each joint by name, None for the root. rotations: (F, J, 4), unit quaternions w x y
    z local to the parent, with continuous signs. path: of the root (F, 3). offsets: from the
    parents (J, 3), zero for the root. rate: frames per second. trust: the service's trust
    information. curves: names of the curves of the answer, which are not animated here.
    """

    parents: dict[str, str | None]
    rotations: Floats
    path: Floats
    offsets: Floats
    rate: float
    trust: dict[str, Any] = field(default_factory=dict)
    curves: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """Return the joints, parents first."""
        return list(self.parents)

    @property
    def sigma(self) -> float:
        """Return the standard deviation of a captured clip from this one, m."""
        return float(self.trust["sigma"])

    def answers(
        self, model: str, controls: dict[str, float], labels: dict[str, LabelValue]
    ) -> bool:
        """Return True if the clip is the result for these arguments."""
        said = self.trust["model"], self.trust["controls"], label_choice.of_trust(self.trust)
        return said == (model, controls, labels)

    def __len__(self) -> int:
        return len(self.path)


def ask(service: Service, question: Question) -> Clip:
    """Return the clip; raise Fault for an error of the request or an invalid result."""
    content = fetch(service, path_of(question.model) + "/clip.npz", question.body())
    return decode(content)


def decode(content: bytes, check: Callable[[dict[str, Any]], None] | None = None) -> Clip:
    """Return the clip of an npz file with Y up, in metres; Unintelligible describes an error.

    check: of the trust, raises ValueError, KeyError or TypeError; by default that of a clip.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as found:
            return _clip(found, check or _check_trust)
    except (ValueError, KeyError, TypeError, OSError, EOFError, zipfile.BadZipFile) as fault:
        raise faults.Unintelligible(f"the clip cannot be read: {fault}") from fault


def _clip(found: Any, check: Callable[[dict[str, Any]], None]) -> Clip:
    names = [str(name) for name in found["names"]]
    rotations = np.asarray(found["rotations"], dtype=float)
    path = np.asarray(found["root_position"], dtype=float)
    offsets = np.asarray(found["bone_offsets"], dtype=float)
    rate, trust = float(found["rate"]), json.loads(str(found["trust"]))
    _check(json.loads(str(found["units"])), names, (rotations, path, offsets))
    if not (math.isfinite(rate) and rate > 0):
        raise ValueError(f"{rate:g} frames a second, expected more than 0")
    check(trust)
    return Clip(
        parents=parents_by_name(names, found["parents"].tolist()),
        rotations=axes.unrolled(axes.z_up_turns(rotations)),
        path=axes.z_up(path),
        offsets=axes.z_up(offsets),
        rate=rate,
        trust=trust,
        curves=tuple(map(str, found["curve_names"])) if "curve_names" in found else (),
    )


def _check(units: dict[str, str], names: list[str], arrays: tuple[Floats, Floats, Floats]) -> None:
    if (units["length"], units["up"]) != ("metre", "Y"):
        raise ValueError(f"lengths in {units['length']} with {units['up']} up, expected metre, Y")
    rotations, path, offsets = arrays
    frames, joints = len(path), len(names)
    found = rotations.shape, path.shape, offsets.shape
    expected = (frames, joints, 4), (frames, 3), (joints, 3)
    if found != expected or not frames:
        raise ValueError(f"arrays of shapes {found}, expected {expected}")
    if not all(np.isfinite(values).all() for values in arrays):
        raise ValueError("numbers that are not finite")
    furthest = np.abs(np.linalg.norm(rotations, axis=-1) - 1).max()
    if furthest > UNIT:
        raise ValueError(f"a quaternion whose length is {furthest:.2g} off one")


def _check_trust(trust: dict[str, Any]) -> None:
    known = isinstance(trust["model"], str) and isinstance(trust["controls"], dict)
    if not (known and math.isfinite(trust["sigma"])):
        raise ValueError(f"trust is {trust}, expected a model, its controls and a finite sigma")
    # Services older than 2.2.0 report neither flag.
    for flag in ("supported", "performer_seen"):
        if trust.get(flag) not in (None, True, False):
            raise ValueError(f"{flag} is {trust[flag]!r}, expected true or false")
    if not isinstance(trust.get("labels", {}), dict):
        raise ValueError(f"labels are {trust['labels']!r}, expected values by label set")
    variation.check_feet(trust.get("feet"))
    if not isinstance(trust.get("take", {}), dict):
        raise ValueError(f"take is {trust['take']!r}, expected seed, variety and detail")
