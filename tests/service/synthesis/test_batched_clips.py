"""Clips of many questions at once: the bytes and the errors of each alone."""

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from posefield.common.errors import QueryError
from posefield.inference import session
from posefield.question.floor import Floor
from posefield.question.motion_question import ClipQuestion, Target
from posefield.registry import shipped_models
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

KINDS = ("shipped", "labelled_path", "walk_path")


@pytest.fixture(scope="module", params=KINDS)
def pair(request):
    """Two models of one file: one answers batches, the other single questions."""
    shipped = request.param == "shipped"
    path = walk_file() if shipped else request.getfixturevalue(request.param)
    opened = session.load(path)
    return Synthesizer(path.stem, opened), Synthesizer(path.stem, opened)


def walk_file():
    return shipped_models.FOLDER / "cmu_walk.onnx"


def question(model, place, kind):
    """A question at shares of the ranges, with options of many kinds."""
    card = model.session.card
    shares, seed = place
    controls = {
        c.name: c.minimum + share * (c.maximum - c.minimum)
        for c, share in zip(card.controls, shares, strict=False)
    }
    asked = ClipQuestion(controls=controls, level=seed % len(card.levels))
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


@settings(max_examples=25, deadline=None, derandomize=True)
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
