"""A clip of the shipped walk, and the figure of its character."""

import pytest
import rig_files

from posefield.console.options import open_model
from posefield.question.motion_question import ClipQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips


@pytest.fixture(scope="session")
def walk_model():
    return open_model(model_registry.SHIPPED_FOLDER / "cmu_walk.onnx")


@pytest.fixture(scope="session")
def walk(walk_model):
    """A stride at 60 frames a second with feet that stand."""
    return clips.synthesize_clip(walk_model, ClipQuestion(controls={"speed": 1.2}, fps=60)).clip


@pytest.fixture(scope="session")
def roles(walk_model):
    return walk_model.session.card.roles


@pytest.fixture(scope="session")
def figure(walk):
    return rig_files.figure_of(walk.skeleton, walk.translations[0])
