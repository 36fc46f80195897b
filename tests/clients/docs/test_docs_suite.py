"""Tests of the page at `/docs` without a browser: its test suite, types, format and size."""

import gzip

import pytest

from posefield.http.pages import static_page

TOOLS = "../node_modules/.bin"
# Bytes that the page may weigh as it travels.
BUDGET = 400_000


@pytest.fixture
def assert_runs(in_package):
    return in_package("docs")


def test_its_own_tests_pass(assert_runs):
    said = assert_runs("sh", "-c", "node --test test/*.test.ts")
    assert "\nℹ fail 0\n" in said
    assert "\nℹ pass 0\n" not in said


def test_its_types_are_right(assert_runs):
    assert_runs(f"{TOOLS}/tsc", "--noEmit", "-p", ".")


def test_its_form_is_right(assert_runs):
    assert_runs(f"{TOOLS}/biome", "ci", ".")


def test_the_built_page_is_small():
    content = static_page.DOCS.read_bytes()
    assert len(gzip.compress(content, 6)) < BUDGET < len(content)


def test_the_licences_go_with_the_page():
    text = static_page.DOCS.with_name("LICENSES.txt").read_text()
    for part in ("swagger-ui", "Apache License", "dompurify", "react-dom", "immutable"):
        assert part in text
