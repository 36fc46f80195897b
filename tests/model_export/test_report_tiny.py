"""Test of a report of a family without performers and with few pairs and one control."""

import json

import numpy as np
import pytest
from minimal import recipe_with, small_clip, write_clips

from posefield_train import train
from posefield_train.graph import onnx_export
from posefield_train.report import levels_of_detail, training_report
from posefield_train.source import ingest


@pytest.mark.parametrize("cyclic", [False, True])
def test_a_family_of_one_control_and_no_performers_has_a_report(tmp_path, cyclic):
    clips = [small_clip(0.3 * np.sin(i), 21 + i % 3) for i in range(8)]
    recipe = recipe_with(motion={"cyclic": cyclic})
    examples, notes = ingest.ingest(recipe, write_clips(tmp_path, clips))
    trained = train.train(recipe, examples, lambda _: None)
    exported = onnx_export.export_model(recipe, trained, notes)
    others = levels_of_detail.build_alternatives(recipe, trained, exported.card)
    levels = levels_of_detail.time_levels(exported, others)
    facts = json.loads(training_report.render(trained, exported, levels, []).json)
    assert [level["effector_m"] for level in facts["levels"]["levels"]] == [None] * 4
    assert ("travel" in facts["fields"]) == cyclic
    assert facts["coverage"]["one_value_a_performer"] == []
    assert [clip["performer"] for clip in facts["clips"]["clips"]] == [""] * 8
