"""What one may ask of a crowd that walks, and the crowd."""

from collections.abc import Sequence
from dataclasses import dataclass

from service.motion.crowd import CrowdClip
from service.motion.errors import InvalidField
from service.synthesis.synthesizer import Synthesizer
from service.synthesis.view import Camera
from service.synthesis.walk import company, detail, wander
from service.synthesis.walk.detail import Detail
from service.synthesis.walk.gait import Gait
from service.synthesis.walk.given import Route
from service.synthesis.walk.march import Plan

MOST = 1_000_000
"""Characters of one crowd, who may share their motions."""
COUNT, SECONDS, FPS, SEED, PIXELS = 500, 10.0, 30.0, 0, 1.0


@dataclass(frozen=True)
class Order:
    """Who walks and how they are shown.

    count: characters, each on a way of its own; or as many as there are routes. motions: how many
    different ones they share, all of their own if none is said. seconds, fps: how long, and frames
    a second. seed: of all that is random. level: of detail, the finest if not said, if not chosen
    by a camera for errors of at most so many pixels.
    """

    count: int = COUNT
    routes: Sequence[Route] = ()
    motions: int | None = None
    seconds: float = SECONDS
    fps: float = FPS
    seed: int = SEED
    level: int | None = None
    camera: Camera | None = None
    pixels: float = PIXELS

    def __post_init__(self) -> None:
        if not 1 <= self.count <= MOST:
            raise InvalidField("count", f"{self.count}, expected 1 to {MOST} characters")
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


def crowd(model: Synthesizer, gait: Gait, order: Order) -> CrowdClip:
    """Crowd of an order, whose motions are made as they are asked for.

    Raises InvalidField for what cannot be done.
    """
    plan = _plan(gait, order)
    return _crowd(gait, plan, _detail(model, plan, order), order)


def _crowd(gait: Gait, plan: Plan, shown: Detail, order: Order) -> CrowdClip:
    if order.motions is None:
        return company.crowd(gait.session, plan, shown)
    return company.sharing(gait.session, plan, shown, wander.stands(order.count, order.seed))


def _plan(gait: Gait, order: Order) -> Plan:
    span = order.seconds, order.fps, order.seed
    if order.routes:
        return company.following(gait, order.routes, *span)
    return company.wandering(gait, order.motions or order.count, *span)


def _detail(model: Synthesizer, plan: Plan, order: Order) -> Detail:
    level, coarsest = order.level or 0, len(model.session.card.levels) - 1
    if not 0 <= level <= coarsest:
        raise InvalidField("level", f"{level}, expected 0 to {coarsest}")
    if order.camera is None:
        return detail.constant(level, plan.phases.shape)
    scale = detail.scale(order.camera, plan.roots + model.middle, model.radius)
    return detail.seen(model.ladder, scale, order.pixels, order.fps)
