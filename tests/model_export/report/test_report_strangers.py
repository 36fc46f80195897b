"""The report marks clips that do not seem to belong, and says where cycles were begun."""

from dataclasses import replace

from model_export.report import clips, warps
from model_export.strangers import Stranger

SAID = ("lies far away", "leaps")


def heading(chapter):
    return chapter.section().tables[0].heading[0]


def test_a_stranger_is_marked_with_what_speaks_against_it(trained, exported):
    against = tuple(Stranger(3, "far", said) for said in SAID)
    odd = clips.of(replace(trained, strangers=against), exported.card.controls)
    assert heading(odd) == "does not seem to belong"
    ((file, said),) = odd.section().tables[0].rows
    assert said == "lies far away; leaps"
    assert file == odd.files[odd.indices.index(3)]
    assert [clip["against"] for clip in odd.facts()["clips"] if clip["against"]] == [said]
    clean = clips.of(trained, exported.card.controls)
    assert heading(clean) == "worst clips"
    assert not any(clip["against"] for clip in clean.facts()["clips"])


def test_shifts_of_cycles_are_told(trained):
    first, *others = trained.examples
    shifted = replace(trained, examples=(replace(first, shift=-0.125), *others))
    told = warps.of(shifted)
    assert f"{told.labels[0]} by -12.5 %" in told.section().words[-1]
    assert {clip["shift"] for clip in told.facts()["clips"]} == {0.0, -0.125}
    assert len(warps.of(trained).section().words) == len(told.section().words) - 1
