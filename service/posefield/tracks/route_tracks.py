"""Tracks of routes: through waypoints at one speed, slower in curves, and standing at the end."""

from collections.abc import Sequence
from math import ceil

import numpy as np

from posefield.common.errors import InvalidField
from posefield.locomotion.gait import Gait
from posefield.locomotion.locomotion_plan import Route
from posefield.performance import walk_paths, walk_plan, walk_request
from posefield.performance.passage import RATE
from posefield.performance.walk_request import SpeedRamps
from posefield.tracks.track import Track

ACCELERATION = 0.8
"""Acceleration with which a walker arrives, m/s²."""


def tracks_of_routes(gait: Gait, routes: Sequence[Route], seconds: float) -> tuple[Track, ...]:
    """Return the tracks of routes over some seconds: who arrives earlier stands there.

    Raises InvalidField, which names the route and the place, for a speed outside the sampled range
    and for unusable waypoints.
    """
    count = ceil(seconds * RATE) + 1
    tracks = []
    for index, route in enumerate(routes):
        try:
            curve = walk_request.check_speeds(route.speed, "distance", gait.region.speeds)
            path = walk_paths.through(route.waypoints, None, None)
        except InvalidField as fault:
            field = fault.field.replace("along", "waypoints")
            raise InvalidField(f"paths/{index}/{field}", fault.message) from fault
        slower = path.distances, walk_plan.curve_speeds(gait, path)
        ramps = SpeedRamps(None, 0.0, ACCELERATION)
        gone = walk_request.distances_over_length(curve, "distance", path.length, ramps, slower)
        gone = np.pad(gone, (0, max(count - len(gone), 0)), "edge")[:count]
        tracks.append(Track(str(index), np.arange(count) / RATE, path.at(gone)[0]))
    return tuple(tracks)
