"""Test of the size of the built page; `make typescript` runs its own tests."""

import gzip

from posefield.http import static_page

# Bytes that a page may weigh as it travels.
BUDGET = 250_000


def test_the_built_page_is_small():
    content = static_page.VIEWER.read_bytes()
    assert len(gzip.compress(content, 6)) < BUDGET < len(content)
