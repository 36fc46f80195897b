"""Fixtures of the tests of benchmarks; adds benchmarks/ to the module path."""

import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS.parent / "benchmarks"), str(TESTS / "model_export")]


@pytest.fixture(scope="session")
def made(trained, exported):
    """The small procedural family as the benchmarks take it."""
    import family

    return family.of(trained, exported, 0.0)
