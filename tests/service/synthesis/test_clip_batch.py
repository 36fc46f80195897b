"""Tests of clips that share calls of the graph: equal bytes and errors as alone."""

import numpy as np
import onnx
import pytest
import recorded
from hypothesis import given, settings
from hypothesis import strategies as st
from model_files import written

from posefield.common.errors import QueryError
from posefield.inference import session
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clip_batch, clips
from posefield.synthesis.synthesizer import Synthesizer

KINDS = ("model_path", "labelled_path", "walk_path")


@pytest.fixture(scope="module", params=KINDS)
def model(request):
    path = request.getfixturevalue(request.param)
    return Synthesizer(path.stem, session.load(path))


def question(model, place, level, **more):
    """A question at shares of the ranges and, if there are performers, as one of them."""
    card, (shares, fps, who) = model.session.card, place
    ranges = [(c, c.minimum, c.maximum - c.minimum) for c in card.controls]
    controls = {c.name: low + s * span for (c, low, span), s in zip(ranges, shares, strict=False)}
    names = (None, *card.performers)
    known = {"controls": controls, "fps": fps, "performer": names[who % len(names)]}
    return ClipQuestion(**{**known, "level": level, **more})


def alone(model, asked, most):
    try:
        return clips.synthesize_clip(model, asked, most)
    except QueryError as fault:
        return fault


def facts(found):
    """All of an answer, or of an error, for comparison."""
    if isinstance(found, Exception):
        return type(found), str(found)
    own = found.clip
    names, arrays = own.skeleton.names, (own.rotations, own.translations, own.curve_values)
    return names, own.rate, found.trust, [array.tobytes() for array in arrays]


MORE = (
    {},
    {"start": 0.2},
    {"end": 0.0},
    {"end": 50.0},
    {"loop": True},
    {"root": "in_place"},
    {"extrapolate": "refuse"},
    {"feet": "stand"},
    {"names": "mixamo"},
    {"fps": 2000.0},
)


@settings(max_examples=12, deadline=None, derandomize=True)
@given(count=st.integers(2, 20), seed=st.integers(0, 1000))
def test_a_question_gets_the_same_answer_whatever_it_is_asked_with(model, count, seed):
    rng = np.random.default_rng(seed)
    level = seed % len(model.session.card.levels)
    # Beyond what was sampled too; one frame a second gives clips of a single frame or two.
    asked = [
        question(
            model,
            (rng.uniform(-0.1, 1.1, 4), rng.uniform(1.0, 60.0), rng.integers(10)),
            level,
            # Half of them without further fields.
            **MORE[max(0, rng.integers(-len(MORE), len(MORE)))],
        )
        for _ in range(count)
    ]
    found = clips.synthesize_clips(model, asked, most=150)
    assert [facts(each) for each in found] == [facts(alone(model, each, 150)) for each in asked]


def test_every_level_is_known_to_be_exact(model):
    assert all(clip_batch.is_exact(model, level) for level in range(len(model.session.card.levels)))


def counted(path):
    """A model whose levels are known to be exact, and the feeds of its graph's calls."""
    opened, feeds = recorded.session(session.load(path))
    model = Synthesizer("reaching", opened)
    assert clip_batch.is_exact(model, 0)
    feeds.clear()
    return model, feeds


def spread(model, count, **more):
    shares = np.linspace(0.1, 0.9, count)
    return [question(model, ((s, 0.5, 0.3, 0.7), 30.0, 0), 0, **more) for s in shares]


def test_clips_share_one_call_for_their_durations_and_few_for_their_frames(model_path):
    model, feeds = counted(model_path)
    asked = spread(model, 12)
    found = clips.synthesize_clips(model, asked)
    sizes = [len(feed["controls"]) for feed in feeds]
    assert sizes[0] == sum(sizes[1:]) == 12
    padded = [feed["time"].size for feed in feeds[1:]]
    assert max(padded) <= clip_batch.MAX_FRAMES
    # As few as fit: two neighbours together would exceed the limit.
    frames = sum(len(answer.clip) for answer in found)
    assert len(padded) == -(-frames // clip_batch.MAX_FRAMES)


def test_a_model_whose_clips_depend_on_their_batch_is_asked_one_by_one(model_path, tmp_path):
    """One whose softmax is over the questions, not over each question's own numbers."""
    graph = onnx.load(model_path)
    (softmax,) = (node for node in graph.graph.node if node.op_type == "Softmax")
    softmax.attribute[0].i = 0
    path = tmp_path / "reaching.onnx"
    path.write_bytes(written(graph))
    opened, feeds = recorded.session(session.load(path))
    model = Synthesizer("reaching", opened)
    assert not clip_batch.is_exact(model, 0)
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
            assert frames <= clip_batch.longest(model, asked)
            if "end" in more:
                assert clip_batch.longest(model, asked) < frames + 1.0 + 1e-9
