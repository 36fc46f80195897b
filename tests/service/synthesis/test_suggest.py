"""Tests of suggested captures: valid ranked points, with their nearest clip."""

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.question.model_question import SuggestQuestion
from posefield.registry import model_registry
from posefield.synthesis.trust import DRAWN_CANDIDATES, suggest


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


def test_points_lie_in_the_box_and_the_first_is_worth_most(model):
    found = suggest(model, SuggestQuestion(count=20))
    assert (found.model, found.candidates, len(found.suggestions)) == (
        model.identity,
        DRAWN_CANDIDATES,
        20,
    )
    for control in model.session.card.controls:
        values = [each.controls[control.name] for each in found.suggestions]
        assert control.minimum <= min(values) < max(values) <= control.maximum
    assert found.suggestions[0].gain > found.suggestions[-1].gain > 0.0
    assert found == suggest(model, SuggestQuestion(count=20))


def test_the_nearest_clip_and_what_it_lacks_are_named(model):
    card = model.session.card
    width = np.array([c.maximum - c.minimum for c in card.controls])
    for each in suggest(model, SuggestQuestion(count=5)).suggestions:
        gaps = np.abs(np.array(card.examples) - list(each.controls.values())) / width
        nearest = int(np.argmin(np.linalg.norm(gaps, axis=1)))
        assert each.nearest == card.sources[nearest]
        assert each.gap == pytest.approx(gaps[nearest].max())
        assert each.lacking == card.controls[int(np.argmax(gaps[nearest]))].name


def test_candidates_that_are_given_are_ranked_and_no_others(model):
    card = model.session.card
    names = [control.name for control in card.controls]
    given = [dict(zip(names, map(float, example), strict=True)) for example in card.examples[:5]]
    # In the middle of the box, where nobody half sits.
    given.append({c.name: 0.5 * (c.minimum + c.maximum) for c in card.controls})
    found = suggest(model, SuggestQuestion(count=6), given)
    assert found.candidates == 6
    assert {tuple(each.controls.values()) for each in found.suggestions} == {
        tuple(each.values()) for each in given
    }
    assert max(found.suggestions, key=lambda each: each.variance).controls == given[-1]


@pytest.mark.parametrize(
    ("candidates", "field"),
    [([], "candidates"), ([{"turn": 1.0}], "candidates/0/controls/stature")],
)
def test_candidates_that_cannot_be_ranked_are_named(model, candidates, field):
    with pytest.raises(InvalidField) as caught:
        suggest(model, SuggestQuestion(count=1), candidates)
    assert caught.value.field == field
