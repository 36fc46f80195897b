"""The hips of all families of motion capture against the limits of the check of facing."""

from pathlib import Path

import numpy as np
import pytest

from posefield_train.source import facing, ingest, recipe

pytestmark = pytest.mark.system

RECIPES = Path(recipe.__file__).parents[1] / "recipes"
FAMILIES = sorted(path.stem for path in RECIPES.glob("*.toml"))


@pytest.fixture(scope="module")
def angles(real_data):
    """Angle between the hips of every clip and the stated facing, degrees, by family."""
    found = {}
    for name in FAMILIES:
        own = recipe.read(RECIPES / f"{name}.toml")
        examples, _ = ingest.ingest(own, real_data)
        evidence = facing.hips_evidence([example.clip for example in examples], own.roles)
        found[name] = np.abs(evidence.angles)
    return found


@pytest.mark.parametrize("name", FAMILIES)
def test_the_hips_of_every_family_are_far_from_the_limits(angles, name):
    # Half of a right angle is no fitted number; that families lie well within is measured.
    assert angles[name].max() < 0.6 * facing.CLEAR_ANGLE
    assert (90.0 - angles[name]).min() > facing.LARGEST_ANGLE + 20.0


def test_a_limit_of_ten_degrees_would_refuse_a_family(angles):
    assert any((own > 10.0).any() for own in angles.values())
