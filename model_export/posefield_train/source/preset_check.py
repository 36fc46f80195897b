"""Check of a recipe's presets against the clips that were read."""

from collections.abc import Sequence

import numpy as np

from posefield.common.errors import TrainingError
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe


def check_presets(recipe: Recipe, examples: Sequence[Example]) -> None:
    """Raise TrainingError for a preset outside the sampled ranges or of an unknown performer."""
    points = np.stack([example.controls for example in examples])
    least, most = points.min(axis=0), points.max(axis=0)
    performers = sorted({example.row.performer for example in examples})
    for name, preset in recipe.presets.items():
        for index, control in enumerate(recipe.controls):
            value, low, high = preset.values[control.name], least[index], most[index]
            if not low <= value <= high:
                raise TrainingError(
                    f"presets.{name}.{control.name}: found {value:g}, expected {low:g} to "
                    f"{high:g}, the sampled range"
                )
        if preset.performer is not None and preset.performer not in performers:
            raise TrainingError(
                f"presets.{name}.performer: found {preset.performer!r}, expected one of "
                f"{', '.join(performers)}"
            )
