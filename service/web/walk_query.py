"""Requests for walking crowds: orders within the limits of the settings."""

from service.encode.crowd import crowd_size
from service.encode.crowd.crowd_size import Counts
from service.motion.errors import InvalidField
from service.question.walk_question import WalkQuestion
from service.synthesis.walk import company
from service.synthesis.walk import order as orders
from service.synthesis.walk.order import Order
from service.web.settings import Settings


def order(question: WalkQuestion, ending: str, joints: int, settings: Settings) -> Order:
    """Return the order of a question.

    ending: extension of the format. joints: of the model's skeleton. Raises InvalidField for
    characters, poses, frames or bytes beyond the limits of the settings.
    """
    made, flat = orders.of(question), question.instancing == "flatten"
    _check_size(made, flat, settings)
    _check_output(made, flat, ending, joints, settings)
    return made


def _check_output(order: Order, flat: bool, ending: str, joints: int, settings: Settings) -> None:
    motions, frames = order.motions or order.count, company.frames(order.seconds, order.fps)
    taken = crowd_size.file(Counts(joints, order.count, motions, frames), ending, flat)
    if taken > settings.output_limit:
        raise InvalidField(
            "count",
            f"{taken / 1e6:.1f} MB for {order.count} characters and {motions} motions of {frames} "
            f"frames as {ending}, expected at most {settings.output_limit / 1e6:.1f} MB",
        )


def _check_size(order: Order, flat: bool, settings: Settings) -> None:
    if order.count > settings.crowd_limit:
        raise InvalidField("count", f"{order.count}, expected at most {settings.crowd_limit}")
    # A flattened layer has a copy of the motion for each character.
    shared = None if flat else order.motions
    poses = company.poses(shared or order.count, order.seconds, order.fps)
    if poses > settings.crowd_poses:
        raise InvalidField(
            "count", f"{poses:.3g} poses of all motions, expected at most {settings.crowd_poses}"
        )
    longest = company.poses(1, order.seconds, order.fps)
    if longest > settings.crowd_frames:
        raise InvalidField(
            "seconds", f"{longest:.6g} frames of a motion, expected at most {settings.crowd_frames}"
        )
