"""What a model can be asked for."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Policy = Literal["warn", "refuse"]
"""What to do with controls outside what was sampled."""

FPS = 30.0
POLICY: Policy = "warn"


@dataclass(frozen=True)
class ClipQuestion:
    """Which clip: control values, frames a second, the part between start and end, s, who moves,
    nobody that was seen for none, and the level of detail.

    extrapolate: what to do with controls outside what was sampled. end: none for the clip's own.
    """

    controls: Mapping[str, float]
    fps: float = FPS
    extrapolate: Policy = POLICY
    start: float = 0.0
    end: float | None = None
    performer: str | None = None
    level: int = 0


@dataclass(frozen=True)
class Prospect:
    """What is known of a clip before it is synthesised: its frames, and a warning for each control
    outside what was sampled."""

    frames: int
    warnings: tuple[str, ...]
