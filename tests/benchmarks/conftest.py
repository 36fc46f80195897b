"""Fixtures of the tests of Table 1; adds benchmarks/ to the module path."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))


@pytest.fixture(scope="session")
def made(trained, exported):
    """The small procedural family as the benchmarks take it."""
    import family

    return family.of(trained, exported, 0.0)
