"""What a model can be asked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from service.motion.roles import Names

Policy = Literal["ok", "warn", "refuse"]
"""What to do with controls like which nothing was captured, outside what was sampled or in a gap of
it, and with targets out of reach. Answer and say no more than that, warn as well, or refuse."""

Root = Literal["travelling", "in_place"]
"""Whether a clip goes where it leads, or stays where it begins."""

Exact = Literal["auto", "none"] | tuple[str, ...]
"""Which measured controls an answer is held to: those that were given, none, or those named."""

Moment = Literal["start", "end", "event", "highest", "lowest", "farthest"]
"""A moment of the motion; farthest is from the root."""

When = float | Moment
"""When a target counts: seconds from the start of the clip, or a moment of the motion."""


@dataclass(frozen=True)
class Target:
    """A joint, by name, that is to be in its place, m, in the frame of the clip, at a moment."""

    joint: str
    position: tuple[float, float, float]
    when: When


@dataclass(frozen=True)
class Hold:
    """What an answer is held to: measured controls, targets, and feet that are to stay where they
    stand."""

    exact: Exact = "auto"
    targets: tuple[Target, ...] = ()
    pin_feet: bool = False


FPS = 30.0
HOLD = Hold()
POLICY: Policy = "warn"
NAMES: Names = "own"
ROOT: Root = "travelling"


@dataclass(frozen=True)
class PoseQuestion:
    """Which poses: control values, times, s from the start of the clip, who moves, nobody that was
    seen for none, and the level of detail.

    extrapolate: what to do with controls like which nothing was captured, and with targets out of
    reach. joint_sigma: whether the answer says how far each joint may err. hold: what the motion
    has to meet exactly.
    """

    controls: Mapping[str, float]
    times: Sequence[float]
    extrapolate: Policy = POLICY
    performer: str | None = None
    level: int = 0
    joint_sigma: bool = False
    hold: Hold = HOLD


@dataclass(frozen=True)
class ClipQuestion:
    """Which clip: control values, frames a second, the part between start and end, s, who moves,
    nobody that was seen for none, and the level of detail.

    extrapolate: what to do with controls like which nothing was captured, and with targets out of
    reach. end: none for the clip's own. names: what joints are called, which is all that changes by
    it: bones keep their axes. root: in place, the frame that goes along a cycle's arc is taken out,
    heading and all, or the straight way from the first pose to the last of what is no cycle,
    evenly, the heading left as it is; heights stay, and so does all of a model that is in place
    already. loop: a whole cycle as N = max(1, round(duration * fps)) steps, without start and end.
    Its frame N is its first again: equal in every number where it stays in place, else carried by
    the cycle's way and turn. It plays N / fps seconds, which is the duration but for the rounding.
    hold: what the clip has to meet exactly. joint_sigma: whether the answer says how far each joint
    may err.
    """

    controls: Mapping[str, float]
    fps: float = FPS
    extrapolate: Policy = POLICY
    start: float = 0.0
    end: float | None = None
    performer: str | None = None
    level: int = 0
    names: Names = NAMES
    root: Root = ROOT
    loop: bool = False
    joint_sigma: bool = False
    hold: Hold = HOLD


MotionQuestion = PoseQuestion | ClipQuestion
"""Either: both ask for a motion alike, and then for some of it."""


@dataclass(frozen=True)
class Prospect:
    """What is known of a clip before it is synthesised: its frames, what is warned of, and whether
    it misses some target."""

    frames: int
    warnings: tuple[str, ...]
    missed: bool = False
