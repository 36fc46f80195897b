"""A Dask cluster as the place where work is done: found, and fit for ours.

Only who names a scheduler needs `distributed`, which is the extra "dask".
"""

import hashlib
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from distributed import Client
from distributed.comm.addressing import parse_address
from distributed.comm.registry import get_backend
from distributed.scheduler import KilledWorker

from service.motion.errors import ClusterError

TIMEOUT = 10.0
"""Seconds that a scheduler has to answer, and to show a worker."""

# More workers than this are not named one by one.
NAMED = 5


@dataclass(frozen=True)
class Kit:
    """What must be the same on every worker: packages of ours by their source, distributions by
    their version."""

    packages: tuple[str, ...]
    distributions: tuple[str, ...]


@contextmanager
def connect(address: str, kit: Kit, timeout: float = TIMEOUT) -> Iterator[Client]:
    """Client of the scheduler at an address such as tcp://host:8786.

    Raises ClusterError where nobody answers, there are no workers, or one of them has another kit
    than is installed here.
    """
    with _client(address, timeout) as client:
        _check_workers(client, kit, address, timeout)
        yield client


@cache
def installed(kit: Kit) -> dict[str, str]:
    """What of a kit is installed here, by name; Python itself is always of it."""
    return {
        "Python": f"{sys.version_info.major}.{sys.version_info.minor}",
        **{name: _source(name) for name in kit.packages},
        **{name: _version(name) for name in kit.distributions},
    }


def differences(found: Mapping[str, str], expected: Mapping[str, str]) -> str:
    """In words what is installed there and not here; empty where all is the same."""
    unlike = [name for name in expected if found[name] != expected[name]]
    return ", ".join(f"{name} {found[name]}, expected {expected[name]}" for name in unlike)


def killed(fault: KilledWorker) -> str:
    """In words that the workers which took up a job died, so that no more are given it."""
    return (
        f"workers died at the same job {fault.allowed_failures + 1} times, the last was "
        f"{fault.last_worker.address}: out of memory?"
    )


def _source(package: str) -> str:
    """Digest of a package's modules: a version is the same for all that lies between two."""
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        return "none"
    folder = Path(spec.origin).parent
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return f"source {digest.hexdigest()[:8]}"


def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "none"


def _client(address: str, timeout: float) -> Client:
    try:
        get_backend(parse_address(address, strict=True)[0])
    except ValueError as fault:
        message = "no address of a Dask scheduler, expected one such as tcp://host:8786"
        raise ClusterError(address, message) from fault
    try:
        return Client(address, timeout=timeout, set_as_default=False)
    except OSError as fault:
        raise ClusterError(address, f"no Dask scheduler answers within {timeout:g} s") from fault


def _check_workers(client: Client, kit: Kit, address: str, timeout: float) -> None:
    try:
        client.wait_for_workers(1, timeout=timeout)
    except TimeoutError as fault:
        raise ClusterError(address, f"has no workers after {timeout:g} s") from fault
    answers = client.run(installed, kit, on_error="return")
    said = {worker: _said(answer, kit) for worker, answer in sorted(answers.items())}
    unfit = [f"worker {worker}: {words}" for worker, words in said.items() if words]
    if unfit:
        more = [f"and {len(unfit) - NAMED} more"] if len(unfit) > NAMED else []
        raise ClusterError(address, "; ".join([*unfit[:NAMED], *more]))


def _said(answer: dict[str, str] | Exception, kit: Kit) -> str:
    if isinstance(answer, dict):
        return differences(answer, installed(kit))
    return f"cannot run posefield: {answer}"
