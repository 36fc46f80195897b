"""Tests of clips that share calls of the graph: equal bytes and errors as alone."""

import numpy as np
import onnx
import recorded
from model_files import written

from posefield.inference import session
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clip_batch, clips
from posefield.synthesis.synthesizer import Synthesizer


def question(model, place, level, **more):
    """A question at shares of the ranges and, if there are performers, as one of them."""
    card, (shares, fps, who) = model.session.card, place
    ranges = [(c, c.minimum, c.maximum - c.minimum) for c in card.controls]
    controls = {c.name: low + s * span for (c, low, span), s in zip(ranges, shares, strict=False)}
    names = (None, *card.performers)
    known = {"controls": controls, "fps": fps, "performer": names[who % len(names)]}
    return ClipQuestion(**{**known, "level": level, **more})


def facts(found):
    """All of an answer, or of an error, for comparison."""
    if isinstance(found, Exception):
        return type(found), str(found)
    own = found.clip
    names, arrays = own.skeleton.names, (own.rotations, own.translations, own.curve_values)
    return names, own.rate, found.trust, [array.tobytes() for array in arrays]


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
