"""Tests of `why`: the reported weights reproduce the answer."""

import numpy as np
import pytest
from msgspec import structs

from posefield.common.errors import InvalidField, OutsideSamples
from posefield.question.model_question import WhyQuestion
from posefield.question.results import Explanation
from posefield.registry import model_registry
from posefield.synthesis.trust import explain_result

EVERYTHING = 10_000


@pytest.fixture(scope="module", params=["one", "labelled"])
def case(request):
    """A trained model and its file, with performers told apart and without."""
    names = {"one": ("trained", "model_path"), "labelled": ("labelled", "labelled_path")}
    made, path = (request.getfixturevalue(name) for name in names[request.param])
    return made, model_registry.load([path]).find(path.stem)


def drawn(card, rng, count=20):
    """Points inside what was sampled and around it."""
    low, high = np.transpose([(c.minimum, c.maximum) for c in card.controls])
    return rng.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), (count, len(low)))


def asked(card, point, performer=None, nearest=EVERYTHING):
    controls = {c.name: float(v) for c, v in zip(card.controls, point, strict=True)}
    return WhyQuestion(controls=controls, extrapolate="warn", performer=performer, nearest=nearest)


def in_the_card_s_order(card, found: Explanation):
    """Weights (N,) of an answer that lists all clips."""
    at = {source: i for i, source in enumerate(card.sources)}
    assert len(at) == len(card.sources) == len(found.nearest)
    weights = np.zeros(len(at))
    weights[[at[clip.source] for clip in found.nearest]] = [clip.weight for clip in found.nearest]
    return weights


def test_samples_and_weights_are_those_of_the_training(case, rng):
    made, model = case
    weigher, pose = model.session.kriging_weights, made.model.bank.pose
    assert np.array_equal(weigher.samples, pose.samples)
    points = np.hstack([rng.uniform(-1, 1, (9, made.samples.controls)), pose.samples[:9, 4:]])
    np.testing.assert_allclose(weigher.weights(points), pose.weights(points), atol=1e-9)


def test_weights_add_up_to_one(case, rng):
    card, model = case[1].session.card, case[1]
    for performer in (None, *card.performers):
        for point in drawn(card, rng, 5):
            listed = in_the_card_s_order(card, explain_result(model, asked(card, point, performer)))
            assert abs(listed.sum() - 1.0) < 1e-9
            # Negative control: without one of the clips they do not.
            assert abs(np.delete(listed, np.argmax(np.abs(listed))).sum() - 1.0) > 1e-3
            few = explain_result(model, asked(card, point, performer, 3))
            listed = sum(clip.weight for clip in few.nearest)
            assert abs(listed + few.others_weight - 1.0) < 1e-9
            assert len(few.nearest) + few.others == card.samples


def test_the_file_s_poses_are_the_weighted_sum_of_the_captured_clips(case, rng):
    """Through the file: its rotations are those of the captured coefficients, weighed."""
    made, model = case
    card, stages = model.session.card, made.model
    captured = stages.decoder.reduced.bases[2]
    labels = np.zeros((1, len(card.performers)))
    for point in drawn(card, rng, 8).astype(np.float32).astype(float):
        fields = stages.bank.numpy(stages.bank.points(point[None], labels))
        time = np.array([[0.3, 0.7]])
        _, place = stages.timing.numpy(fields["duration"], fields["warp"], time)
        weights = in_the_card_s_order(card, explain_result(model, asked(card, point)))
        turns = model.session.run(point[None], time, "rotations")[0]
        # What the event's prediction adds to them is the same for all weights.
        more = fields["pose"][:, captured.shape[1] :]
        told, _ = stages.decoder.numpy(np.hstack([(weights @ captured)[None], more]), place)
        np.testing.assert_allclose(told, turns, atol=1e-4)
        # Negative control: the weights of another answer tell another pose.
        other = in_the_card_s_order(card, explain_result(model, asked(card, 0.98 * point)))
        wrong, _ = stages.decoder.numpy(np.hstack([(other @ captured)[None], more]), place)
        assert np.abs(wrong - turns).max() > 1e-3


def test_the_nearest_come_first_and_a_clip_is_nearest_to_itself(case):
    model = case[1]
    card = model.session.card
    for index in (0, card.samples // 2, card.samples - 1):
        performer = card.performers[card.moved_by[index]] if card.performers else None
        found = explain_result(model, asked(card, card.examples[index], performer)).nearest
        distances = [clip.distance for clip in found]
        assert distances == sorted(distances) and distances[0] < 1e-12 < distances[1]
        assert found[0].source == card.sources[index]
        assert found[0].performer == performer
        assert tuple(found[0].controls.values()) == card.examples[index]


def test_what_cannot_be_answered_is_refused(case):
    model = case[1]
    card = model.session.card
    question = asked(card, card.examples[0])
    outside = {**question.controls, "turn": 1e3}
    assert len(explain_result(model, structs.replace(question, controls=outside)).warnings) == 1
    with pytest.raises(OutsideSamples, match="turn = 1000"):
        explain_result(model, structs.replace(question, controls=outside, extrapolate="refuse"))
    for change, field in (
        ({"nearest": 0}, "nearest"),
        ({"performer": "nobody"}, "performer"),
        ({"controls": {**question.controls, "spin": 1.0}}, "controls/spin"),
    ):
        with pytest.raises(InvalidField) as caught:
            explain_result(model, structs.replace(question, **change))
        assert caught.value.field == field
