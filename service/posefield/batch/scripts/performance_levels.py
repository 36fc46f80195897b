"""Levels of detail of performances, chosen by their distance from a camera.

A performance has one level from its begin to its end: at another level its joins are cut elsewhere,
so that no pose of one belongs to a pose of the other, and there is nothing to blend. The level is
chosen where the character is nearest.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from posefield.common.array_shapes import RootPath
from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.inference import level_selection
from posefield.inference.level_selection import Camera
from posefield.performance import composition
from posefield.performance.script import Script, resolve_script
from posefield.question.performance_question import PerformanceQuestion
from posefield.question.performance_report import PerformanceAnswer
from posefield.synthesis.synthesizer import Synthesizer


@dataclass(frozen=True)
class View:
    """A camera, and the largest error of a level that it may see, pixels."""

    camera: Camera
    pixels: float


def perform(
    question: PerformanceQuestion,
    find: Callable[[str], Synthesizer],
    view: View | None,
    most: int,
) -> tuple[PerformanceAnswer, int]:
    """Return a performance and its level: the coarsest that the view allows.

    view: None for the level of the script. most: largest number of frames. Raises QueryError as
    `composition.perform`, and for a script that has a level beside a view or a character around the
    camera.
    """
    script = resolve_script(question, find)
    if view is None:
        return composition.perform(script, most), question.level
    if question.level:
        raise InvalidField("level", f"{question.level}, expected none: the camera chooses it")
    level = allowed_level(script, composition.compose(script).motion.roots, view)
    answer = composition.perform(_at_level(script, level), most)
    # At another level the character may come nearer.
    while (needed := allowed_level(script, answer.clip.root_path, view)) < level:
        level = needed
        answer = composition.perform(_at_level(script, level), most)
    return answer, level


def allowed_level(script: Script, roots: RootPath, view: View) -> int:
    """Return the coarsest level whose error is within the view's limit all along a path.

    roots: (F, 3), m. Raises InvalidField if the character contains the camera.
    """
    distances = np.linalg.norm(roots - view.camera.position, axis=-1)
    nearest, radius = int(np.argmin(distances)), body_radius(script)
    if distances[nearest] <= radius:
        raise InvalidField(
            "camera",
            f"{distances[nearest]:.3g} m from the middle of the character, expected more than "
            f"{radius:.3g} m",
        )
    centre = roots[nearest : nearest + 1]
    scale = level_selection.pixels_per_metre(view.camera, centre, radius)
    return int(level_selection.select_by_error(level_errors(script), scale, view.pixels)[0])


def level_errors(script: Script) -> Floats:
    """Return the errors (L,), m, of the levels that all models of a script have: the largest."""
    every = [
        [level.pose for level in source.model.session.card.levels]
        for source in script.sources
        if source is not None
    ]
    count = min(map(len, every))
    errors: Floats = np.max([errors[:count] for errors in every], axis=0)
    return errors


def _at_level(script: Script, level: int) -> Script:
    return replace(script, question=structs.replace(script.question, level=level))


def body_radius(script: Script) -> float:
    """Return the radius, m, of a sphere about the root that contains the character at rest."""
    character = script.character
    rest = character.skeleton.at_rest(character.bones)
    return float(np.linalg.norm(rest - rest[0], axis=-1).max())
