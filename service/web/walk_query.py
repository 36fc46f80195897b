"""The question for a crowd that walks, as query parameters."""

from dataclasses import dataclass

import numpy as np

from service.motion.errors import InvalidField
from service.synthesis.view import Camera
from service.synthesis.walk import company
from service.synthesis.walk.order import FPS, PIXELS, SEED, Order
from service.web import query
from service.web.query import Pairs
from service.web.settings import Settings

# A crowd to look at in a browser's tab: some ten megabytes.
COUNT, SECONDS, INSTANCING = 100, 5.0, "references"
FOV, HEIGHT = float(np.pi / 3.0), 1080.0


@dataclass(frozen=True)
class WalkQuestion:
    """Who walks and how they are shown, and what characters share in USD."""

    order: Order
    instancing: str


def of_pairs(pairs: Pairs, settings: Settings) -> WalkQuestion:
    """Question of query parameters; RequestFault where it breaks the contract's form, InvalidField
    where it asks for nothing, or for more than the settings allow."""
    given = query.unique(pairs)
    numbers = {name: query.number(name, given[name]) for name in _NUMBERS if name in given}
    order = Order(
        count=_whole(given, "count", COUNT),
        motions=_whole(given, "motions", 0) if "motions" in given else None,
        seconds=numbers.get("seconds", SECONDS),
        fps=numbers.get("fps", FPS),
        seed=_whole(given, "seed", SEED),
        level=_whole(given, "level", 0) if "level" in given else None,
        camera=_camera(given, numbers),
        pixels=numbers.get("pixels", PIXELS),
    )
    instancing = given.get("instancing", INSTANCING)
    _check_size(order, instancing, settings)
    return WalkQuestion(order, instancing)


_NUMBERS = ("seconds", "fps", "fov", "height", "pixels")


def _whole(given: dict[str, str], name: str, default: int) -> int:
    return query.whole(name, given[name]) if name in given else default


def _camera(given: dict[str, str], numbers: dict[str, float]) -> Camera | None:
    if "camera" not in given:
        for name in ("fov", "height", "pixels"):
            if name in given:
                raise InvalidField(name, "given without a camera, expected only with one")
        return None
    words = given["camera"].split(",")
    if len(words) != 3:
        raise query.bad_parameter("camera", f"{given['camera']!r}, expected x,y,z in metres")
    place = np.array([query.number("camera", word) for word in words])
    return Camera(place, numbers.get("fov", FOV), numbers.get("height", HEIGHT))


def _check_size(order: Order, instancing: str, settings: Settings) -> None:
    if order.count > settings.crowd_limit:
        raise InvalidField("count", f"{order.count}, expected at most {settings.crowd_limit}")
    # Flattened, each character has a copy of what it shares.
    shared = order.motions if instancing != "flatten" else None
    poses = company.poses(shared or order.count, order.seconds, order.fps)
    if poses > settings.crowd_poses:
        raise InvalidField(
            "count", f"{poses:.3g} poses of all motions, expected at most {settings.crowd_poses}"
        )
