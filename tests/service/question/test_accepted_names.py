"""Tests of the names that errors of JSON bodies suggest and list."""

import pytest

from posefield.common.errors import FormError
from posefield.question.json_decoding import decode_question
from posefield.question.motion_question import PoseQuestion

TARGET = '{"controls": {}, "times": [0], "targets": [{"joint": "A", %s}]}'


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (
            TARGET % '"pos": [0, 1, 0]',
            "targets/0/pos: Object contains unknown field `pos` (did you mean 'position'?), "
            "expected some of joint, position, time, at",
        ),
        (
            TARGET % '"position": [0, 1, 0], "at": "strat"',
            "targets/0/at: Invalid enum value 'strat' (did you mean 'start'?), expected one of "
            "start, end, event, highest, lowest, farthest",
        ),
    ],
)
def test_an_unknown_name_is_answered_with_those_that_are_known(body, said):
    with pytest.raises(FormError) as caught:
        decode_question(PoseQuestion, body.encode())
    assert str(caught.value) == said
