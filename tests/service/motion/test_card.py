"""The model card: what is written is what is read, and what is not a card is refused."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest

from service.motion import card
from service.motion.card import Control, Event, Making, ModelCard
from service.motion.detail import Level
from service.motion.field import Hyper
from service.motion.skeleton import Skeleton

CARD = ModelCard(
    name="reaching",
    description="Reaches for a target, d’un geste.",
    controls=(
        Control("height", "m", "stature", 1.6, 1.9, 1.75, (1.6, 1.75, 1.9)),
        Control("turn", "deg", "where the target is", -60.0, 60.0, 0.1, ()),
    ),
    skeleton=Skeleton(
        ("hips", "chest"),
        (-1, 0),
        np.array([[0.0, 0.9, 0.0], [0.0, 0.25, -0.01]]),
        (1,),
        np.array([[0.0, 0.1, 0.0]]),
    ),
    cyclic=False,
    root="travelling",
    rate=60.0,
    frames=100,
    samples=92,
    levels=(
        Level((22, 6, 24), 92, (0, 1), 9000, 36000, 8000, 0.005, 0.014, 0.02, 0.05, 0.009),
        Level((9, 3, 8), 12, (0,), 900, 3600, 700, 0.02, 0.05, 0.06, 0.2, None),
    ),
    durations=(0.8, 1.9),
    performers=("ada", "bob"),
    examples=((1.6, -60.0), (1.75, 0.1), (1.9, 60.0)),
    moved_by=(0, 1, 0),
    feet=(1,),
    diagnostics={"truncation_rms_m": 0.005, "notes": ["one"], "explained": {"pose": 0.9}},
    provenance={"licence": "CC0", "clips": 92},
    roles={"hips": "hips", "upperChest": "chest"},
    sources=("a.bvh", "b.bvh, frames 3 to 90", "c.bvh"),
    kriging=Hyper("matern52", (0, 1), np.array([0.3, 0.1 + 0.2]), 1e-3, 0.7),
    left_out=(0.01, 0.02, 0.5),
    beside=((0.1, 0.0), (0.2, 0.3)),
    event=Event(1, 0.75),
    joint_sigma=(0.5, 1.32),
)


def same_skeleton(a, b):
    return (
        a.same_tree(b)
        and a.tip_joints == b.tip_joints
        and np.array_equal(a.offsets, b.offsets)
        and np.array_equal(a.tip_offsets, b.tip_offsets)
    )


def test_card_read_is_the_card_written():
    read = card.load(card.dump(CARD))
    assert same_skeleton(read.skeleton, CARD.skeleton)
    # Every bit of them: who asks why computes with these.
    assert np.array_equal(read.kriging.scales, CARD.kriging.scales)
    assert replace(read.kriging, scales=CARD.kriging.scales) == CARD.kriging
    assert replace(read, skeleton=CARD.skeleton, kriging=CARD.kriging) == CARD


OPTIONAL = tuple(
    "performers roles sources kriging left_out event beside joint_sigma making".split()
)


@pytest.mark.parametrize("field", [f.name for f in fields(ModelCard) if f.name not in OPTIONAL])
def test_card_without_one_of_its_fields_is_refused_by_name(field):
    metadata = card.dump(CARD)
    del metadata[f"posefield.{field}"]
    with pytest.raises(ValueError) as refusal:
        card.load(metadata)
    assert str(refusal.value) == f"incomplete posefield metadata: '{field}'"


def test_a_making_travels_in_the_file_and_no_client_is_told():
    made = Making({"warp": (0.25, 0.0, 1.0)}, {"peak": 0.4}, {"Hand": 2.0}, in_phase=True)
    written = card.dump(replace(CARD, making=made))
    assert card.load(written).making == made
    assert "making" not in card.plain_values(replace(CARD, making=made))
    # What there is nothing to say of takes no bytes.
    few = Making({"warp": (0.25, 1.0)})
    assert (
        card.dump(replace(CARD, making=few))["posefield.making"]
        == '{"fields": {"warp": [0.25, 1.0]}}'
    )
    assert card.load(card.dump(replace(CARD, making=few))).making == few
    assert card.load(card.dump(CARD)).making is None


def test_a_card_that_says_nothing_of_roles_has_none():
    metadata = card.dump(CARD)
    del metadata["posefield.roles"]
    assert card.load(metadata).roles == {}


def test_an_older_card_has_none_of_what_it_could_not_say():
    none = {"sources": "[]", "kriging": "null", "left_out": "[]", "event": "null", "beside": "[]"}
    none["joint_sigma"] = "[]"
    none = {f"posefield.{name}": text for name, text in none.items()}
    older = {key: text for key, text in card.dump(CARD).items() if key not in none}
    read = card.load(older)
    assert (read.sources, read.kriging, read.left_out, read.event) == ((), None, (), None)
    assert (read.beside, read.joint_sigma) == ((), ())
    assert card.dump(read) == older | none


@pytest.mark.parametrize(
    ("roles", "said"),
    [
        ('{"tail": "hips"}', r"\['tail'\] are neither roles nor joints"),
        ('{"hips": "Tail"}', r"\['Tail'\] are neither roles nor joints"),
        ('{"hips": "hips", "head": "hips"}', "a joint has two of them"),
    ],
)
def test_roles_that_cannot_be_are_refused(roles, said):
    with pytest.raises(ValueError, match=said):
        card.load({**card.dump(CARD), "posefield.roles": roles})


@pytest.mark.parametrize("missing", ["names", "parents", "offsets", "tip_joints", "tip_offsets"])
def test_card_with_half_a_skeleton_is_refused(missing):
    metadata = card.dump(CARD)
    joints = json.loads(metadata["posefield.skeleton"])
    del joints[missing]
    with pytest.raises(ValueError, match=f"incomplete posefield metadata: '{missing}'"):
        card.load({**metadata, "posefield.skeleton": json.dumps(joints)})


def test_control_without_a_unit_is_refused():
    metadata = card.dump(CARD)
    controls = json.loads(metadata["posefield.controls"])
    del controls[0]["unit"]
    with pytest.raises(ValueError, match=r"incomplete posefield metadata: .*unit"):
        card.load({**metadata, "posefield.controls": json.dumps(controls)})


@pytest.mark.parametrize("found", [0, 1, 99])
def test_other_format_is_refused_with_both_versions(found):
    metadata = {**card.dump(CARD), "posefield.format": json.dumps(found)}
    with pytest.raises(ValueError) as refusal:
        card.load(metadata)
    assert str(refusal.value) == f"model format {found}, this version reads format 2"


def test_other_format_is_refused_before_anything_else_is_looked_at():
    with pytest.raises(ValueError, match="model format 3, this version reads format 2"):
        card.load({"posefield.format": "3"})


@pytest.mark.parametrize("metadata", [{}, {"author": "someone", "posefield": "1"}])
def test_metadata_of_another_producer_is_refused(metadata):
    with pytest.raises(ValueError) as refusal:
        card.load(metadata)
    assert str(refusal.value) == "no posefield metadata: it was not written by posefield"


def test_entries_of_others_are_left_alone():
    assert card.load({**card.dump(CARD), "author": "not JSON"}).name == "reaching"


def test_equal_cards_give_equal_text_in_equal_order():
    shuffled = replace(CARD, diagnostics=dict(reversed(list(CARD.diagnostics.items()))))
    assert list(card.dump(shuffled).items()) == list(card.dump(CARD).items())
    assert list(card.dump(CARD)) == sorted(card.dump(CARD))
    assert card.dump(replace(CARD, rate=30.0)) != card.dump(CARD)


def test_every_entry_is_json_under_the_prefix():
    for key, value in card.dump(CARD).items():
        assert key.startswith("posefield.")
        json.loads(value)


def test_bones_are_written_to_the_micrometre():
    offsets = CARD.skeleton.offsets + 1.23456789e-5
    written = card.load(card.dump(replace(CARD, skeleton=replace(CARD.skeleton, offsets=offsets))))
    away = np.abs(written.skeleton.offsets - offsets).max()
    assert 0.0 < away <= 0.5e-6


def test_control_is_found_by_its_name():
    assert CARD.control("turn") is CARD.controls[1]
    assert CARD.control("speed") is None


def test_foreign_metadata_is_passed_over_and_broken_own_metadata_is_named():
    entries = card.dump(CARD)
    assert card.load({**entries, "x.posefield.note": "free text"}).name == CARD.name
    with pytest.raises(ValueError, match=r"metadata posefield\.name is not JSON"):
        card.load({**entries, "posefield.name": "free text"})
