"""Scripts that are refused in process, with a pointer, what was found and what was expected."""

import bad_scripts
import msgspec
import pytest
from bad_scripts import ABSENT, REFUSED, UNREADABLE

from posefield.common.errors import InvalidField, QueryError, UnknownModel
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.performance_question import PerformanceQuestion
from posefield.registry import model_registry


@pytest.fixture(scope="module")
def find(models):
    return model_registry.load([models]).find


def performed(document, find, answer=composition.perform):
    content = msgspec.json.encode(document)
    question = json_decoding.decode_question(PerformanceQuestion, content)
    return answer(resolve_script(question, find), 10_000)


@pytest.mark.parametrize("name", UNREADABLE | REFUSED)
@pytest.mark.parametrize("answer", [composition.perform, composition.plan])
def test_a_bad_script_is_refused_where_it_is_bad(find, name, answer):
    document, pointer, words = (UNREADABLE | REFUSED)[name]
    with pytest.raises(QueryError) as refused:
        performed(document, find, answer)
    assert f"/{refused.value.field}" == pointer
    assert words in refused.value.message


@pytest.mark.parametrize("name", ABSENT)
def test_a_model_that_there_is_not_is_named(find, name):
    document, pointer = ABSENT[name]
    with pytest.raises(UnknownModel) as refused:
        performed(document, find)
    assert f"/{refused.value.field}" == pointer


def test_the_scripts_are_right_but_for_one_fault(find):
    for document in (bad_scripts.walk(), bad_scripts.reach(), bad_scripts.held()):
        assert performed(document, find).trust.frames > 1


def test_a_target_out_of_reach_is_missed_with_a_warning(find):
    answer = performed(bad_scripts.reach(targets=[bad_scripts.FAR]), find)
    told = {own.pointer: own.message for own in answer.trust.script_warnings}
    assert "out of reach" in told["/segments/0/targets/0"]


def test_what_is_behind_is_not_looked_at_and_a_warning_says_so(find):
    answer = performed(bad_scripts.held(look_at=[0.0, 1.5, -5.0]), find)
    told = {own.pointer: own.message for own in answer.trust.script_warnings}
    assert "degrees beside the point" in told["/segments/1/look_at"]


def test_too_many_frames_are_refused(find):
    question = json_decoding.decode_question(
        PerformanceQuestion, msgspec.json.encode(bad_scripts.walk())
    )
    with pytest.raises(InvalidField, match="61 frames at 30 a second, expected at most 60"):
        composition.perform(resolve_script(question, find), 60)
