"""Tests of reading clips and cards, and of errors for invalid ones."""

import io
import json

import numpy as np
import pytest
from without_blender import cards, clips, faults, marks
from without_blender.cards import Control
from without_blender.clips import Question

UNITS = {"length": "metre", "up": "Y"}
TRUST = {"model": "reach@0123", "controls": {"turn": 20.0}, "sigma": 0.017}


def plain(**other):
    """Arrays of a clip of two joints and three frames."""
    return {
        "names": np.array(["Hips", "Spine"]),
        "parents": np.array([-1, 0], dtype=np.int32),
        "rate": np.array(30.0),
        "units": np.array(json.dumps(UNITS)),
        "trust": np.array(json.dumps(TRUST)),
        "rotations": np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (3, 2, 1)),
        "root_position": np.array([(1, 2, 3)] * 3, dtype=np.float32),
        "bone_offsets": np.array([(0, 0, 0), (0, 0.5, 0.1)], dtype=np.float32),
    } | other


def packed(arrays):
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def test_y_up_becomes_z_up():
    clip = clips.decode(packed(plain()))
    assert clip.parents == {"Hips": None, "Spine": "Hips"}
    np.testing.assert_array_equal(clip.path[0], (1, -3, 2))
    np.testing.assert_allclose(clip.offsets[1], (0, -0.1, 0.5), atol=1e-7)
    assert (len(clip), clip.sigma) == (3, 0.017)


def told(**said):
    clip = clips.decode(packed(plain(trust=np.array(json.dumps(TRUST | said)))))
    return [mark and (mark.held, mark.words) for mark in (f(clip.trust) for f in FLAGS)]


FLAGS = (marks.support, marks.performer)


def test_whether_anything_like_it_was_captured_is_said_in_words():
    assert told(supported=True)[0] == (True, "Captured near here")
    assert told(supported=False)[0] == (False, "Nothing like it was captured")


def test_whether_who_moves_was_captured_is_said_where_performers_are_told_apart():
    nobody = told(supported=True, performer=None, performer_seen=False)
    assert nobody[1] == (False, "Moves as an unseen performer")
    assert told(performer="kim", performer_seen=True)[1] == (True, "kim was captured")
    mixed = told(performer=None, performer_seen=True, labels={"performer": {"kim": 0.5}})
    assert mixed[1] == (True, "Moves as a mixture of performers")
    assert told(supported=True, performer=None)[1] is None


def test_of_what_an_older_service_does_not_say_nothing_is_said():
    assert told() == [None, None]


def test_curves_that_the_panel_does_not_animate_are_counted():
    names = np.array(["jawOpen", "smile"])
    clip = clips.decode(packed(plain(curve_names=names, curves=np.zeros((3, 2)))))
    assert clip.curves == ("jawOpen", "smile")
    found = marks.curves(clip.curves)
    assert not found.held and found.words.startswith("2 curves are not animated")
    assert marks.curves(clips.decode(packed(plain())).curves) is None


def test_a_clip_is_no_answer_to_another_question():
    clip = clips.decode(packed(plain(trust=np.array(json.dumps(TRUST | {"performer": "kim"})))))
    kim = {"performer": "kim"}
    assert clip.answers("reach@0123", {"turn": 20.0}, kim)
    assert not clip.answers("reach@4567", {"turn": 20.0}, kim)
    assert not clip.answers("reach@0123", {"turn": 20.5}, kim)
    assert not clip.answers("reach@0123", {"turn": 20.0}, {})
    assert not clip.answers("reach@0123", {"turn": 20.0}, kim | {"style": "calm"})
    styled = plain(trust=np.array(json.dumps(TRUST | {"labels": {"style": {"calm": 0.5}}})))
    clip = clips.decode(packed(styled))
    assert clip.answers("reach@0123", {"turn": 20.0}, {"style": {"calm": 0.5}})
    assert not clip.answers("reach@0123", {"turn": 20.0}, {"style": "calm"})


def test_a_request_has_the_performer_and_the_other_labels():
    body = Question("reach", {}, labels={"performer": "kim", "style": {"calm": 0.5}}).body()
    assert (body["performer"], body["labels"]) == ("kim", {"style": {"calm": 0.5}})
    mixed = Question("reach", {}, labels={"performer": {"kim": 0.5}}).body()
    assert (mixed["performer"], mixed["labels"]) == (None, {"performer": {"kim": 0.5}})
    # Services older than 3.1.0 refuse a field that they do not know.
    assert "labels" not in Question("reach", {}, labels={"performer": "kim"}).body()


def test_neighbouring_quaternions_lie_close():
    turned = plain()["rotations"].copy()
    turned[1] *= -1
    clip = clips.decode(packed(plain(rotations=turned)))
    np.testing.assert_array_equal(clip.rotations[1], clip.rotations[0])


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"units": np.array(json.dumps(UNITS | {"up": "Z"}))}, "Z up, expected metre, Y"),
        ({"units": np.array(json.dumps(UNITS | {"length": "centimetre"}))}, "centimetre"),
        ({"rotations": np.ones((3, 2, 4), dtype=np.float32)}, "length is 1 off one"),
        ({"rotations": plain()["rotations"][:2]}, r"arrays of shapes \(\(2, 2, 4\)"),
        ({"root_position": np.full((3, 3), np.nan)}, "not finite"),
        ({"bone_offsets": np.zeros((3, 3))}, "arrays of shapes"),
        ({"names": np.array(["Hips"])}, "arrays of shapes"),
        ({"parents": np.array([-1], dtype=np.int32)}, "zip"),
        ({"rate": np.array(0.0)}, "0 frames a second, expected more"),
        ({"rate": np.array(np.nan)}, "nan frames a second, expected more"),
        *(
            ({"trust": np.array(json.dumps({k: TRUST[k] for k in TRUST if k != lacking}))}, lacking)
            for lacking in TRUST
        ),
        ({"trust": np.array(json.dumps(TRUST | {"sigma": np.inf}))}, "finite sigma"),
        ({"trust": np.array(json.dumps(TRUST | {"controls": None}))}, "its controls"),
        ({"trust": np.array(json.dumps(TRUST | {"supported": "no"}))}, "supported is 'no'"),
        ({"trust": np.array(json.dumps(TRUST | {"performer_seen": 2}))}, "performer_seen is 2"),
        ({"trust": np.array(json.dumps(TRUST | {"labels": ["calm"]}))}, r"labels are \['calm'\]"),
        ({"trust": np.array("[]")}, "cannot be read"),
        ({"names": np.array([object(), 1], dtype=object)}, "allow_pickle"),
    ],
)
def test_what_is_no_such_clip_is_refused(other, words):
    with pytest.raises(faults.Unintelligible, match=words):
        clips.decode(packed(plain(**other)))


@pytest.mark.parametrize("cut", [0, 1, 100, -30])
def test_what_is_no_archive_is_refused(cut):
    with pytest.raises(faults.Unintelligible, match="cannot be read"):
        clips.decode(packed(plain())[:cut])


def test_a_missing_array_is_named():
    arrays = plain()
    del arrays["trust"]
    with pytest.raises(faults.Unintelligible, match="trust"):
        clips.decode(packed(arrays))


@pytest.mark.parametrize("content", [b"", b"[]", b"{}", b'{"skeleton": {"names": ["a"]}}'])
def test_what_is_no_card_is_refused(content):
    with pytest.raises(faults.Unintelligible, match="of another version"):
        cards.decode(content)


STATURE = Control("stature", "m", "How tall", 1.6212345678, 1.87776541, 1.75, (1.65, 1.72))


@pytest.mark.parametrize("value", [1.6212345678, 1.87776541, 1.75, 1.72, 1.7, -3.25])
def test_a_slider_means_the_number_that_was_put_there(value):
    assert STATURE.exact(float(np.float32(value))) == value
    assert float(np.float32(value)) != value or value == 1.75 or value == -3.25


def test_a_bound_is_inside_though_its_float32_is_beyond():
    beyond = float(np.float32(STATURE.maximum))
    assert beyond > STATURE.maximum
    assert STATURE.holds(STATURE.exact(beyond))
    assert not STATURE.holds(STATURE.exact(1.9))


def test_limits_are_those_of_the_service():
    lowest, highest = STATURE.limits
    width = STATURE.maximum - STATURE.minimum
    assert (lowest, highest) == (STATURE.minimum - 100 * width, STATURE.maximum + 100 * width)
    assert STATURE.sampled == "1.65, 1.72 m"
