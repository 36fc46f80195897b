"""Tests of bearer tokens: valid ones are accepted, each kind of invalid one is refused."""

import base64
import contextlib
import http.server
import json
import re
import threading
import time

import jwt
import pytest
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from hypothesis import given, settings
from hypothesis import strategies as st

from posefield.common.errors import FileError
from posefield.http.access.api_keys import InvalidCredentials
from posefield.http.access.bearer_tokens import LATEST_TIME, KeySet, TokenVerifier
from posefield.http.api.settings import Settings

UNREADABLE = "not a token that can be verified"
SETTINGS = Settings(jwt_issuer="https://issuer", jwt_audience="posefield", jwt_leeway=0)


def pair(kid):
    """A private key and its public half as an entry of a JWKS."""
    private = rsa.generate_private_key(65537, 2048)
    entry = json.loads(jwt.algorithms.RSAAlgorithm.to_jwk(private.public_key()))
    return private, {**entry, "kid": kid, "use": "sig"}


@pytest.fixture(scope="module")
def pairs():
    return {kid: pair(kid) for kid in ("one", "two")}


@pytest.fixture
def source(pairs, tmp_path):
    path = tmp_path / "jwks.json"
    path.write_text(json.dumps({"keys": [pairs["one"][1]]}))
    return path


@pytest.fixture
def checker(source):
    return TokenVerifier(SETTINGS, KeySet(str(source), "RS256"))


@pytest.fixture(scope="module")
def signing(pairs, tmp_path_factory):
    """Tokens whose key stays, and that key."""
    path = tmp_path_factory.mktemp("issuer") / "jwks.json"
    path.write_text(json.dumps({"keys": [pairs["one"][1]]}))
    return TokenVerifier(SETTINGS, KeySet(str(path), "RS256")), pairs["one"][0]


@pytest.fixture
def token(pairs):
    """A token that is good but for what is changed."""

    def of(kid="one", algorithm="RS256", headers=None, **changes):
        claims = {
            "iss": "https://issuer",
            "aud": "posefield",
            "sub": "anna@example.com",
            "exp": time.time() + 60,
            "scope": "openid read:reach metrics",
            **changes,
        }
        claims = {name: value for name, value in claims.items() if value is not None}
        key = pairs[kid][0]
        return jwt.encode(claims, key, algorithm, {"kid": kid, **(headers or {})})

    return of


def test_a_good_token_is_let_in_with_its_scopes(checker, token):
    known = checker.find(token())
    assert (known.models, known.metrics) == (frozenset({"reach"}), True)
    assert checker.find(token(scope=["read:*"])).models is None
    assert checker.find(token(scope=None)).models == frozenset()
    assert checker.find(token(aud=["other", "posefield"])).may_read("reach")


def test_the_log_gets_a_pseudonym_that_stays(checker, token):
    first, second = checker.find(token()), checker.find(token(scope="read:*"))
    assert first.name == second.name != checker.find(token(sub="bert")).name
    assert "anna" not in first.name


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"exp": time.time() - 100}, "expired"),
        ({"iss": "https://other"}, "of another issuer"),
        ({"aud": "other"}, "meant for another audience"),
        ({"exp": None}, "without one of exp, iss, aud"),
        ({"exp": 10**400}, UNREADABLE),
        ({"exp": LATEST_TIME + 1}, UNREADABLE),
        ({"sub": "\ud800"}, UNREADABLE),
        ({"kid": "two"}, "signed by a key that is not known"),
        ({"kid": "two", "headers": {"kid": "one"}}, "its signature is wrong"),
        ({"algorithm": "RS512"}, "signed by another algorithm"),
    ],
)
def test_what_is_wrong_with_a_token_keeps_it_out(changes, why, checker, token):
    with pytest.raises(InvalidCredentials, match=why):
        checker.find(token(**changes))


NUMBERS = st.integers() | st.floats() | st.sampled_from([10**400, -(10**400), LATEST_TIME])
VALUES = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.text(st.characters(), max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=6,
)


@given(
    changes=st.dictionaries(
        st.sampled_from(["exp", "nbf", "iat", "sub", "jti", "scope", "aud", "iss"]), VALUES
    )
)
@settings(max_examples=150, deadline=None)
def test_whatever_was_signed_is_let_in_or_rejected(changes, signing):
    checker, key = signing
    claims = {"iss": "https://issuer", "aud": "posefield", "exp": time.time() + 60, **changes}
    text = json.dumps(claims).encode()
    with contextlib.suppress(InvalidCredentials):
        assert checker.find(jwt.PyJWS().encode(text, key, "RS256", {"kid": "one"}))


def forged(header, claims, signature=b""):
    parts = (json.dumps(header).encode(), json.dumps(claims).encode(), signature)
    return ".".join(base64.urlsafe_b64encode(part).rstrip(b"=").decode() for part in parts)


def test_a_token_cannot_choose_how_it_is_checked(checker, pairs):
    claims = {"iss": "https://issuer", "aud": "posefield", "exp": time.time() + 60}
    public = pairs["one"][0].public_key()
    form = serialization.PublicFormat.SubjectPublicKeyInfo
    text = public.public_bytes(serialization.Encoding.PEM, form)
    signer = jwt.algorithms.HMACAlgorithm(jwt.algorithms.HMACAlgorithm.SHA256)
    tokens_ = [forged({"alg": "none", "kid": "one"}, claims)]
    body = forged({"alg": "HS256", "kid": "one"}, claims)[:-1].encode()
    # The old trick: the public key taken for a shared secret.
    with contextlib.suppress(jwt.InvalidKeyError):
        signature = signer.sign(body, text)
        tokens_.append(body.decode() + "." + base64.urlsafe_b64encode(signature).decode())
    for each in tokens_:
        with pytest.raises(InvalidCredentials):
            checker.find(each)


def test_rubbish_is_rejected_and_nothing_worse(checker):
    deep = base64.urlsafe_b64encode(b"[" * 12_000).decode() + ".e30.x"
    for text in ("\x00.\xff.é", deep, forged({"alg": "RS256", "kid": 7}, {})):
        with pytest.raises(InvalidCredentials):
            checker.find(text)


def test_no_address_in_a_token_is_asked(checker, token, listener):
    url, asked = listener
    with pytest.raises(InvalidCredentials):
        checker.find(token(kid="two", headers={"jku": url, "x5u": url, "kid": url}))
    checker.keys.refresh()
    assert asked == []


def test_a_key_that_goes_takes_its_tokens_with_it(checker, token, source, pairs):
    given = token()
    checker.find(given)
    source.write_text(json.dumps({"keys": [pairs["two"][1]]}))
    checker.keys.refresh()
    with pytest.raises(InvalidCredentials, match="not known"):
        checker.find(given)
    assert checker.find(token(kid="two"))


def test_a_source_that_breaks_leaves_the_keys_there_were(checker, token, source, caplog):
    source.write_text("{")
    checker.keys.refresh()
    assert checker.find(token())
    assert "the keys stay as they are" in caplog.text


def watched(source, cooldown, seconds=300):
    """Tokens whose keys are read again from now on."""
    keys = KeySet(str(source), "RS256")
    threading.Thread(target=keys.watch, args=(seconds, cooldown), daemon=True).start()
    return TokenVerifier(SETTINGS, keys)


def assert_soon(is_so):
    until = time.monotonic() + 20
    while not is_so():
        assert time.monotonic() < until
        time.sleep(0.01)


def test_a_new_key_is_read_soon_after_it_was_asked_for(source, token, pairs):
    checker = watched(source, cooldown=0.01)
    source.write_text(json.dumps({"keys": [pairs["one"][1], pairs["two"][1]]}))
    with pytest.raises(InvalidCredentials, match="not known"):
        checker.find(token(kid="two"))
    assert_soon(lambda: "two" in checker.keys.keys)
    assert checker.find(token(kid="two"))


def test_unknown_keys_make_no_more_fetches_than_the_cooldown_allows(token, listener):
    url, asked = listener
    checker = watched(f"{url}/keys", cooldown=60)
    for index in range(100):
        with pytest.raises(InvalidCredentials, match="not known"):
            checker.find(token(headers={"kid": f"unknown-{index}"}))
    assert asked == ["/keys"]
    # Negative control: with a short one, an unknown key leads to a fetch.
    hasty = watched(f"{url}/keys", cooldown=0.01)
    with pytest.raises(InvalidCredentials, match="not known"):
        hasty.find(token(kid="two"))
    assert_soon(lambda: len(asked) >= 3)


def test_no_token_waits_for_the_issuer(token, listener):
    """While the issuer lets a fetch hang, known keys let in and unknown ones are refused."""
    url, asked = listener
    checker = watched(f"{url}/keys", cooldown=0.01)
    checker.keys.source = f"{url}/hanging"
    with pytest.raises(InvalidCredentials, match="not known"):
        checker.find(token(kid="two"))
    assert_soon(lambda: "/hanging" in asked)
    assert checker.find(token())
    with pytest.raises(InvalidCredentials, match="not known"):
        checker.find(token(kid="two"))


def serve(pairs, released=None):
    """A server on this machine, in a thread, and the paths that it was asked for.

    /keys is a JWKS, /hanging waits until released, all others redirect to /keys.
    """
    asked = []

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            asked.append(self.path)
            if self.path == "/hanging":
                released.wait(60)
            self.send_response(200 if self.path == "/keys" else 302)
            self.send_header("Location", "/keys")
            self.end_headers()
            if self.path == "/keys":
                self.wfile.write(json.dumps({"keys": [pairs["one"][1]]}).encode())

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever).start()
    return server, asked


@pytest.fixture
def listener(pairs):
    """The address of such a server, and what it was asked for."""
    released = threading.Event()
    server, asked = serve(pairs, released)
    yield f"http://127.0.0.1:{server.server_port}", asked
    released.set()
    server.shutdown()
    server.server_close()


def test_a_redirect_is_refused(listener):
    url, asked = listener
    with pytest.raises(FileError, match="302"):
        KeySet(f"{url}/moved", "RS256")
    assert asked == ["/moved"]


@pytest.mark.parametrize(
    "source", ["http://127.0.0.1.issuer/keys", "file:///etc/passwd", "/nowhere"]
)
def test_other_sources_are_refused(source):
    with pytest.raises(FileError, match=re.escape(source)):
        KeySet(source, "RS256")


def test_keys_of_other_kinds_are_left_out(pairs, tmp_path):
    path = tmp_path / "mixed.json"
    curve = ec.generate_private_key(ec.SECP256R1()).public_key()
    elliptic = {**json.loads(jwt.algorithms.ECAlgorithm.to_jwk(curve)), "kid": "curve"}
    shared = {"kty": "oct", "k": "c2VjcmV0", "kid": "shared"}
    encrypting = {**pairs["two"][1], "use": "enc"}
    other = {**pairs["two"][1], "alg": "RS512", "kid": "other"}
    path.write_text(json.dumps({"keys": [elliptic, shared, encrypting, other, pairs["one"][1]]}))
    assert set(KeySet(str(path), "RS256").keys) == {"one"}
    assert set(KeySet(str(path), "ES256").keys) == {"curve"}
    with pytest.raises(FileError, match="no public key for EdDSA"):
        KeySet(str(path), "EdDSA")


@pytest.mark.parametrize("content", ["{}", '{"keys": [3]}', "\xff", "[" * 10_000])
def test_what_is_no_key_set_is_refused(content, tmp_path):
    path = tmp_path / "jwks.json"
    path.write_text(content, "latin-1")
    with pytest.raises(FileError, match="no key set"):
        KeySet(str(path), "RS256")
