"""Tests of access control: scopes of keys and tokens, visible models, refusals and audit log."""

import json
import logging
import subprocess
import sys
import time
from pathlib import Path

import jwt
import pytest
from asking import asker
from cryptography.hazmat.primitives.asymmetric import rsa

from posefield.common.errors import FileError, InvalidField
from posefield.http.access import api_keys
from posefield.http.api import contract
from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.registry.model_registry import ModelRegistry

SCOPES = {
    "every": ["read:*"],
    "reach": ["read:reach"],
    "gone": ["read:elsewhere"],
    "metrics": ["metrics"],
}


@pytest.fixture(scope="module")
def issued():
    return {name: api_keys.generate_key() for name in SCOPES}


@pytest.fixture(scope="module")
def lines(issued):
    return "\n".join(api_keys.key_line(name, SCOPES[name], key) for name, key in issued.items())


@pytest.fixture(scope="module")
def guarded(loaded, lines):
    """The service with keys."""
    return create_app(loaded, Settings(keys=lines))


@pytest.fixture(scope="module")
def signed(tmp_path_factory):
    """Settings that trust an issuer, and a token of it for some scope."""
    private = rsa.generate_private_key(65537, 2048)
    entry = json.loads(jwt.algorithms.RSAAlgorithm.to_jwk(private.public_key()))
    path = tmp_path_factory.mktemp("issuer") / "jwks.json"
    path.write_text(json.dumps({"keys": [{**entry, "kid": "one"}]}))
    trusted = {"jwt_keys": str(path), "jwt_issuer": "https://issuer", "jwt_audience": "posefield"}

    def token(scope, seconds=60, **changes):
        claims = {"iss": "https://issuer", "aud": "posefield", "exp": time.time() + seconds}
        return jwt.encode({**claims, "scope": scope, **changes}, private, "RS256", {"kid": "one"})

    return trusted, token


@pytest.fixture
def as_(guarded, issued):
    """Return a function that asks with a named key."""
    ask = asker(guarded)
    bearer = {name: {"Authorization": f"Bearer {key}"} for name, key in issued.items()}
    return lambda who, method, url, **content: ask(method, url, headers=bearer[who], **content)


def names(answer):
    return [model["name"] for model in answer.json()["models"]]


def test_a_key_reads_what_its_scopes_say(as_, controls):
    assert names(as_("every", "GET", "/v1/models")) == ["reach", "walk"]
    assert names(as_("reach", "GET", "/v1/models")) == ["reach"]
    assert names(as_("gone", "GET", "/v1/models")) == []
    asked = {"json": {"controls": controls, "times": [0]}}
    for who, status in (("every", 200), ("reach", 200), ("gone", 404)):
        assert as_(who, "POST", "/v1/models/reach/pose", **asked).status_code == status
    assert as_("every", "GET", "/v1/models/walk").status_code == 200
    assert as_("every", "HEAD", "/v1/models/walk").status_code == 200


def test_what_a_key_may_not_read_does_not_exist_for_it(as_, loaded):
    def heard(who, key):
        problem = as_(who, "GET", f"/v1/models/{key}").json()
        return {**problem, "instance": ""}

    identity = loaded.find("walk").identity
    for hidden in ("walk", identity, "walk@0000000000000000"):
        told = heard("reach", hidden)
        unknown = heard("reach", "nobody")
        assert told["status"] == 404
        assert json.dumps(told).replace(hidden, "X") == json.dumps(unknown).replace("nobody", "X")
    # Negative control: who may read it is told that there is one, and which.
    assert identity in heard("every", "walk@0000000000000000")["detail"]
    assert "walk" not in heard("reach", "reach@0000000000000000")["detail"]


def test_nobody_gets_in_without_a_key(guarded, issued, valid):
    ask = asker(guarded)
    key = issued["every"]
    wrong = [
        {},
        {"Authorization": ""},
        {"Authorization": key},
        {"Authorization": "Bearer"},
        {"Authorization": "Bearer "},
        {"Authorization": f"Basic {key}"},
        {"Authorization": f"Bearer {key}x"},
        {"Authorization": f"Bearer {key}, Bearer {key}"},
        {"Authorization": "Bearer \xff".encode("latin-1")},
        [("Authorization", f"Bearer {key}"), ("Authorization", f"Bearer {key}")],
        {"X-API-Key": key},
        {"Cookie": f"Authorization=Bearer {key}"},
    ]
    for headers in wrong:
        answer = ask("GET", "/v1/models", headers=headers)
        assert answer.status_code == 401, headers
        assert answer.headers["www-authenticate"].startswith('Bearer realm="posefield"')
        problem = answer.json()
        valid("Problem", problem)
        assert problem["type"] == "urn:posefield:problem:unauthenticated"
        assert key not in answer.text
    assert ask("GET", f"/v1/models?access_token={key}").status_code == 401
    assert ask("GET", "/v1/models", headers={"authorization": f"bearer {key}"}).status_code == 200


def test_every_operation_with_a_scope_refuses_who_is_unknown_and_who_lacks_it(guarded, as_):
    """401 and 403 are what the contract says of each, and of no other."""
    ask, tried = asker(guarded), 0
    for operation in contract.load_contract().operations:
        form = next(iter(operation.formats), "")
        path = operation.path.replace("{model}", "reach").replace("{format}", form)
        unknown = ask(operation.method, path).status_code
        if operation.scope is None:
            assert unknown == 200
            continue
        tried += 1
        assert unknown == 401, operation.id
        other = {"read": "metrics", "metrics": "every"}[operation.scope]
        lacking = as_(other, operation.method, path)
        assert lacking.status_code == 403, operation.id
        assert lacking.json()["type"] == "urn:posefield:problem:forbidden"
        assert 'error="insufficient_scope"' in lacking.headers["www-authenticate"]
    assert tried > 20


def test_a_token_reads_what_its_scopes_say(loaded, signed):
    trusted, token = signed
    ask = asker(create_app(loaded, Settings(**trusted)))

    def seen(scope, **more):
        headers = {"Authorization": f"Bearer {token(scope, **more)}"}
        return ask("GET", "/v1/models", headers=headers)

    assert names(seen("openid read:walk")) == ["walk"]
    assert seen("openid profile").status_code == 403
    late = seen("read:*", seconds=-100)
    assert late.status_code == 401 and "expired" in late.json()["detail"]


def test_each_refusal_is_one_line_without_secrets(guarded, as_, issued, caplog):
    ask = asker(guarded)
    with caplog.at_level(logging.INFO):
        wrong = {"Authorization": "Bearer pf_wrong-secret", "X-Request-Id": "r1"}
        ask("GET", "/v1/models/reach/pose?turn=secret-control", headers=wrong)
        as_("metrics", "GET", "/v1/models")
        as_("reach", "GET", "/v1/models/walk")
        as_("reach", "GET", "/v1/models/anna-from-accounts")
        as_("reach", "GET", "/v1/models/reach")
    said = [
        r.getMessage() for r in caplog.records if r.name == "posefield.http.access.access_control"
    ]
    path = "/v1/models/{model}"
    asked = {"audit": "refused", "method": "GET"}
    assert json.loads(said[0]) == {
        **asked,
        "status": 401,
        "request": "r1",
        "path": f"{path}/pose",
        "who": "nobody",
        "why": "no such key",
    }
    rest = [json.loads(line) for line in said[1:]]
    assert [(line["status"], line["path"], line["who"], line["why"]) for line in rest] == [
        (403, "/v1/models", "metrics", "has no scope read"),
        (404, path, "reach", "may not read model walk"),
        (404, path, "reach", "may not read model unknown"),
    ]
    everything = "\n".join(r.getMessage() for r in caplog.records if "httpx" not in r.name)
    for secret in ("wrong-secret", "secret-control", "anna", *issued.values()):
        assert secret not in everything


@pytest.mark.parametrize("host", ["0.0.0.0", "localhost.evil"])
def test_an_open_service_on_an_open_address_does_not_start(host, lines):
    with pytest.raises(InvalidField, match=r"POSEFIELD_HOST: .*POSEFIELD_OPEN=1"):
        create_app(ModelRegistry({}), Settings(host=host))
    assert create_app(ModelRegistry({}), Settings(host=host, open=True))
    assert create_app(ModelRegistry({}), Settings(host=host, keys=lines))


def test_a_file_without_keys_lets_nobody_start(tmp_path):
    empty = tmp_path / "keys"
    empty.write_text("# none yet\n")
    with pytest.raises(InvalidField, match="POSEFIELD_HOST"):
        create_app(ModelRegistry({}), Settings(host="0.0.0.0", keys_file=str(empty)))
    with pytest.raises(FileError, match="no file of keys"):
        create_app(ModelRegistry({}), Settings(keys_file=str(tmp_path / "nowhere")))


def test_an_algorithm_of_shared_secrets_is_refused(signed):
    for algorithm in ("HS256", "none", "rs256"):
        with pytest.raises(InvalidField, match="POSEFIELD_JWT_ALGORITHM"):
            create_app(ModelRegistry({}), Settings(**signed[0], jwt_algorithm=algorithm))


@pytest.mark.system
def test_the_command_makes_a_key_whose_line_lets_it_in(loaded, tmp_path):
    posefield = Path(sys.executable).with_name("posefield")
    command = [posefield, "key", "blender", "--model", "walk", "--metrics"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    file, key = tmp_path / "keys", done.stderr.split()[-1]
    file.write_text(done.stdout)
    assert key not in done.stdout and done.stdout.endswith(" read:walk metrics\n")
    ask = asker(create_app(loaded, Settings(keys_file=str(file))))
    answer = ask("GET", "/v1/models", headers={"Authorization": f"Bearer {key}"})
    assert names(answer) == ["walk"]
    told = subprocess.run([*command, "--json"], capture_output=True, text=True, check=True)
    made = json.loads(told.stdout)
    assert api_keys.parse_keys(made["line"], "KEYS").find(made["key"]).name == "blender"
