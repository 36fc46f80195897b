"""Tests of the serialised model card: JSON in a fixed order, without internal fields."""

import base64
import json
from dataclasses import replace

import numpy as np
from model_cards import CARD

from posefield.model_file import model_card
from posefield.model_file.model_card import TrainingParameters


def test_making_is_in_the_file_and_not_sent_to_clients():
    entries = model_card.dump(CARD)
    assert json.loads(entries["posefield.making"]) == {
        "fields": {"warp": [0.25, 1, 0]},
        "landmarks": {"peak": 0.4},
        "joint_weights": {"chest": 2.0},
        "in_phase": True,
        "takes": [0, 0, 1],
        "take_root": [[row] * 28 for row in (0.1, 0.2, 0.3, 0.4)],
        "detail": base64.b64encode(CARD.making.detail).decode(),
    }
    assert "making" not in model_card.plain_values(CARD)


def test_parameters_at_their_default_take_no_bytes():
    few = model_card.dump(replace(CARD, making=TrainingParameters({"warp": (0.25, 1)})))
    assert few["posefield.making"] == '{"fields": {"warp": [0.25, 1]}}'
    assert model_card.dump(replace(CARD, making=TrainingParameters()))["posefield.making"] == "{}"
    controls = json.loads(few["posefield.controls"])
    assert controls[0]["measure"] == {"quantity": "stature"}
    assert "measure" not in controls[1]


def test_equal_cards_give_equal_text_in_equal_order():
    shuffled = replace(CARD, diagnostics=dict(reversed(list(CARD.diagnostics.items()))))
    assert list(model_card.dump(shuffled).items()) == list(model_card.dump(CARD).items())
    assert list(model_card.dump(CARD)) == sorted(model_card.dump(CARD))
    assert model_card.dump(replace(CARD, rate=30.0)) != model_card.dump(CARD)


def test_bones_are_written_to_the_micrometre():
    offsets = CARD.skeleton.offsets + 1.23456789e-5
    entries = model_card.dump(replace(CARD, skeleton=replace(CARD.skeleton, offsets=offsets)))
    away = np.abs(np.array(json.loads(entries["posefield.skeleton"])["offsets"]) - offsets).max()
    assert 0.0 < away <= 0.5e-6
