"""Tests of the labels of walking crowds: by name and by weights, for each label set."""

import dataclasses

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.inference import session
from posefield.locomotion import collision_avoidance, gait, locomotion_plan, walking_crowd

RATE, COUNT = 30.0, 60
MIXED = {"style": {"marching": 0.7, "sneaking": 0.3}}


@pytest.fixture(scope="module")
def own(styled_path):
    return gait.fit_gait(session.load(styled_path))


def made(own, asked, count=COUNT, seed=3):
    """Facts and motions of a crowd with labels, one second long."""
    labelled = own.with_labels(asked)
    plan = walking_crowd.plan_random(labelled, count, 1.0, RATE, seed)
    shown = locomotion_plan.constant_schedule(0, plan.phases.shape)
    crowd = walking_crowd.crowd_of_plan(own.session, plan, shown)
    return crowd.facts, np.concatenate([each.rotations for each in crowd.batches])


def test_a_name_holds_for_all_and_the_other_sets_vary(own):
    facts, _ = made(own, {"style": "marching"})
    assert facts["labels"] == {"style": ["marching"] * COUNT}
    assert set(facts["performers"]) == {"ann", "ben"}
    facts, _ = made(own, {"performer": "ben"})
    assert facts["performers"] == ["ben"] * COUNT
    assert set(facts["labels"]["style"]) == {"plain", "marching", "sneaking"}


def test_a_mixture_draws_its_names_by_their_weights(own):
    labelled = own.with_labels(MIXED)
    drawn = collision_avoidance.draw_characters(labelled, 4000, 5).who
    styles = np.array([labelled.labels.rows[who]["style"] for who in drawn])
    assert np.mean(styles == "marching") == pytest.approx(0.7, abs=0.03)
    assert not np.any(styles == "plain")
    # Without a request all styles are as frequent.
    free = collision_avoidance.draw_characters(own, 4000, 5).who
    assert np.mean([own.labels.rows[who]["style"] == "plain" for who in free]) > 0.3
    facts, _ = made(own, MIXED, count=2)
    assert facts["labels"] == {"style": [MIXED["style"]] * 2}


def test_a_combination_that_was_not_captured_has_clips_of_either_label(own):
    rows = [row for row in own.labels.rows if row != {"performer": "ann", "style": "marching"}]
    fewer = dataclasses.replace(own.labels, rows=tuple(rows), shares=np.ones(len(rows)))
    assert len(rows) == 5
    parts = np.array(
        [
            [float(row[name] == label) for row in rows]
            for name, label in (("performer", "ann"), ("style", "marching"))
        ]
    )
    shares = gait.combination_shares(parts)
    drawn = dataclasses.replace(fewer, shares=shares).draw(
        np.linspace(0.0, 1.0, 50, endpoint=False)
    )
    found = {tuple(rows[who].values()) for who in drawn}
    assert found == {("ann", "plain"), ("ann", "sneaking"), ("ben", "marching")}


def test_a_model_without_label_sets_refuses_every_label(model_file):
    reaching = session.load(model_file("reaching")).card
    with pytest.raises(InvalidField, match="this model has none"):
        gait.requested_labels(reaching, {"style": "plain"})
