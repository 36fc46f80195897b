"""Tests of answers outside the sampled ranges: bounded, never beyond what was asked, and told."""

import numpy as np
import pytest

from posefield.inference import session
from posefield.question.model_question import WhyQuestion
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield.synthesis.trust import explain_result

SHARES = (-40.0, -1.0, -0.3, -0.05, 0.0, 0.5, 1.0, 1.05, 1.2, 2.0, 40.0)
"""Places of asked values, from 0 at the smallest sampled one to 1 at the largest."""
NEAR = 1e-6
# Share of a control's range: the tolerance of the correction in each.
ROUNDING = 1e-3


@pytest.fixture(scope="module", params=["labelled_path", "walk_path", "measured_walk_path"])
def model(request) -> Synthesizer:
    path = request.getfixturevalue(request.param)
    return Synthesizer(path.stem, session.load(path))


@pytest.fixture(scope="module")
def walk(measured_walk_path) -> Synthesizer:
    return Synthesizer("walk", session.load(measured_walk_path))


def trust(model, controls, **rest):
    return clips.synthesize_clip(model, ClipQuestion(controls=controls, **rest)).trust


def at(control, share):
    return control.minimum + share * (control.maximum - control.minimum)


def swept(model, performer):
    """The trust of every asked value of every control, alone and in order."""
    for control in model.session.card.controls:
        values = [at(control, share) for share in SHARES]
        yield (
            control,
            values,
            [trust(model, {control.name: v}, performer=performer) for v in values],
        )


def test_durations_stay_in_their_margin_and_measured_controls_are_monotone_and_not_passed(model):
    low, high = model.session.card.durations
    margin = session.MARGIN
    for performer in (None, *model.session.card.performers):
        for control, values, answers in swept(model, performer):
            for value, answer in zip(values, answers, strict=True):
                if not control.minimum <= value <= control.maximum:
                    assert (
                        low * (1 - margin) - NEAR <= answer.duration <= high * (1 + margin) + NEAR
                    )
            if control.measure is None or control.measure.is_body_measure:
                continue
            given = np.array([answer.measured[control.name] for answer in answers])
            room = ROUNDING * (control.maximum - control.minimum)
            assert np.all(np.diff(given) >= -room), control.name
            for value, found in zip(values, given, strict=True):
                if value > control.maximum:
                    assert found <= value + room
                if value < control.minimum:
                    assert found >= value - room


def test_what_was_asked_and_given_is_told_with_its_side(walk):
    speed = walk.session.card.control("speed")
    for share, side in ((9.0, "below"), (-9.0, "above")):
        value = at(speed, share)
        found = trust(walk, {"speed": value})
        [told] = found.deviations
        assert (told.control, told.asked, told.side) == ("speed", value, side)
        assert told.given == found.measured["speed"]
        assert told.captured == (speed.minimum, speed.maximum)
        assert told.sentence in found.warnings and f"; {side} what was asked" in told.sentence
        assert trust(walk, {"speed": value}, extrapolate="ok").warnings == ()
        assert trust(walk, {"speed": value}, extrapolate="ok").deviations == (told,)
        facts = found.facts()["deviations"][0]
        assert facts["side"] == side and facts["captured"] == (speed.minimum, speed.maximum)
    assert trust(walk, {"speed": at(speed, 0.5)}).deviations == ()
    assert "deviations" not in trust(walk, {"speed": at(speed, 0.5)}).facts()


def test_a_control_that_is_not_measured_acts_as_at_the_limit(labelled_path):
    model = Synthesizer("labelled", session.load(labelled_path))
    turn = model.session.card.control("turn")
    typical = {c.name: c.default for c in model.session.card.controls}
    limit = session.limit_control(turn, 1e9)
    far, end = ({**typical, "turn": value} for value in (at(turn, 7.0), limit))
    one, other = (clips.synthesize_clip(model, ClipQuestion(controls=c)) for c in (far, end))
    assert one.clip.rotations.tobytes() == other.clip.rotations.tobytes()
    assert [each.given for each in one.trust.deviations] == [limit]
    rounded = {**typical, "turn": limit + 5e-4 * (turn.maximum - turn.minimum)}
    assert trust(model, rounded).deviations == ()
    assert other.trust.deviations == ()
    # Sigma is that of the asked values, and a little inside the limit it is another clip.
    assert one.trust.sigma > other.trust.sigma
    inside = {**typical, "turn": at(turn, 1.2)}
    another = clips.synthesize_clip(model, ClipQuestion(controls=inside))
    assert another.clip.rotations.tobytes() != one.clip.rotations.tobytes()


def test_within_the_ranges_the_answer_is_the_graph_s(model, rng):
    card = model.session.card
    low, high = np.transpose([(c.minimum, c.maximum) for c in card.controls])
    points = rng.uniform(low, high, (50, len(low)))
    time = np.full((50, 1), 0.4 * card.durations[0])
    outputs = ("rotations", "root_position", "duration", "sigma", "travel")
    feed = {"controls": points.astype(np.float32), "time": time.astype(np.float32)}
    if card.performers:
        feed["labels"] = np.zeros((50, len(card.performers)), np.float32)
    raw = model.session.graph.run(outputs, feed, 0)
    labels = feed.get("labels")
    for own, expected in zip(
        model.session.run(points, time, *outputs, labels=labels), raw, strict=True
    ):
        assert own.tobytes() == expected.tobytes()
    # Among rows outside, those inside keep their bytes, too.
    mixed = np.vstack([points, points + 2.0 * (high - low)])
    both = model.session.run(
        mixed,
        np.tile(time, (2, 1)),
        *outputs,
        labels=None if labels is None else np.tile(labels, (2, 1)),
    )
    for own, expected in zip(both, raw, strict=True):
        np.testing.assert_allclose(own[:50], expected, atol=1e-6)
    assert np.abs(both[0][50:] - raw[0]).max() > 1e-2


def test_weights_are_those_of_the_answer_and_shares_positive(model):
    card = model.session.card
    for share in (-3.0, 0.3, 0.8, 4.0):
        asked = {c.name: at(c, share) for c in card.controls}
        for performer in (None, *card.performers):
            found = explain_result(
                model, WhyQuestion(controls=asked, performer=performer, nearest=4)
            )
            shares = [clip.share for clip in found.nearest]
            assert min(shares) >= 0.0 and found.others_share >= 0.0
            assert sum(shares) + found.others_share == pytest.approx(1.0, abs=1e-12)
            assert all(clip.share == 0.0 for clip in found.nearest if clip.weight <= 0.0)
    limits = {c.name: session.limit_control(c, at(c, 4.0)) for c in card.controls}
    one, other = (
        explain_result(model, WhyQuestion(controls=c, nearest=10_000)) for c in (asked, limits)
    )
    assert {c.source: c.weight for c in one.nearest} == {c.source: c.weight for c in other.nearest}
