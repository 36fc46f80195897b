"""Fixtures of the contract's tests: a service with the small model `reach`, and clients."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from asking import Ask, asker
from starlette.types import ASGIApp

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.registry import model_registry
from posefield.registry.model_registry import ModelRegistry

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def loaded(models) -> ModelRegistry:
    return model_registry.load([models])


@pytest.fixture(scope="session")
def app(loaded) -> ASGIApp:
    return create_app(loaded, Settings())


@pytest.fixture(scope="session")
def ask(app) -> Ask:
    """Ask the app in this process, as an HTTP client would."""
    return asker(app)


@pytest.fixture(scope="session")
def controls(loaded) -> dict[str, float]:
    """Controls in the middle of what was sampled."""
    card = loaded.find("reach").session.card
    return {control.name: control.default for control in card.controls}


@pytest.fixture(scope="session")
def spec() -> dict[str, Any]:
    return yaml.safe_load((ROOT / "api/openapi.yaml").read_bytes())


@pytest.fixture(scope="session")
def valid(spec) -> Callable[[str, Any], None]:
    """Validate a value by a schema of the contract."""

    def check(name: str, value: Any) -> None:
        schema = {"$ref": f"#/components/schemas/{name}", "components": spec["components"]}
        jsonschema.Draft202012Validator(schema).validate(value)

    return check
