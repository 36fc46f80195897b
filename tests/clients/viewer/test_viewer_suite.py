"""Tests of the viewer without a browser: its test suite, types, format and size."""

import gzip

import pytest

from posefield.http.pages import static_page

TOOLS = "../node_modules/.bin"
# Bytes that a page may weigh as it travels.
BUDGET = 250_000


@pytest.fixture
def assert_runs(in_package):
    return in_package("viewer")


def test_its_own_tests_pass(assert_runs):
    said = assert_runs("sh", "-c", "node --test test/*.test.ts")
    assert "\nℹ fail 0\n" in said
    assert "\nℹ pass 0\n" not in said


def test_its_types_hold(assert_runs):
    assert_runs(f"{TOOLS}/tsc", "--noEmit", "-p", ".")


def test_its_form_holds(assert_runs):
    assert_runs(f"{TOOLS}/biome", "ci", ".")


def test_the_built_page_is_small():
    content = static_page.VIEWER.read_bytes()
    assert len(gzip.compress(content, 6)) < BUDGET < len(content)
