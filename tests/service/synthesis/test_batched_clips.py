"""Clips of many questions at once: the bytes and the errors of each alone."""

import msgspec
import numpy as np
import onnx
import pytest
import recorded
from hypothesis import given, settings
from hypothesis import strategies as st
from model_files import written

from posefield.common.errors import QueryError
from posefield.inference import session
from posefield.question.motion_question import ClipQuestion, Floor, PoseQuestion, Target
from posefield.registry import model_registry
from posefield.synthesis import clip_draft, clips, poses
from posefield.synthesis.synthesizer import Synthesizer

KINDS = ("shipped", "labelled_path", "walk_path")


@pytest.fixture(scope="module", params=KINDS)
def pair(request):
    """Two models of one file: one answers batches, the other single questions."""
    shipped = request.param == "shipped"
    file = model_registry.SHIPPED_FOLDER / "cmu_walk.onnx"
    path = file if shipped else request.getfixturevalue(request.param)
    opened = session.load(path)
    return Synthesizer(path.stem, opened), Synthesizer(path.stem, opened)


def controls_at(card, shares):
    """Controls at shares of the ranges."""
    pairs = zip(card.controls, shares, strict=False)
    return {c.name: c.minimum + share * (c.maximum - c.minimum) for c, share in pairs}


def question(model, place, kind):
    """A question at shares of the ranges, with options of many kinds."""
    card = model.session.card
    shares, seed = place
    asked = ClipQuestion(controls=controls_at(card, shares), level=seed % len(card.levels))
    feet = "stand" if card.feet and card.root == "travelling" else None
    options = [
        {},
        {"take": seed + 1, "variety": 1.0},
        {"feet": "as_predicted"},
        {"feet": feet, "fps": 24.0},
        {"loop": card.cyclic},
        {"root": "in_place"},
        {"floor": Floor(0.1, 0.05, -0.1) if feet else None, "feet": feet},
        {"exact": "none"},
        {"targets": (Target(card.skeleton.names[-1], (0.1, 1.0, 0.3), 0.2),)},
        {"fps": 0.0},
        {"start": 99.0},
        {"extrapolate": "refuse"},
    ]
    own = {name: value for name, value in options[kind].items() if value is not None}
    return msgspec.structs.replace(asked, **own)


# Beyond what was sampled too.
SHARE = st.floats(-0.2, 1.2)
ASKED = st.tuples(st.tuples(st.tuples(*[SHARE] * 4), st.integers(0, 9)), st.integers(0, 11))


@settings(max_examples=12, deadline=None, derandomize=True)
@given(places=st.lists(ASKED, min_size=2, max_size=12))
def test_a_clip_has_the_same_bytes_alone_and_in_a_batch(pair, places):
    batched, single = pair
    asked = [question(batched, *place) for place in places]
    for own, found in zip(asked, clips.synthesize_clips(batched, asked), strict=True):
        if isinstance(found, QueryError):
            with pytest.raises(type(found)) as refused:
                clips.synthesize_clip(single, own)
            assert str(refused.value) == str(found)
            continue
        alone = clips.synthesize_clip(single, own)
        assert found.clip.rotations.tobytes() == alone.clip.rotations.tobytes()
        assert found.clip.translations.tobytes() == alone.clip.translations.tobytes()
        assert found.trust == alone.trust


FILES = ("model_path", "labelled_path", "walk_path")


@pytest.fixture(scope="module", params=FILES)
def model(request):
    path = request.getfixturevalue(request.param)
    return Synthesizer(path.stem, session.load(path))


def posed(model, place, level):
    """A question at shares of the ranges and, if there are performers, as one of them."""
    card, (shares, time, who) = model.session.card, place
    names = (None, *card.performers)
    controls, times = controls_at(card, shares), [time * card.durations[0]]
    who = names[who % len(names)]
    asked = PoseQuestion(controls=controls, times=times, performer=who, level=level)
    return poses.prepare(model, asked)


PLACE = st.tuples(st.tuples(*[SHARE] * 4), st.floats(0.0, 0.5), st.integers(0, 9))


@settings(max_examples=25, deadline=None, derandomize=True)
@given(places=st.lists(PLACE, min_size=2, max_size=40), number=st.integers(0, 11))
def test_a_question_gets_the_same_bytes_whatever_it_is_asked_with(model, places, number):
    level = number % len(model.session.card.levels)
    asked = [posed(model, place, level) for place in places]
    for each, row in zip(asked, poses.run_batch(model, asked), strict=True):
        (own,) = poses.run_batch(model, [each])
        assert [a.tobytes() for a in row] == [a.tobytes() for a in own]


@pytest.mark.parametrize("count", [2, 5, 15])
def test_the_last_question_of_a_batch_gets_the_same_bytes(model, count):
    """The last numbers of arrays may not fill a register."""
    places = [((share, 0.4, 0.9, 0.2), 0.2, 0) for share in np.linspace(0.03, 0.97, 11)]
    for level in range(len(model.session.card.levels)):
        for place in places:
            asked = [posed(model, each, level) for each in (*[places[0]] * (count - 1), place)]
            (own,) = poses.run_batch(model, asked[-1:])
            last = poses.run_batch(model, asked)[-1]
            assert [a.tobytes() for a in last] == [a.tobytes() for a in own]


def facts(found):
    """All of an answer, for comparison."""
    own = found.clip
    names, arrays = own.skeleton.names, (own.rotations, own.translations, own.curve_values)
    return names, own.rate, found.trust, [array.tobytes() for array in arrays]


def spread(model, count, **more):
    shares = np.linspace(0.1, 0.9, count)
    points = [controls_at(model.session.card, (share, 0.5, 0.3, 0.7)) for share in shares]
    return [ClipQuestion(controls=point, fps=30.0, **more) for point in points]


def test_clips_share_one_call_for_their_durations_and_few_for_their_frames(model_path):
    opened, feeds = recorded.session(session.load(model_path))
    model = Synthesizer("reaching", opened)
    assert clips.is_exact(model, 0)
    feeds.clear()
    asked = spread(model, 12)
    found = clips.synthesize_clips(model, asked)
    sizes = [len(feed["controls"]) for feed in feeds]
    assert sizes[0] == sum(sizes[1:]) == 12
    padded = [feed["time"].size for feed in feeds[1:]]
    assert max(padded) <= clips.MAX_FRAMES
    # As few as fit: two neighbours together would exceed the limit.
    frames = sum(len(answer.clip) for answer in found)
    assert len(padded) == -(-frames // clips.MAX_FRAMES)


def test_a_model_whose_clips_depend_on_their_batch_is_asked_one_by_one(model_path, tmp_path):
    """One whose softmax is over the questions, not over each question's own numbers."""
    graph = onnx.load(model_path)
    (softmax,) = (node for node in graph.graph.node if node.op_type == "Softmax")
    softmax.attribute[0].i = 0
    path = tmp_path / "reaching.onnx"
    path.write_bytes(written(graph))
    opened, feeds = recorded.session(session.load(path))
    model = Synthesizer("reaching", opened)
    assert not clips.is_exact(model, 0)
    feeds.clear()
    asked = spread(model, 3)
    found = clips.synthesize_clips(model, asked)
    assert {len(feed["controls"]) for feed in feeds} == {1}
    assert list(map(facts, found)) == [facts(clips.synthesize_clip(model, each)) for each in asked]


def test_the_bound_of_frames_holds_and_is_near(model_path):
    model = Synthesizer("reaching", session.load(model_path))
    for more in ({}, {"start": 0.3}, {"end": 0.5}, {"start": 0.1, "end": 0.4}):
        for asked in spread(model, 9, **more):
            frames = len(clips.synthesize_clip(model, asked).clip)
            assert frames <= clip_draft.largest_frame_count(model, asked)
            if "end" in more:
                assert clip_draft.largest_frame_count(model, asked) < frames + 1.0 + 1e-9
