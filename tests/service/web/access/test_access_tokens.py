"""Tokens: a good one is let in, and each thing that can be wrong with one keeps it out."""

import base64
import contextlib
import http.server
import json
import threading
import time

import jwt
import pytest
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec, rsa

from service.motion.errors import FileError
from service.web.access import keyset, policy, tokens
from service.web.access.keyset import KeySet
from service.web.access.policy import Rejected
from service.web.access.tokens import Terms, Tokens

TERMS = Terms("https://issuer", "posefield", "RS256", leeway=0, scopes="scope")


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
    return Tokens(TERMS, KeySet(str(source), "RS256", 300))


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
        ({"exp": 1000}, "expired"),
        ({"nbf": 9e9}, "not valid yet"),
        ({"iss": "https://other"}, "of another issuer"),
        ({"aud": "other"}, "meant for another audience"),
        ({"exp": None}, "without one of exp, iss, aud"),
        ({"iss": None}, "without one of exp, iss, aud"),
        ({"aud": None}, "without one of exp, iss, aud"),
        ({"exp": "soon"}, "not a token that can be verified"),
        ({"exp": 1e999}, "not a token that can be verified"),
        ({"kid": "two"}, "signed by a key that is not known"),
        ({"kid": "two", "headers": {"kid": "one"}}, "its signature is wrong"),
        ({"algorithm": "RS512"}, "signed by another algorithm"),
        ({"algorithm": "PS256"}, "signed by another algorithm"),
        ({"headers": {"crit": ["exp"]}}, "not a token that can be verified"),
    ],
)
def test_what_is_wrong_with_a_token_keeps_it_out(changes, why, checker, token):
    with pytest.raises(Rejected, match=why):
        checker.find(token(**changes))


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
    for given in tokens_:
        with pytest.raises(Rejected):
            checker.find(given)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a",
        "a.b.c",
        "....",
        "\x00.\xff.é",
        base64.urlsafe_b64encode(b"[" * 12_000).decode() + ".e30.x",
        forged({"alg": "RS256", "kid": 7}, {}),
        forged({"alg": "RS256", "kid": None}, []),
    ],
)
def test_rubbish_is_rejected_and_nothing_worse(text, checker):
    with pytest.raises(Rejected):
        checker.find(text)


def test_no_address_in_a_token_is_asked(checker, token, listener):
    url, asked = listener
    with pytest.raises(Rejected):
        checker.find(token(kid="two", headers={"jku": url, "x5u": url, "kid": url}))
    checker.keys.look()
    assert asked == []


def test_without_an_id_the_only_key_is_meant(checker, pairs):
    claims = {"iss": "https://issuer", "aud": "posefield", "exp": time.time() + 60}
    assert checker.find(jwt.encode(claims, pairs["one"][0], "RS256"))
    with pytest.raises(Rejected):
        checker.find(jwt.encode(claims, pairs["two"][0], "RS256"))


def test_a_token_is_verified_once_and_only_until_it_ends(checker, token, monkeypatch):
    verified = []
    whole = jwt.decode
    monkeypatch.setattr(jwt, "decode", lambda *a, **k: verified.append(1) or whole(*a, **k))
    given = token(exp=time.time() + 1)
    assert checker.find(given) is checker.find(given)
    assert len(verified) == 1
    time.sleep(1.1)
    with pytest.raises(Rejected, match="expired"):
        checker.find(given)
    assert len(verified) == 2


def test_no_more_tokens_are_remembered_than_said(checker, token, monkeypatch):
    monkeypatch.setattr(tokens, "CACHED", 3)
    for index in range(6):
        checker.find(token(jti=str(index)))
    assert len(checker._good) == 3
    with pytest.raises(Rejected):
        checker.find("rubbish")
    assert len(checker._good) == 3


def test_a_key_that_goes_takes_its_tokens_with_it(checker, token, source, pairs):
    given = token()
    checker.find(given)
    source.write_text(json.dumps({"keys": [pairs["two"][1]]}))
    checker.keys.look()
    with pytest.raises(Rejected, match="not known"):
        checker.find(given)
    assert checker.find(token(kid="two"))


def test_a_source_that_breaks_leaves_the_keys_there_were(checker, token, source, caplog):
    source.write_text("{")
    checker.keys.look()
    assert checker.find(token())
    assert "the keys stay as they are" in caplog.text


def test_a_new_key_is_looked_for_soon(source, token, pairs, monkeypatch):
    monkeypatch.setattr(keyset, "HURRY", 0.01)
    watched = KeySet(str(source), "RS256", 300)
    watched.start()
    checker = Tokens(TERMS, watched)
    source.write_text(json.dumps({"keys": [pairs["one"][1], pairs["two"][1]]}))
    with pytest.raises(Rejected, match="not known"):
        checker.find(token(kid="two"))
    until = time.monotonic() + 10
    while "two" not in watched.keys and time.monotonic() < until:
        time.sleep(0.01)
    assert checker.find(token(kid="two"))


@pytest.fixture
def listener(pairs):
    """A server on this machine with a JWKS at /keys and a redirect to it, and what it was asked."""
    asked = []

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            asked.append(self.path)
            content = {
                "/keys": json.dumps({"keys": [pairs["one"][1]]}).encode(),
                "/large": b" " * (keyset.LIMIT + 1),
            }.get(self.path)
            self.send_response(302 if content is None else 200)
            self.send_header("Location", "/keys")
            self.end_headers()
            self.wfile.write(content or b"")

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}", asked
    server.shutdown()
    thread.join()
    server.server_close()


def test_keys_come_from_an_address(listener):
    url, asked = listener
    assert set(keyset.load(f"{url}/keys", "RS256")) == {"one"}
    assert asked == ["/keys"]


@pytest.mark.parametrize(
    ("path", "why"), [("/moved", "302"), ("/large", f"more than {keyset.LIMIT} bytes")]
)
def test_an_address_that_leads_elsewhere_or_nowhere_is_refused(path, why, listener):
    url, asked = listener
    with pytest.raises(FileError, match=why):
        keyset.load(url + path, "RS256")
    assert asked == [path]


@pytest.mark.parametrize(
    "source", ["http://issuer/keys", "file:///etc/passwd", "ftp://127.0.0.1/keys", "/nowhere"]
)
def test_other_sources_are_refused(source):
    with pytest.raises(FileError, match=source):
        keyset.load(source, "RS256")


def test_keys_of_other_kinds_are_left_out(pairs, tmp_path):
    path = tmp_path / "mixed.json"
    curve = ec.generate_private_key(ec.SECP256R1()).public_key()
    elliptic = {**json.loads(jwt.algorithms.ECAlgorithm.to_jwk(curve)), "kid": "curve"}
    shared = {"kty": "oct", "k": "c2VjcmV0", "kid": "shared"}
    encrypting = {**pairs["two"][1], "use": "enc"}
    other = {**pairs["two"][1], "alg": "RS512", "kid": "other"}
    path.write_text(json.dumps({"keys": [elliptic, shared, encrypting, other, pairs["one"][1]]}))
    assert set(keyset.load(str(path), "RS256")) == {"one"}
    assert set(keyset.load(str(path), "ES256")) == {"curve"}
    with pytest.raises(FileError, match="no public key for EdDSA"):
        keyset.load(str(path), "EdDSA")


@pytest.mark.parametrize("content", ["{}", "[]", "3", '{"keys": 3}', '{"keys": [3]}', "\xff"])
def test_what_is_no_key_set_is_refused(content, tmp_path):
    path = tmp_path / "jwks.json"
    path.write_text(content, "latin-1")
    with pytest.raises(FileError, match="no key set"):
        keyset.load(str(path), "RS256")


def test_only_public_algorithms_can_be_chosen():
    assert not any(name.startswith("HS") or name == "none" for name in policy.ALGORITHMS)
