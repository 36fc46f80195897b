"""Contacts of clips held out in an evaluation, compared with those that are predicted."""

import json

import numpy as np
import pytest
from families import sample_walk
from joblib import parallel_config

from posefield_train.contacts import contact_labels, held_out_contacts
from posefield_train.contacts.held_out_contacts import FRAMES, SHARES, HeldOutClips
from posefield_train.evaluate import protocol, summary
from posefield_train.parallel.jobs import ProcessJobs
from posefield_train.source.recipe import Recipe


@pytest.fixture(scope="module")
def clips(strides):
    return HeldOutClips(strides[3:], strides[:3])


@pytest.fixture(scope="module")
def labels(clips):
    asked = contact_labels.settings(sample_walk.recipe(), clips.held[0].clip.skeleton.names)
    return np.stack([contact_labels.clip_contacts(e, asked).at(SHARES) for e in clips.held])


def accuracies(clips, predicted, recipe=None):
    return held_out_contacts.held_out_accuracies(
        recipe or sample_walk.recipe(), clips, (3, 6), lambda _: predicted
    )


def test_true_contacts_agree_wholly_and_opposite_ones_nowhere(clips, labels):
    right, wrong = accuracies(clips, labels), accuracies(clips, 1.0 - labels)
    assert [(one.agreement, one.brier) for one in right] == [(1.0, 0.0)] * 3
    assert [(one.agreement, one.brier) for one in wrong] == [(0.0, 1.0)] * 3
    half = accuracies(clips, np.full_like(labels, 0.5))
    assert [one.brier for one in half] == [0.25] * 3
    assert all(0.0 < one.climatology < 0.1 for one in right)
    assert held_out_contacts.mean_facts(right)["agreement"] == 1.0


def test_cycles_that_are_begun_in_phase_are_not_compared(clips, labels):
    plain = sample_walk.recipe().model_dump(by_alias=True, exclude_unset=True)
    phased = Recipe.model_validate({**plain, "alignment": {"begin": "in_phase"}})
    assert accuracies(clips, labels, phased) == []


def test_an_evaluation_tells_the_contacts_of_clips_held_out(strides):
    plain = sample_walk.recipe().model_dump(by_alias=True, exclude_unset=True)
    own = Recipe.model_validate({**plain, "kriging": {"covariance": "matern52", "drift": 1}})
    with parallel_config(backend="sequential"):
        result = protocol.run_protocol(own, strides[:8], "clip", ProcessJobs(1), lambda *_: None)
    assert len(result.contacts) == 8
    found = json.loads(json.dumps(summary.facts(result)))["contacts"]
    assert found == held_out_contacts.mean_facts(result.contacts)
    assert found["agreement"] > 0.95 and FRAMES == 100
    said = summary.trust_text(result)[-1]
    assert said.startswith(f"contacts: {found['agreement']:.1%} of frames agree")
