"""Models that ship with the package: they are served where no other model is named."""

from collections.abc import Sequence
from pathlib import Path

from posefield.registry import model_registry
from posefield.registry.model_registry import ModelRegistry

FOLDER = Path(__file__).parents[1] / "shipped"
"""Folder of the shipped model files; in order of their names, so that the walk is the first."""
NOTICE = FOLDER / "NOTICE"
"""File with the origin and the licence of each shipped model."""


def or_shipped(places: Sequence[str]) -> list[str]:
    """Return the places of models as given; for none, the folder of the shipped models."""
    return list(places) or [str(FOLDER)]


def with_shipped(places: Sequence[Path]) -> ModelRegistry:
    """Return the shipped models and those of files and folders, which win where names are equal."""
    shipped = model_registry.load([FOLDER])
    given = model_registry.load(places).models if places else {}
    return ModelRegistry({**shipped.models, **given})
