"""Agreement of predicted contacts with those of clips that a model was not trained on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from posefield.common.units import Floats
from posefield_train.contacts import contact_labels
from posefield_train.contacts.contact_model import ContactAccuracy
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

FRAMES = 100
"""Frames of a clip that are compared, evenly over its duration."""
SHARES = np.linspace(0.0, 1.0, FRAMES)

ContactPredictor = Callable[[Floats], Floats]
"""Map from shares (F,) of the duration to probabilities (M, F, K) for the clips held out."""


@dataclass(frozen=True)
class HeldOutClips:
    """Clips that a model was trained on, and clips that were held out."""

    rest: Sequence[Example]
    held: Sequence[Example]


def held_out_accuracies(
    recipe: Recipe, clips: HeldOutClips, joints: Sequence[int], predict: ContactPredictor
) -> list[ContactAccuracy]:
    """Return the accuracy of each clip held out, at equal shares of the durations.

    joints: indices of the predicted ones. Nothing is warped, so that errors of timing count.
    climatology is that of the mean over the other clips. Empty for cycles that are begun in phase:
    those held out begin elsewhere than the model's.
    """
    if recipe.alignment.begin == "in_phase" and recipe.motion.cyclic:
        return []
    mean = _labels(recipe, clips.rest, joints).mean(axis=0)
    pairs = zip(_labels(recipe, clips.held, joints), predict(SHARES), strict=True)
    return [ContactAccuracy.measure(predicted, own, own - mean) for own, predicted in pairs]


def mean_facts(found: Sequence[ContactAccuracy]) -> dict[str, Any]:
    """Return the means over clips by name, rounded."""
    names = ("agreement", "brier", "climatology")
    return {name: float(f"{np.mean([getattr(one, name) for one in found]):.4g}") for name in names}


def text(found: Sequence[ContactAccuracy]) -> str:
    """Return a sentence on the means over clips."""
    own = mean_facts(found)
    return (
        f"contacts: {own['agreement']:.1%} of frames agree, Brier score {own['brier']:.3f}; by the "
        f"mean of the other clips {own['climatology']:.3f}"
    )


def _labels(
    recipe: Recipe, examples: Sequence[Example], joints: Sequence[int]
) -> Annotated[Floats, "clips frames joints"]:
    asked = contact_labels.settings(recipe, examples[0].clip.skeleton.names)
    places = [asked.joints.index(joint) for joint in joints]
    clips = (contact_labels.clip_contacts(example, asked) for example in examples)
    return np.stack([clip.at(SHARES)[:, places] for clip in clips])
