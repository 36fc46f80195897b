"""Connection to a Dask cluster, and validation of its workers.

Requires `distributed`, which is the extra "dask".
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

from distributed import Client, KilledWorker
from distributed.comm.addressing import parse_address
from distributed.comm.registry import get_backend

from posefield.common.errors import ClusterError

CONNECT_TIMEOUT = 10.0
"""Seconds to wait for the scheduler, and for a first worker."""

# Largest number of workers that a message names.
MAX_LISTED_WORKERS = 5


@dataclass(frozen=True)
class RequiredSoftware:
    """Software that must be the same on every worker.

    packages: compared by a digest of their source. distributions: compared by version.
    """

    packages: tuple[str, ...]
    distributions: tuple[str, ...]


@contextmanager
def connect(
    address: str, kit: RequiredSoftware, timeout: float = CONNECT_TIMEOUT
) -> Iterator[Client]:
    """Yield a client of the scheduler at an address such as tcp://host:8786.

    kit: software that each worker must have as here. timeout: s. Raises ClusterError if the
    scheduler does not respond, has no workers, or a worker has another kit.
    """
    with _open_client(address, timeout) as client:
        _check_workers(client, kit, address, timeout)
        yield client


@cache
def installed_versions(kit: RequiredSoftware) -> dict[str, str]:
    """Return the versions of a kit's parts on this machine by name; Python's is always included."""
    return {
        "Python": f"{sys.version_info.major}.{sys.version_info.minor}",
        **{name: _source_digest(name) for name in kit.packages},
        **{name: _installed_version(name) for name in kit.distributions},
    }


def describe_differences(found: Mapping[str, str], expected: Mapping[str, str]) -> str:
    """Return the differences of two kits as text; empty if they are equal."""
    unlike = [name for name in expected if found[name] != expected[name]]
    return ", ".join(f"{name} {found[name]}, expected {expected[name]}" for name in unlike)


def killed_message(fault: KilledWorker) -> str:
    """Return the message for a job that was abandoned after its workers had died."""
    return (
        f"workers died at the same job {fault.allowed_failures + 1} times, the last was "
        f"{fault.last_worker.address}: out of memory?"
    )


def _source_digest(package: str) -> str:
    """Return a digest of a package's modules, which also tells apart states of one version."""
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        return "none"
    folder = Path(spec.origin).parent
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return f"source {digest.hexdigest()[:8]}"


def _installed_version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "none"


def _open_client(address: str, timeout: float) -> Client:
    try:
        get_backend(parse_address(address, strict=True)[0])
    except ValueError as fault:
        message = "no address of a Dask scheduler, expected one such as tcp://host:8786"
        raise ClusterError(address, message) from fault
    try:
        return Client(address, timeout=timeout, set_as_default=False)
    except OSError as fault:
        raise ClusterError(address, f"no Dask scheduler answers within {timeout:g} s") from fault


def _check_workers(client: Client, kit: RequiredSoftware, address: str, timeout: float) -> None:
    try:
        client.wait_for_workers(1, timeout=timeout)
    except TimeoutError as fault:
        raise ClusterError(address, f"has no workers after {timeout:g} s") from fault
    answers = client.run(installed_versions, kit, on_error="return")
    said = {worker: _version_mismatch(answer, kit) for worker, answer in sorted(answers.items())}
    unfit = [f"worker {worker}: {words}" for worker, words in said.items() if words]
    if unfit:
        more = (
            [f"and {len(unfit) - MAX_LISTED_WORKERS} more"]
            if len(unfit) > MAX_LISTED_WORKERS
            else []
        )
        raise ClusterError(address, "; ".join([*unfit[:MAX_LISTED_WORKERS], *more]))


def _version_mismatch(answer: dict[str, str] | Exception, kit: RequiredSoftware) -> str:
    if isinstance(answer, dict):
        return describe_differences(answer, installed_versions(kit))
    return f"cannot run posefield: {answer}"
