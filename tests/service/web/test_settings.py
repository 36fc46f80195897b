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
        "POSEFIELD_OPEN": "1",
        "POSEFIELD_KEYS_FILE": "keys",
        "POSEFIELD_JWT_LEEWAY": "0",
    }
    access = {"open": True, "keys_file": "keys", "jwt_leeway": 0}
    expected = Settings("::1", 9000, body_limit=10, **access)
    assert settings.read_settings(environ=given) == expected


@pytest.mark.parametrize(
    ("name", "text"), [("PORT", "65536"), ("GRACE", "1.5"), ("OPEN", "yes"), ("JWT_LEEWAY", "-1")]
)
def test_a_variable_that_cannot_be_used_is_named(name, text):
    with pytest.raises(InvalidField, match=f"POSEFIELD_{name}: .*expected"):
        settings.read_settings(environ={f"POSEFIELD_{name}": text})


def test_the_command_line_wins():
    given = {"POSEFIELD_HOST": "::1", "POSEFIELD_PORT": "9000"}
    assert settings.read_settings("0.0.0.0", 0, given) == Settings(host="0.0.0.0", port=0)
    assert settings.read_settings(None, None, given) == Settings(host="::1", port=9000)
