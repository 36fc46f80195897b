"""Order of a walking crowd: validated parameters, and the crowd they result in."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from posefield.common.errors import InvalidField
from posefield.inference.level_selection import Camera
from posefield.inference.named_model import NamedModel
from posefield.locomotion import level_transitions, random_paths, walking_crowd
from posefield.locomotion.gait import Gait
from posefield.locomotion.level_transitions import LevelSchedule
from posefield.locomotion.locomotion_plan import LocomotionPlan
from posefield.locomotion.routes import Route
from posefield.locomotion.walking_crowd import MotionMaker
from posefield.motion.crowd_clip import CrowdClip
from posefield.question.motion_question import DEFAULT_VARIETY, FeetMode, LabelValue
from posefield.question.walk_question import (
    DEFAULT_FOV,
    DEFAULT_HEIGHT,
    WalkerTake,
    WalkQuestion,
)

MAX_CHARACTERS = 1_000_000
"""Largest number of characters of one crowd, which may share motions."""
DEFAULT_FPS, DEFAULT_PIXELS = 30.0, 1.0


@dataclass(frozen=True)
class CrowdOrder:
    """Parameters of a walking crowd.

    count: characters, each on its own path; with routes, their number. routes: given routes.
    motions: number of distinct motions that the characters share, None for one each. seconds:
    duration. fps: frames a second. seed: of all random numbers. level: level of detail, the finest
    if None and no camera is given. camera: chooses levels with errors of at most `pixels` pixels.
    labels: name or weights of all characters by label set. feet: whether they stand; None where the
    model decides. take: seed of all characters, 0 for the prediction, or "index" for a seed of its
    own for each distinct motion. variety: size of the takes' deviations. detail: whether details
    that no control predicts are added.
    """

    count: int
    routes: Sequence[Route] = ()
    motions: int | None = None
    seconds: float = 10.0
    fps: float = DEFAULT_FPS
    seed: int = 0
    level: int | None = None
    camera: Camera | None = None
    pixels: float = DEFAULT_PIXELS
    labels: Mapping[str, LabelValue] = field(default_factory=dict)
    feet: FeetMode | None = None
    take: WalkerTake = 0
    variety: float = DEFAULT_VARIETY
    detail: bool = False

    def __post_init__(self) -> None:
        if not 1 <= self.count <= MAX_CHARACTERS:
            raise InvalidField("count", f"{self.count}, expected 1 to {MAX_CHARACTERS} characters")
        if self.level is not None and self.camera is not None:
            raise InvalidField("level", f"{self.level}, expected none: the camera chooses it")
        if self.motions is not None and not 1 <= self.motions <= self.count:
            raise InvalidField("motions", f"{self.motions}, expected 1 to {self.count} characters")
        if self.motions is not None and self.routes:
            raise InvalidField("motions", f"{self.motions}, expected none: every route has its own")
        if self.motions is not None and self.camera is not None:
            raise InvalidField(
                "motions", "shared by characters near and far, expected a level and no camera"
            )
        if not self.pixels >= 0.0:
            raise InvalidField("pixels", f"{self.pixels:g}, expected 0 or more")


def from_question(asked: WalkQuestion, routes: Sequence[Route] = ()) -> CrowdOrder:
    """Return the order of a question; its characters follow the routes if there are any."""
    camera = None
    if asked.camera is not None:
        fov = DEFAULT_FOV if asked.fov is None else asked.fov
        height = DEFAULT_HEIGHT if asked.height is None else asked.height
        camera = Camera(np.array(asked.camera), fov, height)
    return CrowdOrder(
        count=asked.count,
        routes=routes,
        motions=asked.motions,
        seconds=asked.seconds,
        fps=asked.fps,
        seed=asked.seed,
        level=asked.level,
        camera=camera,
        pixels=DEFAULT_PIXELS if asked.pixels is None else asked.pixels,
        labels=asked.labels,
        feet=asked.feet,
        take=asked.take,
        variety=asked.variety,
        detail=asked.detail,
    )


def build_crowd(
    model: NamedModel, gait: Gait, order: CrowdOrder, make: MotionMaker | None = None
) -> CrowdClip:
    """Return the crowd of an order, whose motions are computed on demand.

    make: computes the motions, which are as predicted by default. Raises InvalidField for
    parameters that the model or the limits do not permit.
    """
    gait = gait.with_labels(order.labels)
    plan = _build_plan(gait, order)
    shown = _build_schedule(model, plan, order)
    if order.motions is None:
        return walking_crowd.build_crowd(gait.session, plan, shown, make)
    stands = random_paths.initial_placement(order.count, order.seed)
    return walking_crowd.share_motions(gait.session, plan, shown, stands, make)


def _build_plan(gait: Gait, order: CrowdOrder) -> LocomotionPlan:
    span = order.seconds, order.fps, order.seed
    if order.routes:
        return walking_crowd.plan_routes(gait, order.routes, *span)
    return walking_crowd.plan_random(gait, order.motions or order.count, *span)


def _build_schedule(model: NamedModel, plan: LocomotionPlan, order: CrowdOrder) -> LevelSchedule:
    level, coarsest = order.level or 0, len(model.session.card.levels) - 1
    if not 0 <= level <= coarsest:
        raise InvalidField("level", f"{level}, expected 0 to {coarsest}")
    if order.camera is None:
        return level_transitions.constant_schedule(level, plan.phases.shape)
    scale = level_transitions.scale(order.camera, plan.roots + model.rest_position, model.radius)
    return level_transitions.schedule_levels(model.level_table, scale, order.pixels, order.fps)
