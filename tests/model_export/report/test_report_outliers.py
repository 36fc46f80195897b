"""Tests of possible outliers and of the shifts of cycles in the report."""

from dataclasses import replace

from posefield_train.graph.trained_model import Outlier
from posefield_train.report import clip_errors, warps

SAID = ("lies far away", "leaps")


def caption(chapter):
    return chapter.section().tables[0].caption


def test_an_outlier_is_listed_with_the_evidence(trained, exported):
    against = tuple(Outlier(3, "far", said) for said in SAID)
    odd = clip_errors.collect_clip_errors(
        replace(trained, outliers=against), exported.card.controls
    )
    assert caption(odd) == "Possible outliers"
    assert "Outlined" in odd.section().charts[0].caption
    ((file, said),) = odd.section().tables[0].rows
    assert said == "lies far away; leaps"
    assert file == odd.files[odd.indices.index(3)]
    assert [clip["against"] for clip in odd.facts()["clips"] if clip["against"]] == [said]
    clean = clip_errors.collect_clip_errors(trained, exported.card.controls)
    assert caption(clean) == "Clips with the largest error"
    assert "Outlined" not in clean.section().charts[0].caption
    assert not any(clip["against"] for clip in clean.facts()["clips"])


def test_shifts_of_cycles_are_told(trained):
    first, *others = trained.examples
    shifted = replace(trained, examples=(replace(first, shift=-0.125), *others))
    told = warps.collect_warps(shifted)
    assert f"{told.labels[0]} by -12.5 %" in told.section().paragraphs[-1]
    assert {clip["shift"] for clip in told.facts()["clips"]} == {0.0, -0.125}
    assert (
        len(warps.collect_warps(trained).section().paragraphs) == len(told.section().paragraphs) - 1
    )
