"""What the tests of Table 1 share."""

import pytest

from model_export.evaluate import table1_family


@pytest.fixture(scope="session")
def made(trained):
    """The small family, as Table 1 takes it."""
    return table1_family.of(trained, None, 0.0)
