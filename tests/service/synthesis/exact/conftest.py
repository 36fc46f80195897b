"""Fixtures of predicted motions for corrections: a reach and a walk."""

import pytest
from beginning import Begun, begin

from posefield.inference import session


@pytest.fixture(scope="session")
def reaching(labelled_path) -> Begun:
    """A reach of a performer."""
    return begin(session.load(labelled_path))


@pytest.fixture(scope="session")
def walking(walk_path) -> Begun:
    """A stride."""
    return begin(session.load(walk_path))
