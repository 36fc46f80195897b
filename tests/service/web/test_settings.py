"""Settings come from the environment, whole or not at all."""

import pytest

from service.motion.errors import InvalidField
from service.web import settings
from service.web.settings import Settings


def test_nothing_set_is_the_defaults():
    assert settings.read(environ={"PATH": "/bin"}) == Settings()


def test_each_setting_has_a_variable():
    given = {
        "POSEFIELD_HOST": "::1",
        "POSEFIELD_PORT": "9000",
        "POSEFIELD_BODY_LIMIT": "10",
        "POSEFIELD_CROWD_BODY_LIMIT": "30",
        "POSEFIELD_CROWD_LIMIT": "2",
        "POSEFIELD_GRACE": "0",
    }
    expected = Settings("::1", 9000, body_limit=10, crowd_body_limit=30, crowd_limit=2, grace=0)
    assert settings.read(environ=given) == expected


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("CROWD_LIMIT", "0"),
        ("CROWD_BODY_LIMIT", "-1"),
        ("PORT", "http"),
        ("PORT", "-1"),
        ("PORT", "65536"),
        ("BODY_LIMIT", "0"),
        ("GRACE", "1.5"),
    ],
)
def test_a_variable_that_cannot_be_used_is_named(name, text):
    with pytest.raises(InvalidField, match=f"POSEFIELD_{name}: .*expected"):
        settings.read(environ={f"POSEFIELD_{name}": text})


def test_the_command_line_wins():
    given = {"POSEFIELD_HOST": "::1", "POSEFIELD_PORT": "9000"}
    assert settings.read("0.0.0.0", 0, given) == Settings(host="0.0.0.0", port=0)
    assert settings.read(None, None, given) == Settings(host="::1", port=9000)
