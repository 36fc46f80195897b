"""The service as a separate process, and clients that detect lost responses."""

import contextlib
import os
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
POSEFIELD = Path(sys.executable).with_name("posefield")
# Seconds after which nobody waits for a process any more, however busy the machine.
LIFETIME = 600


@contextlib.contextmanager
def process(*paths, **environ):
    """The service as a process of its own; killed if the test leaves it running."""
    with started([POSEFIELD, "serve", *map(str, paths)], **environ) as child:
        yield child


@contextlib.contextmanager
def started(command, **environ):
    """A command that serves, on a free port and without lines of requests unless told otherwise."""
    given = {**os.environ, "POSEFIELD_PORT": "0", "POSEFIELD_LOG": "off", **environ}
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=ROOT, env=given, stdout=pipe, stderr=pipe) as child:
        watch = threading.Timer(LIFETIME, child.kill)
        watch.start()
        try:
            yield child
        finally:
            watch.cancel()
            child.kill()


def address(child) -> str:
    """Return the service's address, from the one line that it prints."""
    return child.stdout.readline().decode().split()[-1]


def host_and_port(url):
    host, port = url.removeprefix("http://").split(":")
    return host, int(port)


def children(pid):
    """Processes that a process has started."""
    listed = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    return [int(word) for word in listed.split()]


def within(seconds, is_so):
    """Wait for `is_so()`; return its last value."""
    until = time.monotonic() + seconds
    while not (found := is_so()) and time.monotonic() < until:
        time.sleep(0.02)
    return found


class Clients:
    """Clients at raw sockets, each in a thread, and a balancer that asks whether the service is
    ready: those that open a connection for each request stop when it is not, those that keep one
    stop when they are told to close it.

    answered: how many answers there were, and how many of them asked to close the connection;
    lost: what became of requests that were not answered. heed: whether they listen to the balancer.
    """

    def __init__(self, url, heed=True):
        self.where = host_and_port(url)
        self.answered = Counter()
        self.lost = []
        self._heed = heed
        self._ready = self._going = True
        kinds = [(True, 0.0)] * 4 + [(True, 0.05)] * 4 + [(True, 0.3)] * 2 + [(False, 0.0)] * 6
        self._threads = [threading.Thread(target=self._ask_on, args=kind) for kind in kinds]
        self._threads.append(threading.Thread(target=self._balance))
        for thread in self._threads:
            thread.start()

    def wait(self):
        """Until all have stopped."""
        for thread in self._threads:
            thread.join(20)
        self._going = False

    def _balance(self):
        while self._going and self._ready:
            try:
                with socket.create_connection(self.where, timeout=10) as wire:
                    wire.sendall(b"GET /readyz HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    self._ready = received(wire).startswith(b"HTTP/1.1 200 ")
            except OSError:
                self._ready = False
            time.sleep(0.05)

    def _ask_on(self, keeps, pause):
        while self._going and (self._ready or not self._heed):
            try:
                wire = socket.create_connection(self.where, timeout=10)
            except ConnectionRefusedError:
                return
            except OSError as fault:
                self.lost.append(repr(fault))
                return
            with wire:
                self._ask_over(wire, keeps, pause)

    def _ask_over(self, wire, keeps, pause):
        while self._going:
            try:
                closes = exchange(wire)
            except OSError as fault:
                self.lost.append(repr(fault))
                return
            self.answered["closing" if closes else "open"] += 1
            if closes or not keeps:
                return
            time.sleep(pause)


def exchange(wire, path="/v1/models"):
    """Ask over a socket; whether the answer says that it closes. OSError if there is none."""
    wire.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
    head, body = b"", b""
    while b"\r\n\r\n" not in head:
        head += received(wire)
    head, _, body = head.lower().partition(b"\r\n\r\n")
    lines = dict(line.split(b": ", 1) for line in head.split(b"\r\n")[1:])
    while len(body) < int(lines[b"content-length"]):
        body += received(wire)
    return lines.get(b"connection") == b"close"


def received(wire):
    if content := wire.recv(65536):
        return content
    raise ConnectionError("ended without an answer")
