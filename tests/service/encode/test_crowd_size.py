"""Tests of the predicted sizes of crowds: never below the real sizes."""

import conftest
import crowds
import pytest

from posefield.encode import character, crowd_size, crowd_writer
from posefield.encode.crowd_size import CrowdCounts

# Characters, motions, frames.
SHAPES = [(1, 1, 2), (1, 1, 200), (40, 2, 2), (12, 12, 30)]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("ending", "instancing"), crowds.STREAMED)
def test_a_file_is_no_larger_than_said(ending, instancing, shape):
    characters, motions, frames = shape
    person = conftest.person()
    made = crowds.motions(person, motions, frames)
    crowd = crowds.crowd(person, made, [index % motions for index in range(characters)])
    size = sum(map(len, crowd_writer.stream(crowd, ending, instancing)))
    points = character.body_size(person, "mannequin")
    said = crowd_size.file_size_bound(
        CrowdCounts(len(person), characters, motions, frames, points),
        ending,
        instancing == "flatten",
    )
    # Of what each file begins with nothing is said.
    assert size - 40_000 < said
