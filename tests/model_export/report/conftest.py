"""Fixture of the report's tests: a report of the small procedural model."""

from dataclasses import replace

import pytest


@pytest.fixture(scope="session")
def steps():
    """Training steps with their times."""
    return ("reading <recipe>", 0.25), ("fitting the fields", 1.5)


@pytest.fixture(scope="session")
def note():
    """A note that is markup unless it is escaped."""
    return "line 3: <b>odd</b> & noted"


@pytest.fixture(scope="session")
def exported(exported, note):
    """The small model with a note in its card."""
    diagnostics = {**exported.card.diagnostics, "notes": [note]}
    return replace(exported, card=replace(exported.card, diagnostics=diagnostics))


@pytest.fixture(scope="session")
def levels(exported):
    """The small model's levels of detail with made times."""
    from posefield_train.report.levels_of_detail import LevelCosts

    levels = exported.card.levels
    return LevelCosts(levels, tuple(8e-6 / (1 + number) for number in range(len(levels))))


@pytest.fixture(scope="session")
def rendered(trained, exported, levels, steps):
    """The small model's report."""
    from posefield_train.report import training_report

    return training_report.render(trained, exported, levels, steps)
