"""Check of a recipe's presets against the clips that were read."""

from collections.abc import Sequence

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.name_suggestion import did_you_mean
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.source.recipe_sections.data_sections import PERFORMER


def check_presets(recipe: Recipe, examples: Sequence[Example]) -> None:
    """Raise TrainingError for a preset outside the sampled ranges or of an unknown label."""
    points = np.stack([example.controls for example in examples])
    least, most = points.min(axis=0), points.max(axis=0)
    for name, preset in recipe.presets.items():
        for index, control in enumerate(recipe.controls):
            value, low, high = preset.values[control.name], least[index], most[index]
            if not low <= value <= high:
                raise TrainingError(
                    f"presets.{name}.{control.name}: found {value:g}, expected {low:g} to "
                    f"{high:g}, the sampled range"
                )
        for label_set, label in preset.labels.items():
            known = sorted({example.row.labels[label_set] for example in examples})
            if label not in known:
                key = label_set if label_set == PERFORMER else f"labels.{label_set}"
                raise TrainingError(
                    f"presets.{name}.{key}: found {label!r}{did_you_mean(label, known)}, expected "
                    f"one of {', '.join(known)}"
                )
