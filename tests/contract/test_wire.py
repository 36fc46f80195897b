"""Raw bytes on a socket of the real process: what is no HTTP, too much, too slow or too many."""

import json
import socket
import threading
import time
from urllib.parse import urlencode

import jsonschema
import pytest
from asking import exchange, process, read_answer

HOST = b"Host: x\r\n"
LIVE = b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n"
POST = b"POST /v1/models/reach/pose HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
QUICK = {"HEAD_TIME": 1, "BODY_TIME": 1, "IDLE_TIME": 2, "DRAIN_TIME": 1, "CONNECTIONS": 8}


@pytest.fixture(scope="module")
def place(models):
    """Host and port of a service with its usual limits."""
    with process(models) as served:
        yield served.place
        served.expect_silence()


@pytest.fixture(scope="module")
def hasty(models):
    """Host and port of a service that waits for nobody and has eight connections."""
    given = {f"POSEFIELD_{name}": str(value) for name, value in QUICK.items()}
    with process(models, **given) as served:
        yield served.place


@pytest.fixture
def refused(spec):
    """Hold an answer against the one shape of errors."""
    schema = {"$ref": "#/components/schemas/Problem", "components": spec["components"]}

    def of(answer, status, kind):
        assert answer.status == status, answer
        problem = json.loads(answer.body)
        jsonschema.validate(problem, schema, jsonschema.Draft202012Validator)
        assert problem["type"] == f"urn:posefield:problem:{kind}"
        assert problem["status"] == status
        assert problem["instance"] == answer.headers["x-request-id"]
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["connection"] == "close"
        return problem

    return of


MALFORMED = {
    "no method": b"/livez\r\n\r\n",
    "unknown method": b"FROB / HTTP/1.1\r\nHost: x\r\n\r\n",
    "tls": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
    "http/2": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    "http/0.9": b"GET /livez\r\n\r\n",
    "http/1.2": b"GET /livez HTTP/1.2\r\nHost: x\r\n\r\n",
    "bare line feeds": b"GET /livez HTTP/1.1\nHost: x\n\n",
    "bare carriage return": b"GET /livez HTTP/1.1\r\nHost: x\rA: b\r\n\r\n",
    "null in path": b"GET /liv\x00ez HTTP/1.1\r\nHost: x\r\n\r\n",
    "null in query": b"GET /livez?a=\x00 HTTP/1.1\r\nHost: x\r\n\r\n",
    "null in header": b"GET /livez HTTP/1.1\r\nHost: x\r\nA: \x00\r\n\r\n",
    "raw utf-8 in path": b"GET /\xc3\xa9 HTTP/1.1\r\nHost: x\r\n\r\n",
    "space in path": b"GET /a b HTTP/1.1\r\nHost: x\r\n\r\n",
    "no host": b"GET /livez HTTP/1.1\r\n\r\n",
    "two hosts": b"GET /livez HTTP/1.1\r\nHost: x\r\nHost: y\r\n\r\n",
    "space before colon": b"GET /livez HTTP/1.1\r\nHost : x\r\n\r\n",
    "folded header": b"GET /livez HTTP/1.1\r\nHost: x\r\n y\r\n\r\n",
    "header without name": b"GET /livez HTTP/1.1\r\nHost: x\r\n: y\r\n\r\n",
    "path without host": b"GET http:// HTTP/1.1\r\nHost: x\r\n\r\n",
    "connect": b"CONNECT x:443 HTTP/1.1\r\nHost: x\r\n\r\n",
    "length and coding": POST + b"Content-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    "coding and length": POST + b"Transfer-Encoding: chunked\r\nContent-Length: 4\r\n\r\n0\r\n\r\n",
    "two lengths": POST + b"Content-Length: 2\r\nContent-Length: 3\r\n\r\n{}",
    "length twice": POST + b"Content-Length: 2\r\nContent-Length: 2\r\n\r\n{}",
    "list of lengths": POST + b"Content-Length: 2, 2\r\n\r\n{}",
    "signed length": POST + b"Content-Length: +2\r\n\r\n{}",
    "negative length": POST + b"Content-Length: -2\r\n\r\n{}",
    "endless length": POST + b"Content-Length: " + b"9" * 40 + b"\r\n\r\n",
    "unknown coding": POST + b"Transfer-Encoding: xchunked\r\n\r\n0\r\n\r\n",
    "chunked not last": POST + b"Transfer-Encoding: chunked, identity\r\n\r\n0\r\n\r\n",
    "chunked not first": POST + b"Transfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n",
    "two codings": POST
    + b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    "coding in http/1.0": POST.replace(b"/1.1", b"/1.0")
    + b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    "chunk without size": POST + b"Transfer-Encoding: chunked\r\n\r\nx\r\n",
    "endless chunk size": POST + b"Transfer-Encoding: chunked\r\n\r\n" + b"f" * 30 + b"\r\n",
    "chunk with bare line feed": POST + b"Transfer-Encoding: chunked\r\n\r\n1\nx\r\n0\r\n\r\n",
}


@pytest.mark.parametrize("name", MALFORMED)
def test_what_is_no_http_is_refused_in_the_one_shape(name, place, refused):
    (answer,) = exchange(place, MALFORMED[name])
    refused(answer, 400, "malformed-request")


@pytest.mark.parametrize("size", [1, 7])
@pytest.mark.parametrize("name", ["null in path", "two hosts", "length and coding", "connect"])
def test_it_is_refused_however_it_is_cut(name, size, place, refused):
    (answer,) = exchange(place, MALFORMED[name], size=size)
    refused(answer, 400, "malformed-request")


STRANGE_BUT_RIGHT = {
    "absolute url": b"GET http://elsewhere/livez HTTP/1.1\r\nHost: x\r\n\r\n",
    "empty lines first": b"\r\n\r\n" + LIVE,
    "http/1.0 without host": b"GET /livez HTTP/1.0\r\n\r\n",
    "strange host": b"GET /livez HTTP/1.1\r\nHost: [\r\n\r\n",
    "empty header": b"GET /livez HTTP/1.1\r\nHost: x\r\nA:\r\n\r\n",
    "websocket": b"GET /livez HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\n"
    b"Upgrade: websocket\r\n\r\n",
    "http/2 in the clear": b"GET /livez HTTP/1.1\r\nHost: x\r\nUpgrade: h2c\r\n"
    b"Connection: Upgrade, HTTP2-Settings\r\nHTTP2-Settings: AAMAAABkAARAAAAAAAIAAAAA\r\n\r\n",
}


@pytest.mark.parametrize("name", STRANGE_BUT_RIGHT)
def test_what_only_looks_strange_is_answered(name, place):
    (answer,) = exchange(place, STRANGE_BUT_RIGHT[name])
    assert answer.status == 200


@pytest.mark.parametrize("path", ["%00", "%ff", "%", "%zz", "%c3%28", "%2e%2e%2f", "%ed%a0%80"])
def test_strange_escapes_are_no_failure(path, place):
    for url, status in [(f"/v1/models/{path}", 404), (f"/{path}", 404), (f"/livez?{path}", 400)]:
        (answer,) = exchange(place, f"GET {url} HTTP/1.1\r\nHost: x\r\n\r\n".encode())
        assert answer.status == status, answer
        assert answer.headers["content-type"] == "application/problem+json"


def test_a_body_that_comes_with_an_upgrade_is_read(place, controls):
    """What Java's client sends first: RFC 9110, 7.8 lets a server go on in HTTP/1.1."""
    body = json.dumps({"controls": controls, "times": [0]}).encode()
    upgrade = b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AA\r\n"
    length = b"Content-Length: %d\r\n\r\n" % len(body)
    for size in (1 << 16, 1, 50):
        answers = exchange(place, POST + upgrade + length + body + LIVE, size=size, answers=2)
        assert [a.status for a in answers] == [200, 200]
        assert json.loads(answers[0].body)["times"] == [0]


def test_a_request_id_is_kept_by_what_could_not_be_read(place):
    given = b"GET /livez HTTP/1.1\r\nX-Request-Id: mine\r\nHost: x\r\nHost: y\r\n\r\n"
    (answer,) = exchange(place, given)
    assert answer.headers["x-request-id"] == "mine"


# Too much ------------------------------------------------------------


@pytest.mark.parametrize("size", [1 << 16, 1000])
def test_a_url_has_a_length(size, place, refused):
    def asked(length):
        url = b"/livez?" + b"a" * (length - 7)
        return exchange(place, b"GET " + url + b" HTTP/1.1\r\nHost: x\r\n\r\n", size=size)

    (answer,) = asked(8193)
    refused(answer, 414, "url-too-long")
    (answer,) = asked(100_000)
    refused(answer, 414, "url-too-long")
    (answer,) = asked(8192)
    assert answer.status == 400 and b"no such query parameter" in answer.body


@pytest.mark.parametrize("size", [1 << 16, 1000])
def test_a_head_has_a_size(size, place, refused):
    def asked(length):
        fill = b"A: " + b"a" * (length - 5 - 9) + b"\r\n"
        return exchange(place, b"GET /livez HTTP/1.1\r\n" + HOST + fill + b"\r\n", size=size)

    for length in (16 * 1024 + 1, 200_000):
        (answer,) = asked(length)
        refused(answer, 431, "head-too-large")
    (answer,) = asked(16 * 1024)
    assert answer.status == 200


def test_a_head_has_so_many_lines(place, refused):
    def asked(count):
        lines = b"A: b\r\n" * (count - 1)
        return exchange(place, b"GET /livez HTTP/1.1\r\n" + HOST + lines + b"\r\n")

    (answer,) = asked(101)
    refused(answer, 431, "head-too-large")
    (answer,) = asked(100)
    assert answer.status == 200


@pytest.mark.parametrize(
    "rest",
    [
        b"1;" + b"x" * 200_000,
        b"0\r\n" + b"A: b\r\n" * 40_000,
        b"0\r\nA: " + b"b" * 200_000,
    ],
    ids=["chunk extension", "trailers", "trailer"],
)
def test_what_surrounds_a_chunked_body_has_a_size(rest, place, refused):
    (answer,) = exchange(place, POST + b"Transfer-Encoding: chunked\r\n\r\n" + rest)
    refused(answer, 400, "malformed-request")


def test_chunks_of_one_byte_are_read(place, controls):
    body = json.dumps({"controls": controls, "times": [0] * 9000}).encode()
    chunks = b"".join(b"1\r\n%c\r\n" % byte for byte in body) + b"0\r\n\r\n"
    (answer,) = exchange(place, POST + b"Transfer-Encoding: chunked\r\n\r\n" + chunks)
    assert answer.status == 200


def test_a_trailer_is_no_header(models):
    """It comes after whoever guards the door, a proxy for one, has looked at the headers."""
    line = f"a {'0' * 64} read:*"
    with process(models, POSEFIELD_KEYS=line) as served:
        head = POST + b"Transfer-Encoding: chunked\r\nX-Request-Id: first\r\n\r\n"
        chunks = b"2\r\n{}\r\n0\r\nX-Request-Id: second\r\nAuthorization: Bearer pf_x\r\n\r\n"
        (answer,) = exchange(served.place, head + chunks)
        assert answer.headers["x-request-id"] == "first"
        assert answer.headers["www-authenticate"] == 'Bearer realm="posefield"'


def test_an_absurd_length_is_not_waited_for(place, refused):
    (answer,) = exchange(place, POST + b"Content-Length: 9000000000000\r\n\r\n{")
    assert answer.status == 413
    (answer,) = exchange(
        place, b"GET /livez HTTP/1.1\r\nHost: x\r\nContent-Length: 9000000000\r\n\r\n{"
    )
    assert answer.status == 200


def test_a_refused_sender_hears_why_though_it_goes_on_sending(place):
    """The socket is not closed on what is still coming: that would reset the connection."""
    with socket.create_connection(place, timeout=20) as wire:
        wire.sendall(POST + b"Content-Length: 900000000\r\n\r\n")
        sent = 0
        for _ in range(40):
            wire.sendall(b" " * 65536)
            sent += 65536
        assert read_answer(wire.makefile("rb")).status == 413


# In turn ------------------------------------------------------------


def test_requests_ahead_are_answered_in_turn(place, controls):
    clip = urlencode({**controls, "fps": 500})
    asked = [
        f"GET /v1/models/reach/clip.usda?{clip} HTTP/1.1\r\nHost: x\r\n\r\n".encode(),
        LIVE,
        b"GET /nowhere HTTP/1.1\r\nHost: x\r\n\r\n",
        POST + b"Content-Length: 2\r\n\r\n{}",
    ]
    answers = exchange(place, b"".join(asked * 5), answers=20)
    assert [a.status for a in answers] == [200, 200, 404, 400] * 5
    assert answers[0].body.startswith(b"#usda")


def test_a_fault_is_answered_in_its_turn(place, controls, refused):
    """What was asked before it is answered whole, and before."""
    clip = urlencode({**controls, "fps": 500})
    slow = f"GET /v1/models/reach/clip.usda?{clip} HTTP/1.1\r\nHost: x\r\n\r\n".encode()
    alone = exchange(place, slow)[0].body
    for wrong in ("null in path", "two hosts", "tls", "chunk without size", "two lengths"):
        answers = exchange(place, slow + LIVE + MALFORMED[wrong] + LIVE, answers=3)
        assert [a.status for a in answers] == [200, 200, 400], wrong
        assert answers[0].body == alone
        refused(answers[2], 400, "malformed-request")


def test_so_many_requests_may_be_ahead(place, refused):
    answers = exchange(place, LIVE * 90, answers=90)
    assert [a.status for a in answers] == [200] * 90
    answers = exchange(place, LIVE * 5000, answers=None)
    assert 90 < len(answers) < 200
    refused(answers[-1], 400, "malformed-request")
    assert {a.status for a in answers[:-1]} == {200}


# Too slow ------------------------------------------------------------


def slowly(place, content, pause=0.2):
    """Answers to what is sent a byte at a time, and the seconds that it took."""
    began = time.monotonic()
    with socket.create_connection(place, timeout=20) as wire:
        over = threading.Event()

        def send():
            for byte in content:
                if over.wait(pause):
                    return
                try:
                    wire.sendall(bytes([byte]))
                except OSError:
                    return

        sender = threading.Thread(target=send)
        sender.start()
        try:
            stream = wire.makefile("rb")
            answer = read_answer(stream)
            return answer, time.monotonic() - began
        finally:
            over.set()
            sender.join()


def test_a_head_has_its_time(hasty, refused):
    answer, seconds = slowly(hasty, b"GET /livez HTTP/1.1\r\nHost: x\r\nA: " + b"a" * 1000)
    refused(answer, 408, "request-too-slow")
    assert 1 <= seconds < 5


def test_a_body_has_its_time(hasty, refused):
    head = POST + b"Content-Length: 1000\r\n\r\n"
    with socket.create_connection(hasty, timeout=20) as wire:
        wire.sendall(head + b"{")
        refused(read_answer(wire.makefile("rb")), 408, "request-too-slow")


def test_a_long_body_has_more_time(hasty, controls):
    """Twice as fast as the slowest that is borne, it takes longer than a short one may."""
    body = json.dumps({"controls": controls, "times": [0]}).encode()
    body += b" " * (32_000 - len(body))
    with socket.create_connection(hasty, timeout=20) as wire:
        wire.sendall(POST + b"Content-Length: %d\r\n\r\n" % len(body))
        for start in range(0, len(body), 1600):
            wire.sendall(body[start : start + 1600])
            time.sleep(0.15)
        assert read_answer(wire.makefile("rb")).status == 200


def test_an_unused_connection_ends(hasty):
    for first in (b"", LIVE, b"\r\n"):
        with socket.create_connection(hasty, timeout=20) as wire:
            stream = wire.makefile("rb")
            wire.sendall(first)
            if first == LIVE:
                assert read_answer(stream).status == 200
            began = time.monotonic()
            assert stream.read() == b""
            assert 1.4 < time.monotonic() - began < 6


def test_empty_lines_do_not_keep_a_connection(hasty):
    with socket.create_connection(hasty, timeout=20) as wire:
        wire.sendall(LIVE)
        assert read_answer(wire.makefile("rb")).status == 200
        began = time.monotonic()
        with pytest.raises(OSError):
            while time.monotonic() - began < 10:
                wire.sendall(b"\r\n")
                time.sleep(0.1)
        assert time.monotonic() - began < 6


def test_a_connection_in_use_stays(hasty):
    """Negative control: as long as the unused one lives, but asking."""
    with socket.create_connection(hasty, timeout=20) as wire:
        stream = wire.makefile("rb")
        for _ in range(8):
            wire.sendall(LIVE)
            assert read_answer(stream).status == 200
            time.sleep(0.5)


def reading(place, controls, take):
    """Bytes that arrive of a large answer until its end, taken by `take`."""
    clip = urlencode({**controls, "fps": 1000})
    asked = f"GET /v1/models/reach/clip.json?{clip} HTTP/1.1\r\nHost: x\r\n\r\n".encode()
    with socket.socket() as wire:
        # A small window: what is not read stays with the service and not in this system's buffers.
        wire.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        wire.settimeout(20)
        wire.connect(place)
        wire.sendall(asked * 30)
        return take(wire)


def test_who_does_not_take_the_answer_is_let_go(hasty, controls):
    def never(wire):
        time.sleep(4)
        taken = 0
        try:
            while piece := wire.recv(65536):
                taken += len(piece)
        except ConnectionResetError:
            return taken
        return taken

    def at_once(wire):
        stream = wire.makefile("rb")
        return sum(len(read_answer(stream).body) for _ in range(30))

    def steadily(wire):
        """A quarter of a megabyte a second, for longer than who takes nothing has."""
        end, taken = time.monotonic() + 4, 0
        while time.monotonic() < end:
            taken += len(wire.recv(4096))
            time.sleep(0.015)
        while taken < whole and (piece := wire.recv(1 << 16)):
            taken += len(piece)
        return taken

    whole = reading(hasty, controls, at_once)
    assert reading(hasty, controls, never) < whole / 2
    assert reading(hasty, controls, steadily) >= whole


# Too many ------------------------------------------------------------


def test_there_are_so_many_connections(hasty, refused):
    busy = [socket.create_connection(hasty, timeout=20) for _ in range(8)]
    try:
        for wire in busy:
            wire.sendall(POST + b"Content-Length: 1000\r\n\r\n{")
        assert until(lambda: exchange(hasty, LIVE)[0].status == 503)
        (answer,) = exchange(hasty, LIVE)
        refused(answer, 503, "no-connection-left")
        assert answer.headers["retry-after"] == "1"
    finally:
        for wire in busy:
            wire.close()
    assert until(lambda: exchange(hasty, LIVE)[0].status == 200)


def test_an_unused_connection_makes_room(hasty):
    assert until(lambda: exchange(hasty, LIVE)[0].status == 200)
    unused = [socket.create_connection(hasty, timeout=20) for _ in range(8)]
    try:
        for wire in unused:
            wire.sendall(LIVE)
            assert read_answer(wire.makefile("rb")).status == 200
        (answer,) = exchange(hasty, LIVE)
        assert answer.status == 200
        # The one that was longest unused had to go.
        assert unused[0].recv(1) == b""
    finally:
        for wire in unused:
            wire.close()


def until(true):
    """Whether it comes to be true within some seconds."""
    end = time.monotonic() + 8
    while time.monotonic() < end:
        if true():
            return True
        time.sleep(0.1)
    return False
