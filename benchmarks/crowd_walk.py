"""A walking crowd before a camera: levels by view against everybody at the finest.

Errors are those against the finest level, projected as if across the line of sight, where a body is
nearest.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import crowd_scene
import numpy as np
from rows import Row
from timing import in_turn

from posefield.common.units import Floats, Indices, Singles
from posefield.inference import level_selection
from posefield.inference.level_selection import Camera
from posefield.inference.onnx_runtime import OUTPUTS
from posefield.locomotion import floor_plane, stride, walking_crowd
from posefield.locomotion.gait import Gait
from posefield.locomotion.locomotion_plan import LocomotionPlan
from posefield.motion import skeleton
from posefield.synthesis import crowd_synthesis
from posefield.synthesis.synthesizer import Synthesizer

BATCH = crowd_synthesis.MOST_ROWS

COUNT, SECONDS, RATE = 500, 10.0, 30.0
EXTENTS = (100.0, 200.0, 400.0)
"""m: sides of wider crowds of as many characters; the planned one's comes first."""
FOV, HEIGHT, EYES, LIMIT = math.radians(60.0), 1080.0, 1.6, 1.0
RATIO = 2.0
APART = 15
"""Frames between those whose errors are looked at."""


@dataclass(frozen=True)
class Walk:
    """K = F N poses of N characters, frame after frame: controls (K, d), labels (K, p) and times
    (K, 1), s, as the graph takes them, and pixels (K,) per metre at each; NaN where the camera is
    inside a character, which is then at the finest level."""

    model: Synthesizer
    controls: Singles
    labels: Singles
    times: Singles
    scale: Floats

    def levels(self) -> Indices:
        """Levels (K,) by view."""
        visible, levels = ~np.isnan(self.scale), np.zeros(len(self.scale), dtype=np.int64)
        levels[visible] = level_selection.select_by_error(
            self.model.level_table.errors, self.scale[visible], LIMIT
        )
        return levels

    def posed(self, levels: Indices) -> Callable[[], None]:
        """Return a function that makes all poses, level by level."""

        def run() -> None:
            for level, rows in _parts(levels):
                self._answer(level, rows)

        return run

    def live(self, levels: Indices) -> Callable[[], None]:
        """Return a function that makes all poses, frame by frame."""

        def run() -> None:
            for first in range(0, len(levels), COUNT):
                for level, rows in _parts(levels[first : first + COUNT]):
                    self._answer(level, first + rows)

        return run

    def _answer(self, level: int, rows: Indices) -> list[Singles]:
        question = self.controls[rows], self.times[rows]
        return self.model.session.run(*question, *OUTPUTS, labels=self.labels[rows], level=level)

    def joints(self, levels: Indices, which: Indices) -> Floats:
        """Joints (W, J, 3), m, of some of the poses, in each character's own frame."""
        card = self.model.session.card
        values = np.empty((len(which), len(card.skeleton), 3))
        for level, rows in _parts(levels[which]):
            turns, root, bones = self._answer(level, which[rows])[:3]
            local = skeleton.translations(bones, root)
            values[rows] = skeleton.forward_kinematics(card.skeleton.parents, turns, local)[0][:, 0]
        return values


def _parts(levels: Indices) -> Iterator[tuple[int, Indices]]:
    for level in np.unique(levels).tolist():
        rows = np.flatnonzero(levels == level)
        yield from ((level, rows[first : first + BATCH]) for first in range(0, len(rows), BATCH))


def rows(walks: dict[str, Gait]) -> list[Row]:
    """Seconds of posing by extent of the crowd, and what anybody would see of it."""
    return [row for name, gait in walks.items() for row in _walk_rows(name, gait)]


def _walk_rows(name: str, gait: Gait) -> list[Row]:
    plan = walking_crowd.plan_random(gait, COUNT, SECONDS, RATE, seed=0)
    path_width = float(np.ptp(plan.places[:, 0].real))
    table_rows = []
    for extent in (path_width, *EXTENTS):
        walk = _walk(gait, _spread(plan, extent / path_width))
        table_rows += _rows(f"{name}, {COUNT} characters on {extent:.0f} m", walk)
    return table_rows


def _spread(plan: LocomotionPlan, factor: float) -> LocomotionPlan:
    """The same ways, begun as many times as far apart."""
    return replace(plan, places=plan.places + (factor - 1.0) * plan.places[:, :1])


def _walk(gait: Gait, plan: LocomotionPlan) -> Walk:
    model = Synthesizer("walk", gait.session)
    everyone = np.tile(stride.labels(gait.session, plan.who), (plan.phases.shape[1], 1))
    controls = plan.controls.swapaxes(0, 1).reshape(len(everyone), -1)
    times = plan.phases.T.ravel() * stride.strides(gait.session, controls, everyone).durations
    singles = (values.astype(np.float32) for values in (controls, everyone, times[:, None]))
    return Walk(model, *singles, _scale(model, plan))


def _scale(model: Synthesizer, plan: LocomotionPlan) -> Floats:
    """Return the pixels (K,) per metre at each character, seen from the middle."""
    middle = plan.places[:, 0].mean()
    camera = Camera(floor_plane.at_height(middle, np.array(EYES)), FOV, HEIGHT)
    bodies = floor_plane.at_height(plan.places.T.ravel(), np.zeros(1)) + model.rest_position
    outside = np.linalg.norm(bodies - camera.position, axis=-1) > model.radius
    scale = np.full(len(bodies), np.nan)
    scale[outside] = level_selection.pixels_per_metre(camera, bodies[outside], model.radius)
    return scale


def _rows(name: str, walk: Walk) -> list[Row]:
    levels = walk.levels()
    everybody = np.zeros_like(levels)
    runs = {
        "auto": walk.posed(levels),
        "finest": walk.posed(everybody),
        "live": walk.live(levels),
        "live, finest": walk.live(everybody),
        "choice": walk.levels,
    }
    timings = in_turn(runs, rounds=5, repeats=1)
    mix = crowd_scene.mix(levels, len(walk.model.session.card.levels))
    chosen = f"chosen in {1e3 * timings['choice']:.2g} ms"
    words = f"one thread, {mix}, {chosen}; all at the finest: {{:.3g}} s"
    return [
        _row(f"{name}, {SECONDS:g} s posed", timings["auto"], timings["finest"], words),
        _row(f"{name}, posed frame by frame", timings["live"], timings["live, finest"], "{:.3g} s"),
        _error_row(name, walk, levels),
    ]


def _row(name: str, seconds: float, finest: float, words: str) -> Row:
    return Row(name, seconds, "s", words.format(finest), finest / seconds, RATIO)


def _error_row(name: str, walk: Walk, levels: Indices) -> Row:
    """The largest character's error, root mean square over joints, in pixels."""
    which = np.arange(len(levels)).reshape(-1, COUNT)[::APART].ravel()
    gaps = walk.joints(levels, which) - walk.joints(np.zeros_like(levels), which)
    # Those the camera is in are at the finest level: there is no gap to project.
    pixels = np.linalg.norm(gaps, axis=-1) * np.nan_to_num(walk.scale[which])[:, None]
    frame_errors = np.sqrt(np.mean(np.square(pixels), axis=1))
    near = ~(walk.scale[which] * walk.model.level_table.errors[0] <= LIMIT)
    words = (
        f"{100 * np.mean(frame_errors > LIMIT):.2g} % of the characters beyond {LIMIT:g} pixel, "
        f"{100 * np.mean(pixels > LIMIT):.2g} % of the joints, the largest joint "
        f"{pixels.max():.2g}; {100 * np.mean(near):.2g} % of the characters so near that the "
        "finest level's own error covers more"
    )
    return Row(
        f"{name}: the worst character", float(frame_errors.max()), "pixels", words, None, LIMIT
    )
