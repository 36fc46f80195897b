"""A report of the small procedural model."""

import pytest

from model_export import export
from model_export.report import detail, render
from model_export.report.about import Step


@pytest.fixture(scope="session")
def steps():
    """What training would have been timed at."""
    return (Step("reading <recipe>", 0.25), Step("fitting the fields", 1.5))


@pytest.fixture(scope="session")
def note():
    """What HTML would take for markup."""
    return "line 3: <b>odd</b> & noted"


@pytest.fixture(scope="session")
def exported(small_recipe, trained, note):
    """The small model as a file."""
    return export.export(small_recipe, trained, [note])


@pytest.fixture(scope="session")
def ladder(small_recipe, trained, exported):
    """Its levels of detail, measured once."""
    return detail.of(small_recipe, trained, exported)


@pytest.fixture(scope="session")
def rendered(trained, exported, ladder, steps):
    """Its report."""
    return render.render(trained, exported, ladder, steps)
