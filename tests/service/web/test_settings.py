"""Tests of settings from the environment: valid values, and errors."""

import pytest

from posefield.common.errors import InvalidField
from posefield.http.api import settings
from posefield.http.api.settings import Settings


def test_nothing_set_is_the_defaults():
    assert settings.read_settings(environ={"PATH": "/bin"}) == Settings()


def test_each_setting_has_a_variable():
    given = {
        "POSEFIELD_HOST": "::1",
        "POSEFIELD_PORT": "9000",
        "POSEFIELD_BODY_LIMIT": "10",
        "POSEFIELD_CROWD_BODY_LIMIT": "30",
        "POSEFIELD_CROWD_LIMIT": "2",
        "POSEFIELD_CLIPS_BODY_LIMIT": "40",
        "POSEFIELD_CLIPS_LIMIT": "3",
        "POSEFIELD_CLIPS_POSES": "50",
        "POSEFIELD_GRACE": "0",
        "POSEFIELD_OPEN": "1",
        "POSEFIELD_KEYS_FILE": "keys",
        "POSEFIELD_JWT_LEEWAY": "0",
        "POSEFIELD_DRAIN": "5",
        "POSEFIELD_WORKERS": "4",
        "POSEFIELD_RELOAD": "0",
        "POSEFIELD_VERSIONS": "7",
        "POSEFIELD_VERSIONS_MEMORY": "1000",
    }
    crowds = {"crowd_body_limit": 30, "crowd_limit": 2}
    clips = {"clips_body_limit": 40, "clips_limit": 3, "clips_poses": 50}
    ends = {"grace": 0, "drain": 5, "workers": 4}
    follows = {"reload": 0, "versions": 7, "versions_memory": 1000}
    access = {"open": True, "keys_file": "keys", "jwt_leeway": 0}
    others = {**crowds, **clips, **ends, **follows, **access}
    expected = Settings("::1", 9000, body_limit=10, **others)
    assert settings.read_settings(environ=given) == expected


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("CLIPS_POSES", "1e6"),
        ("PORT", "http"),
        ("PORT", "65536"),
        ("GRACE", "1.5"),
        ("DRAIN", "601"),
        ("VERSIONS_MEMORY", "64M"),
        ("OPEN", "yes"),
        ("JWT_LEEWAY", "-1"),
    ],
)
def test_a_variable_that_cannot_be_used_is_named(name, text):
    with pytest.raises(InvalidField, match=f"POSEFIELD_{name}: .*expected"):
        settings.read_settings(environ={f"POSEFIELD_{name}": text})


def test_the_command_line_wins():
    given = {"POSEFIELD_HOST": "::1", "POSEFIELD_PORT": "9000"}
    assert settings.read_settings("0.0.0.0", 0, given) == Settings(host="0.0.0.0", port=0)
    assert settings.read_settings(None, None, given) == Settings(host="::1", port=9000)
