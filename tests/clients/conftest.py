"""A real service for the clients to ask."""

import pytest
import serving


@pytest.fixture(scope="module")
def address(models):
    """Where a service listens that is a process of its own, with the models of api/examples."""
    with serving.process(models) as child:
        yield serving.address(child)
