"""Tests of grids of sigma: equal to sigma of single answers."""

import numpy as np
import pytest
from msgspec import structs

from posefield.common.errors import InvalidField
from posefield.question.model_question import SigmaQuestion
from posefield.question.motion_question import PoseQuestion
from posefield.registry import model_registry
from posefield.synthesis import poses
from posefield.synthesis.trust import BATCH, grid

ASKED = SigmaQuestion(
    across="turn",
    along="target_height",
    columns=7,
    rows=5,
    controls={"stature": 1.7},
    performer="tall",
    margin=0.3,
)


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).find("labelled")


def test_each_point_is_the_sigma_of_an_answer(model):
    found = grid(model, ASKED)
    fixed = {**found.controls}
    for row, along in enumerate(found.along.values):
        for column, across in enumerate(found.across.values):
            controls = {**fixed, "turn": across, "target_height": along}
            trust = poses.synthesize_poses(
                model, PoseQuestion(controls=controls, times=[0.0], performer="tall")
            ).trust
            # One row of a product is summed in another order than many.
            assert abs(found.sigma[row, column] - trust.sigma) < 1e-6
            assert found.supported[row, column] == trust.supported
            quiet = found.inside[row, column] and found.supported[row, column]
            assert quiet == (not trust.warnings)
    # Negative control: neighbours differ by more.
    assert np.abs(np.diff(found.sigma, axis=0)).min() > 2e-6
    assert found.inside.any() and not found.inside.all()


def test_the_whole_graph_says_the_same(model):
    asked = structs.replace(ASKED, columns=60, rows=40)
    assert len(asked) > 2 * BATCH
    found, card = grid(model, asked), model.session.card
    points = np.zeros((len(asked), len(card.controls)))
    for index, control in enumerate(card.controls):
        points[:, index] = found.controls.get(control.name, 0.0)
        if control.name == "turn":
            points[:, index] = np.tile(found.across.values, 40)
        if control.name == "target_height":
            points[:, index] = np.repeat(found.along.values, 60)
    labels = np.array([[float(name == "tall") for name in card.performers]])
    whole = model.session.run(points, np.zeros((len(points), 1)), "sigma", labels=labels)[0]
    np.testing.assert_allclose(found.sigma.ravel(), whole, atol=1e-6)
    assert np.abs(found.sigma.ravel()[::-1] - whole).max() > 1e-4


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        ({"across": "spin"}, "across", "'spin', expected one of this model's controls, stature"),
        ({"along": "turn"}, "along", "expected another control than across"),
        ({"columns": 1}, "columns", "1 values, expected 2 to 1024"),
        ({"margin": -0.1}, "margin", "expected 0 to 1"),
        ({"margin": float("nan")}, "margin", "expected a finite number"),
        ({"controls": {"turn": 1.0}}, "controls/turn", "given, and across the grid too"),
        ({"controls": {"spin": 1.0}}, "controls/spin", "no such control"),
        ({"performer": "nobody"}, "performer", "expected one of middle, short, tall"),
    ],
)
def test_a_grid_that_cannot_be_is_refused_by_field(change, field, words, model):
    with pytest.raises(InvalidField) as caught:
        grid(model, structs.replace(ASKED, **change))
    assert caught.value.field == field
    assert words in caught.value.message
