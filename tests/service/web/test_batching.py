"""Tests of batched pose requests: one inference call, with the bytes of single ones."""

import asyncio

import numpy as np
import pytest
import recorded

from posefield.common.errors import InvalidField
from posefield.http.batching import MAX_POSES, PoseBatcher
from posefield.inference import session
from posefield.question.motion_question import PoseQuestion
from posefield.synthesis import poses
from posefield.synthesis.synthesizer import Synthesizer

HASTE = [3.0 + number / (2 * MAX_POSES + 7) for number in range(2 * MAX_POSES + 7)]


@pytest.fixture(scope="module")
def model(walk_path):
    return Synthesizer("walk", session.load(walk_path))


def counted(model, check=lambda feed: None):
    """A model like it whose levels are known to be exact, and the feeds of its graph's calls.

    A question that is asked alone fills two rows of a feed.
    """
    session, feeds = recorded.session(model.session, check)
    own = Synthesizer(model.name, session)
    for level in range(len(session.card.levels)):
        assert poses.is_batch_exact(own, level)
    feeds.clear()
    return own, feeds


def rows(feeds):
    return [len(feed["controls"]) for feed in feeds]


def question(model, haste, time=0.1, level=0):
    controls = {c.name: c.default for c in model.session.card.controls} | {"haste": haste}
    return poses.prepare(model, PoseQuestion(controls=controls, times=[time], level=level))


def together(model, asked, rounds=1):
    """Rows that a batcher gives to questions asked in one turn, after a turn that promises more."""

    async def ask():
        batcher = PoseBatcher()
        await asyncio.gather(*(batcher.row(model, asked[0]) for _ in range(2)))
        for _ in range(rounds):
            await asyncio.sleep(0)
            rows = await asyncio.gather(*(batcher.row(model, each) for each in asked))
        return rows

    return asyncio.run(ask())


def test_one_call_answers_all_of_a_turn_with_the_bytes_that_each_gets_alone(model):
    own, feeds = counted(model)
    asked = [question(own, haste) for haste in HASTE]
    feeds.clear()
    found = together(own, asked)
    assert rows(feeds) == [2, 2, MAX_POSES, MAX_POSES, 7]
    for each, row in zip(asked, found, strict=True):
        (alone,) = poses.run_batch(model, [each])
        assert all(np.array_equal(a, b) for a, b in zip(row, alone, strict=True))


def test_one_that_has_no_answer_harms_no_other(model):
    asked = [question(model, 4.0, time) for time in (0.1, 99.0, 0.2)]
    first, wrong, last = together(model, asked)
    with pytest.raises(InvalidField, match="99 s, expected 0 to"):
        poses.build_answer(model, asked[1], wrong)
    for each, row in ((asked[0], first), (asked[2], last)):
        np.testing.assert_array_equal(poses.build_answer(model, each, row).rotations, row[0])


def test_a_fault_of_the_graph_reaches_everybody(model):
    def refuse_three(feed):
        if len(feed["controls"]) == 3:
            raise RuntimeError("broken")

    own, _ = counted(model, refuse_three)
    with pytest.raises(RuntimeError, match="broken"):
        together(own, [question(own, 4.0)] * 3)


def test_a_model_that_sums_by_place_is_asked_one_by_one(model):
    own, feeds = counted(model)
    own.exact_levels[0] = False
    asked = [question(own, 4.0)] * 5
    feeds.clear()
    together(own, asked)
    assert set(rows(feeds)) == {2}
