"""Choice of levels of detail by the number of pixels that their errors cover.

A camera has a position and a lens, but no direction: a character behind it or outside the image
counts by its distance, since a mirror or a shadow may show it. Clients leave out characters that
cannot be seen.

The service stores no state between requests. Against flicker at a threshold, the client sends the
levels of the last answer, and a character becomes coarser only with a margin (HYSTERESIS).
"""

import math
import time
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from hashlib import blake2b
from typing import Annotated

import numpy as np

from posefield.common.cancellation import ProgressCallback, ignore_progress
from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Indices, PerCharacter, PointControls, PointLabels, Vector
from posefield.inference.onnx_runtime import OUTPUTS
from posefield.inference.session import Session
from posefield.motion import joint_roles
from posefield.motion.joint_roles import NamingConvention
from posefield.motion.skeleton import Skeleton

HYSTERESIS = 0.2
"""A coarser level than the previous one is chosen if its error is below the limit by this share."""
MAX_COORDINATE = 1e6
"""Largest coordinate, m: the float32 of poses resolves 6 cm at this distance."""
MIN_FOV, MAX_HEIGHT = 1e-6, 1e6
"""Smallest field of view, rad, and tallest image, pixels, for which the size of a pixel is
finite.
"""


@dataclass(frozen=True)
class Camera:
    """Camera without direction.

    position: (3,), m. fov: vertical field of view, rad. height: height of the image, pixels.
    """

    position: Vector
    fov: float
    height: float

    def __post_init__(self) -> None:
        # Written so that NaN is refused too.
        if self.position.shape != (3,) or not (np.abs(self.position) <= MAX_COORDINATE).all():
            expected = f"expected three numbers of at most {MAX_COORDINATE:g} m"
            raise InvalidField("camera/position", f"{self.position.tolist()}, {expected}")
        if not MIN_FOV <= self.fov < math.pi:
            expected = f"expected {MIN_FOV:g} to less than pi rad"
            raise InvalidField("camera/fov", f"{self.fov:g} rad, {expected}")
        if not 1.0 <= self.height <= MAX_HEIGHT:
            expected = f"expected 1 to {MAX_HEIGHT:g} pixels"
            raise InvalidField("camera/height", f"{self.height:g} pixels, {expected}")

    @property
    def pixels(self) -> float:
        """Pixels that a metre covers at a distance of a metre, in the middle of the image."""
        return self.height / (2.0 * math.tan(self.fov / 2.0))


@dataclass(frozen=True)
class LevelCriteria:
    """Limits by which levels of detail are chosen.

    pixels: largest error as seen by the camera. budget: seconds that all poses together may take;
    the pixel limit grows until they fit. previous (N,): levels of the last answer.
    """

    camera: Camera
    pixels: float
    budget: float | None
    previous: Annotated[Indices, "characters"] | None


@dataclass(frozen=True)
class LevelTable:
    """Levels of detail, finest first: errors (L,), m, and costs (L,), seconds per pose.

    Costs never increase from a level to the next. The error of a level counts as at least that of
    any finer one.
    """

    errors: Annotated[Floats, "levels"]
    costs: Annotated[Floats, "levels"]


@dataclass(frozen=True)
class LevelChoice:
    """Chosen levels (N,), and the pixel limit that they meet.

    limit: None if even the coarsest level exceeds the budget; all characters are then at the
    coarsest.
    """

    levels: Annotated[Indices, "characters"]
    limit: float | None


def pixels_per_metre(
    camera: Camera, centres: Annotated[Floats, "characters 3"], radius: float
) -> PerCharacter:
    """Return the pixels (N,) that a metre covers on each character.

    centres: (N, 3), m. radius: of each body, m. Measured at the nearest point of a body, as in the
    middle of the image; toward the edges, perspective stretches by 1 / cos² of the angle. Raises
    InvalidField with the index of a character that contains the camera.
    """
    distances = np.linalg.norm(centres - camera.position, axis=-1) - radius
    inside = np.flatnonzero(distances <= 0.0)
    if len(inside):
        raise InvalidField(
            "camera/position",
            f"inside character {inside[0]}: {distances[inside[0]] + radius:.3g} m from its middle, "
            f"expected more than {radius:.3g} m",
        )
    return camera.pixels / distances


def select_levels(ladder: LevelTable, scale: PerCharacter, view: LevelCriteria) -> LevelChoice:
    """Return the coarsest levels within the view's limit; within its budget, if that is tighter.

    scale: pixels (N,) that a metre covers on each character.
    """
    levels = select_by_error(ladder.errors, scale, view.pixels, view.previous)
    if view.budget is None or _seconds(levels, ladder) <= view.budget:
        return LevelChoice(levels, view.pixels)
    return select_by_budget(ladder, scale, view.budget, view.previous)


def budget_warnings(
    choice: LevelChoice, ladder: LevelTable, view: LevelCriteria
) -> tuple[str, ...]:
    """Return a warning if the budget, not the requested pixels, determined the levels."""
    if view.budget is None or choice.limit == view.pixels:
        return ()
    budget = f"the budget of {1e3 * view.budget:g} ms"
    if choice.limit is None:
        milliseconds = 1e3 * _seconds(choice.levels, ladder)
        return (f"at the coarsest level the poses take {milliseconds:.3g} ms, more than {budget}",)
    return (f"{budget} asks for errors of up to {choice.limit:.3g} pixels, not {view.pixels:g}",)


def select_by_error(
    errors: Annotated[Floats, "levels"],
    scale: PerCharacter,
    limit: float,
    previous: Annotated[Indices, "characters"] | None = None,
) -> Annotated[Indices, "characters"]:
    """Return the coarsest levels (N,) whose errors cover at most `limit` pixels; else the finest.

    errors: (L,), m. scale: (N,), pixels per metre. previous: (N,); a coarser level than these must
    meet `limit` reduced by HYSTERESIS.
    """
    return _levels(_thresholds(errors, scale, previous), limit)


def select_by_budget(
    ladder: LevelTable,
    scale: PerCharacter,
    budget: float,
    previous: Annotated[Indices, "characters"] | None = None,
) -> LevelChoice:
    """Return the levels at the smallest limit whose poses take at most `budget` seconds.

    Exact, including hysteresis: the limit is one of the thresholds at which a character changes
    level. The thresholds of each level are sorted and searched by bisection.
    """
    thresholds = _thresholds(ladder.errors, scale, previous)
    steps = np.sort(thresholds, axis=1)

    def fits(limit: float) -> bool:
        reached = [np.searchsorted(row, limit, side="right") for row in steps]
        return _total(np.array([len(scale), *reached]), ladder) <= budget

    firsts = [bisect_left(row, True, key=fits) for row in steps]
    limits = [float(row[i]) for row, i in zip(steps, firsts, strict=True) if i < len(row)]
    if fits(0.0):
        limits.append(0.0)
    if not limits:
        return LevelChoice(np.full(len(scale), len(ladder.errors) - 1), None)
    return LevelChoice(_levels(thresholds, min(limits)), min(limits))


def _thresholds(
    errors: Annotated[Floats, "levels"],
    scale: PerCharacter,
    previous: Annotated[Indices, "characters"] | None,
) -> Annotated[Floats, "levels-1 characters"]:
    """Return the smallest limits (L - 1, N), pixels, for level 1, 2, ... or coarser.

    They never decrease from a level to the next.
    """
    limits = np.maximum.accumulate(errors)[1:, None] * scale
    if previous is not None:
        levels = np.arange(1, len(errors))[:, None]
        np.divide(limits, 1.0 - HYSTERESIS, out=limits, where=levels > previous)
    return limits


def _levels(
    thresholds: Annotated[Floats, "thresholds characters"], limit: float
) -> Annotated[Indices, "characters"]:
    return np.count_nonzero(thresholds <= limit, axis=0)


def _seconds(levels: Annotated[Indices, "characters"], ladder: LevelTable) -> float:
    count = len(ladder.errors)
    return float(np.bincount(levels, minlength=count) @ ladder.costs)


def _total(reached: Annotated[Indices, "levels"], ladder: LevelTable) -> float:
    """Return the seconds of all poses for counts (L,) of characters at each level or coarser."""
    return float((reached - np.append(reached[1:], 0)) @ ladder.costs)


ROUNDS = 7
"""Rounds of the benchmark: few, as it runs whenever a model is opened."""
ROWS_PER_CALL = 512
"""Poses of the calls that are timed, as many as in the calls of a small crowd."""


def seconds_per_pose(
    session: Session, progress: ProgressCallback = ignore_progress
) -> tuple[float, ...]:
    """Return the seconds per pose of each level, in batches as of a crowd.

    Each is the median of the rounds. The costs never increase from a level to the next coarser one,
    since a finer level that is cheaper can be used instead.
    """
    levels = [(session, level) for level in range(len(session.card.levels))]
    return monotone_costs(benchmark_levels(levels, ROUNDS, progress))


def benchmark_levels(
    sessions: Sequence[tuple[Session, int]],
    rounds: int,
    progress: ProgressCallback = ignore_progress,
) -> Annotated[Floats, "{len(sessions)}"]:
    """Return the seconds per pose (N,) of levels of sessions: the median of the rounds.

    rounds: an odd number. Every round measures each level once, so that a slowdown of the machine
    affects all of them. progress: called after each round, and after the one that warms up.
    """
    calls = [(session, _sample_inputs(session), level) for session, level in sessions]
    seconds = []
    for done in range(rounds + 1):
        seconds.append([_time_call(*call) for call in calls])
        progress(done + 1, rounds + 1)
    # np.median imports masked arrays on first use, which takes longer than this measurement.
    return np.sort(seconds[1:], axis=0)[rounds // 2] / ROWS_PER_CALL


def monotone_costs(costs: Annotated[Floats, "levels"]) -> tuple[float, ...]:
    """Return the costs (L,), each lowered to the minimum of itself and those before it."""
    return tuple(np.minimum.accumulate(costs).tolist())


def _sample_inputs(
    session: Session,
) -> tuple[PointControls, Annotated[Floats, "points 1"], PointLabels]:
    """Return controls (B, d) and times (B, 1), s, across the ranges, and zero labels (B, p)."""
    card, rows = session.card, ROWS_PER_CALL
    low, high = ([getattr(c, end) for c in card.controls] for end in ("minimum", "maximum"))
    times = np.linspace(0.0, card.durations[0], rows)[:, None]
    return np.linspace(low, high, rows), times, np.zeros((rows, sum(card.label_counts)))


def _time_call(session: Session, question: tuple[Floats, Floats, Floats], level: int) -> float:
    controls, times, labels = question
    start = time.perf_counter()
    session.run(controls, times, *OUTPUTS, labels=labels, level=level)
    return time.perf_counter() - start


@dataclass(frozen=True)
class NamedModel:
    """An opened model file and the name under which it is asked."""

    name: str
    session: Session = field(repr=False)

    @cached_property
    def identity(self) -> str:
        """name@contenthash; answers under this name never change."""
        return f"{self.name}@{self.session.digest}"

    @cached_property
    def fingerprint(self) -> bytes:
        """Digest of the model file and of this machine's rounding.

        It differs between machines on which the model's answers or the correction differ in the
        last digits.
        """
        content = self.identity.encode() + self.session.golden + rounding_fingerprint()
        return blake2b(content, digest_size=16).digest()

    @cached_property
    def level_table(self) -> LevelTable:
        """Errors and costs of the levels of detail, from which a view chooses.

        An error is that of the worst measured pose. Costs are measured on first use.
        """
        errors = np.array([level.pose for level in self.session.card.levels])
        return LevelTable(errors, np.array(seconds_per_pose(self.session)))

    @property
    def rest_position(self) -> Vector:
        """Root position at rest (3,), m."""
        return self.session.card.skeleton.offsets[0]

    @cached_property
    def radius(self) -> float:
        """Radius, m, of a sphere about the root that contains the body at rest."""
        joints = self.session.card.skeleton
        rest = joints.at_rest(joints.offsets)
        return float(np.linalg.norm(rest - rest[0], axis=-1).max())

    @cached_property
    def _skeletons(self) -> dict[NamingConvention, Skeleton]:
        """Cache of skeletons by naming convention."""
        return {"own": self.session.card.skeleton}

    @cached_property
    def role_joints(self) -> dict[str, int]:
        """Return the index of the joint of each role."""
        return joint_roles.role_joints(self.session.card.skeleton, self.session.card.roles)

    def skeleton(self, names: NamingConvention) -> Skeleton:
        """Return the skeleton with these names; InvalidField if the model has no roles for them."""
        card = self.session.card
        if names not in self._skeletons:
            self._skeletons[names] = joint_roles.rename_joints(card.skeleton, card.roles, names)
        return self._skeletons[names]


# Sizes that are no multiple of a register, so that remainders are covered.
ROWS, COLUMNS = 29, 37


@cache
def rounding_fingerprint() -> bytes:
    """Return a matrix product, a solution and sines of fixed numbers as bytes.

    They differ between processors whose rounding differs.
    """
    numbers = np.sin(np.arange(1.0, ROWS * COLUMNS + 1.0)).reshape(ROWS, COLUMNS)
    square = numbers @ numbers.T + np.eye(ROWS)
    return b"".join(a.tobytes() for a in (square, np.linalg.solve(square, numbers), numbers))
