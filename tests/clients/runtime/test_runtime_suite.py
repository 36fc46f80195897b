"""Tests of the run time in TypeScript against the service: all shipped models and levels."""

import re

import pytest
import runtime_answers

pytestmark = pytest.mark.system


@pytest.fixture
def assert_runs(in_package):
    return in_package("runtime")


def test_poses_and_clips_equal_those_of_the_service_in_node(tmp_path, assert_runs):
    answers = runtime_answers.write(tmp_path)
    said = assert_runs("npm", "test", POSEFIELD_ANSWERS=str(answers))
    assert re.search(r"ℹ pass [1-9]", said) and "\nℹ fail 0\n" in said
    assert "\nℹ skipped 0\n" in said
