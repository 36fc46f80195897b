"""What of the page needs no browser: its own tests, its types, its form, and how large it is."""

import gzip

import pytest

from service.web.pages import viewer

TOOLS = "../node_modules/.bin"
# Bytes that a page may weigh as it travels.
BUDGET = 250_000


@pytest.fixture
def run(in_package):
    return in_package("viewer")


def test_its_own_tests_pass(run):
    said = run("sh", "-c", "node --test test/*.test.ts")
    assert "\nℹ fail 0\n" in said
    assert "\nℹ pass 0\n" not in said


def test_its_types_hold(run):
    run(f"{TOOLS}/tsc", "--noEmit", "-p", ".")


def test_its_form_holds(run):
    run(f"{TOOLS}/biome", "ci", ".")


def test_the_built_page_is_small():
    content = viewer.BUILT.read_bytes()
    assert len(gzip.compress(content, 6)) < BUDGET < len(content)
