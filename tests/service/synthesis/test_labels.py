"""Tests of a model with performers and styles: names, weights and open sets in all answers."""

import re

import numpy as np
import pytest
from asking import asker

from posefield.common.errors import InvalidField
from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.model_file import checked_file, model_card
from posefield.question.model_question import SigmaQuestion, SuggestQuestion, WhyQuestion
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips, poses, trust

POINT = {"haste": 4.0, "veer": 0.0}


@pytest.fixture(scope="module")
def model(styled_path):
    return model_registry.load([styled_path]).models["styled"]


def posed(model, **asked):
    return poses.synthesize_poses(model, PoseQuestion(controls=POINT, times=[0.4], **asked))


def apart(a, b):
    return np.abs(a.rotations - b.rotations).max()


def test_the_card_has_both_sets_in_the_file_and_for_clients(model):
    card = model.session.card
    assert [(own.name, own.names) for own in card.labels] == [
        ("performer", ("ann", "ben")),
        ("style", ("marching", "plain", "sneaking")),
    ]
    entries = {key: text.encode() for key, text in model_card.dump(card).items()}
    assert checked_file.decode_card(entries).labels == card.labels
    told = model_card.plain_values(card)
    assert told["performers"] == ["ann", "ben"]
    assert [own["name"] for own in told["labels"]] == ["performer", "style"]
    assert card.clip_labels.shape == (36, 5) and (card.clip_labels.sum(axis=1) == 2.0).all()


def test_each_set_is_asked_for_by_name_or_left_open(model):
    asked = (
        {},
        {"performer": "ann"},
        {"labels": {"style": "marching"}},
        {"performer": "ann", "labels": {"style": "marching"}},
        {"performer": "ann", "labels": {"style": "sneaking"}},
        {"performer": "ben", "labels": {"style": "marching"}},
    )
    found = [posed(model, **each) for each in asked]
    for i, one in enumerate(found):
        assert all(apart(one, other) > 1e-3 for other in found[:i])
    open_, performer, style, both, *_ = (each.trust.sigma for each in found)
    assert both < min(performer, style) and max(performer, style) < open_
    assert found[3].trust.labels == {"style": "marching"}
    assert found[3].trust.facts()["labels"] == {"style": "marching"}
    assert "labels" not in found[1].trust.facts()


def test_the_performer_is_short_for_its_label_set(model):
    short, long = posed(model, performer="ann"), posed(model, labels={"performer": "ann"})
    assert apart(short, long) == 0.0
    assert (short.trust.performer, long.trust.performer) == ("ann", None)
    assert short.trust.performer_seen and long.trust.performer_seen
    assert apart(short, posed(model, labels={"performer": "ben"})) > 1e-3


def test_weights_of_one_name_are_the_name_and_others_lie_between(model):
    named = posed(model, labels={"style": "marching"})
    assert apart(named, posed(model, labels={"style": {"marching": 1.0}})) == 0.0
    mixed = posed(model, labels={"style": {"marching": 0.5, "sneaking": 0.5}})
    other = posed(model, labels={"style": "sneaking"})
    assert min(apart(mixed, named), apart(mixed, other)) > 1e-3
    assert max(apart(mixed, named), apart(mixed, other)) < apart(named, other)
    assert mixed.trust.sigma > max(named.trust.sigma, other.trust.sigma)
    less = posed(model, labels={"style": {"marching": 0.5}})
    assert apart(less, named) > 1e-3 and apart(less, posed(model)) > 1e-3


@pytest.mark.parametrize(
    ("labels", "said"),
    [
        ({"stile": "plain"}, "labels/stile: 'stile' (did you mean 'style'?), expected one of the"),
        (
            {"style": "plane"},
            "labels/style: 'plane' (did you mean 'plain'?), expected one of march",
        ),
        ({"style": {"plain": -0.5}}, "labels/style/plain: -0.5, expected a weight of 0 to 1"),
        ({"style": {"plain": float("nan")}}, "labels/style/plain: nan, expected a finite number"),
        ({"style": {"plain": 0.75, "marching": 0.5}}, "labels/style: weights with a sum of 1.25"),
    ],
)
def test_labels_that_cannot_be_used_are_refused(model, labels, said):
    questions = (
        lambda: posed(model, labels=labels),
        lambda: clips.synthesize_clip(model, ClipQuestion(controls=POINT, labels=labels)),
        lambda: trust.explain_result(model, WhyQuestion(controls=POINT, labels=labels)),
        lambda: trust.grid(model, SigmaQuestion(across="haste", along="veer", labels=labels)),
        lambda: trust.suggest(model, SuggestQuestion(labels=labels)),
    )
    for asked in questions:
        with pytest.raises(InvalidField, match=re.escape(said)):
            asked()


def test_a_performer_in_both_ways_is_refused(model):
    with pytest.raises(InvalidField, match="performer: 'ann' and labels/performer, expected one"):
        posed(model, performer="ann", labels={"performer": "ann"})


def test_open_controls_are_those_of_clips_with_the_asked_labels(model):
    card = model.session.card
    asked = model.validator.question({}, "warn", "ben", 0, {"style": "sneaking"})
    row = card.examples.index(tuple(asked.controls.values()))
    assert card.clip_names(row) == {"performer": "ben", "style": "sneaking"}


def test_over_http_labels_are_parameters_bodies_and_answers(styled_path):
    ask = asker(create_app(model_registry.load([styled_path]), Settings()))
    path = "/v1/models/styled"
    asked = "haste=4&veer=0&label=performer=ann:0.5,ben:0.5&label=style=marching"
    labels = {"performer": {"ann": 0.5, "ben": 0.5}, "style": "marching"}
    got = ask("GET", f"{path}/pose.json?{asked}&time=0.4").json()
    body = {"controls": POINT, "times": [0.4], "labels": labels}
    assert got == ask("POST", f"{path}/pose.json", json=body).json()
    assert got["trust"]["labels"] == labels and got["trust"]["performer"] is None
    why = ask("GET", f"{path}/why?{asked}&nearest=2").json()
    assert why["labels"] == labels and {*why["nearest"][0]["labels"]} == {"style"}
    sigma = ask("GET", f"{path}/sigma.json?across=haste&along=veer&label=style=plain").json()
    assert sigma["labels"] == {"style": "plain"}
    suggested = ask("GET", f"{path}/suggestions?count=1&label=style=plain").json()
    assert suggested["labels"] == {"style": "plain"}
    crowd = {"controls": POINT, "time": [0.1, 0.2], "labels": {"style": ["plain", None]}}
    assert len(ask("POST", f"{path}/crowd.json", json=crowd).json()["rotations"]) == 2
    for form in ("usda", "usdc"):
        answer = ask("GET", f"{path}/crowd.{form}?count=3&seconds=0.5")
        assert answer.status_code == 200, answer.text
    card = ask("GET", path).json()
    assert next(own["names"] for own in card["labels"]) == card["performers"]


REACH = {"stature": 1.75, "hip_height": 0.9, "turn": 10.0, "target_height": 1.0}


NAMES = ("middle", "short", "tall")


@pytest.fixture(scope="module")
def reaching(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.fixture(scope="module")
def plain(model_path):
    return model_registry.load([model_path]).models["reaching"]


# A pose is asked for twice: alone it would be summed in another order.
TWICE = np.array([[0.5], [0.5]])


def test_the_answer_for_a_name_is_that_of_its_label(reaching):
    point = np.array([[REACH[c.name] for c in reaching.session.card.controls]])
    for name, label in zip(NAMES, np.eye(3), strict=True):
        answer = poses.synthesize_poses(
            reaching, PoseQuestion(controls=REACH, times=[0.5], performer=name)
        )
        rotations = [
            reaching.session.run(point.repeat(2, 0), TWICE, "rotations", labels=labels)[0][0, 0]
            for labels in (np.tile(label, (2, 1)), np.tile(np.roll(label, 1), (2, 1)))
        ]
        assert np.array_equal(answer.rotations[0], rotations[0])
        assert not np.array_equal(answer.rotations[0], rotations[1])


def test_a_model_that_knows_nobody_refuses_every_name(plain):
    with pytest.raises(InvalidField) as caught:
        poses.synthesize_poses(plain, PoseQuestion(controls=REACH, times=[0.0], performer="tall"))
    assert caught.value.field == "performer"
    assert caught.value.message == "'tall', expected none: this model knows none"
    assert (
        poses.synthesize_poses(plain, PoseQuestion(controls=REACH, times=[0.0])).trust.performer
        is None
    )
