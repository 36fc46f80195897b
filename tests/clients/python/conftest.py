"""Fixtures of the Python client's tests."""

import pytest


@pytest.fixture(scope="session")
def controls() -> dict[str, float]:
    """Controls in the midst of what was sampled."""
    return {"stature": 1.72, "hip_height": 0.9, "turn": 20, "target_height": 1.1}
