"""Tests of batches: equal bytes as single evaluation, at every level of every model."""

import numpy as np
import onnx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from model_files import written

from posefield.inference import session
from posefield.question.motion_question import PoseQuestion
from posefield.synthesis import poses
from posefield.synthesis.synthesizer import Synthesizer

KINDS = ("model_path", "labelled_path", "walk_path")


@pytest.fixture(scope="module", params=KINDS)
def model(request):
    path = request.getfixturevalue(request.param)
    return Synthesizer(path.stem, session.load(path))


def question(model, place, level):
    """A question at shares of the ranges and, if there are performers, as one of them."""
    card, (shares, time, who) = model.session.card, place
    ranges = [(c, c.minimum, c.maximum - c.minimum) for c in card.controls]
    controls = {c.name: low + s * span for (c, low, span), s in zip(ranges, shares, strict=False)}
    names = (None, *card.performers)
    time *= card.durations[0]
    return poses.prepare(
        model,
        PoseQuestion(
            controls=controls, times=[time], performer=names[who % len(names)], level=level
        ),
    )


# Beyond what was sampled too.
SHARE = st.floats(-0.2, 1.2)
PLACE = st.tuples(st.tuples(*[SHARE] * 4), st.floats(0.0, 0.5), st.integers(0, 9))


@settings(max_examples=60, deadline=None, derandomize=True)
@given(places=st.lists(PLACE, min_size=2, max_size=40), number=st.integers(0, 11))
def test_a_question_gets_the_same_bytes_whatever_it_is_asked_with(model, places, number):
    level = number % len(model.session.card.levels)
    asked = [question(model, place, level) for place in places]
    for each, row in zip(asked, poses.run_batch(model, asked), strict=True):
        (own,) = poses.run_batch(model, [each])
        assert [a.tobytes() for a in row] == [a.tobytes() for a in own]


@pytest.mark.parametrize("count", [2, 5, 15])
def test_the_last_question_of_a_batch_gets_the_same_bytes(model, count):
    """The last numbers of arrays may not fill a register."""
    places = [((share, 0.4, 0.9, 0.2), 0.2, 0) for share in np.linspace(0.03, 0.97, 11)]
    for level in range(len(model.session.card.levels)):
        for place in places:
            asked = [question(model, each, level) for each in (*[places[0]] * (count - 1), place)]
            (own,) = poses.run_batch(model, asked[-1:])
            last = poses.run_batch(model, asked)[-1]
            assert [a.tobytes() for a in last] == [a.tobytes() for a in own]


def test_a_graph_whose_rows_depend_on_each_other_is_found_out(model_path, tmp_path):
    """One whose softmax is over the questions, not over each question's own numbers."""
    graph = onnx.load(model_path)
    (softmax,) = (node for node in graph.graph.node if node.op_type == "Softmax")
    softmax.attribute[0].i = 0
    path = tmp_path / "reaching.onnx"
    path.write_bytes(written(graph))
    model = Synthesizer("reaching", session.load(path))
    assert not poses.is_batch_exact(model, 0)
