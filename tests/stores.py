"""S3 object store as a separate process."""

import re
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def serving(said: Path) -> Iterator[str]:
    """Address of a store; said: file for what it says."""
    words = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", "0"]
    # It says a line a request: a pipe that nobody reads would fill and stop it.
    with said.open("w") as file:
        process = subprocess.Popen(words, stdout=file, stderr=subprocess.STDOUT)
    try:
        yield _address(process, said)
    finally:
        process.kill()
        process.wait()


def told(address: str) -> dict[str, str]:
    """The environment that says where the store is and who asks."""
    return {
        "AWS_ENDPOINT_URL": address,
        "AWS_ACCESS_KEY_ID": "somebody",
        "AWS_SECRET_ACCESS_KEY": "secret",
        "AWS_REGION": "us-east-1",
    }


def bucket(address: str, test: str) -> str:
    """Name of a new bucket, after a test."""
    name = re.sub("[^a-z0-9]+", "-", test.lower()).strip("-")[:60].strip("-")
    urllib.request.urlopen(urllib.request.Request(f"{address}/{name}", method="PUT")).close()
    return name


def _address(process: subprocess.Popen[bytes], said: Path) -> str:
    while process.poll() is None:
        if found := re.search(r"http://[\d.:]+\d", said.read_text()):
            return found.group()
        time.sleep(0.05)
    raise AssertionError(said.read_text())
