"""Fixtures that several tests of found families share."""

import shutil

import pytest

FOUND_WORDS = ("--licence", "CC BY 4.0, by us", "--candidates", "60")
"""Options of the search whose recipes the tests share."""


@pytest.fixture(scope="session")
def recordings(tmp_path_factory):
    """Return a folder of four recordings of two performers."""
    import rigid_takes

    return rigid_takes.write_takes(tmp_path_factory.mktemp("recordings"))


@pytest.fixture(scope="session")
def made_once(tmp_path_factory):
    """Return the folder in which the recipes are made once."""
    return tmp_path_factory.mktemp("found") / "recipes"


@pytest.fixture
def made(posefield, recordings, made_once, tmp_path):
    """Return a copy of a folder of two or more found families with a stated licence."""
    if not made_once.exists():
        code, out, err = posefield("discover", recordings, "-o", made_once, *FOUND_WORDS)
        assert code == 0, err
        assert "families of 4 recordings" in out
    return shutil.copytree(made_once, tmp_path / "recipes")
