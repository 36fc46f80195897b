"""Tests of the checks on a cluster before work starts, and of their messages."""

import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest
from clusters import started

import posefield
from posefield.common import dask_scheduler
from posefield.common.errors import ClusterError

pytestmark = pytest.mark.system

KIT = dask_scheduler.RequiredSoftware(("posefield",), ("numpy", "onnxruntime"))

# Every client in a process of its own: its loop and sockets are nobody else's.
CONNECT = f"""
import sys
from posefield.common import dask_scheduler
from posefield.common.errors import ClusterError
try:
    with dask_scheduler.connect(sys.argv[1], dask_scheduler.{KIT!r}, 3.0) as client:
        print(len(client.scheduler_info()["workers"]), "workers")
except ClusterError as fault:
    print(fault)
"""


def connect(address):
    """Connect, and return the outcome."""
    words = [sys.executable, "-c", CONNECT, address]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.fixture
def cluster(tmp_path):
    with started(tmp_path, 1) as own:
        yield own


def test_workers_with_the_same_kit_will_do(cluster):
    assert connect(cluster.address) == "1 workers"


def test_a_worker_without_posefield_is_named(cluster, tmp_path):
    bare = tmp_path / "bare"
    venv.create(bare, with_pip=False, symlinks=True)
    own = next(bare.glob("lib/python*/site-packages"))
    # Everything but our own packages, which are installed here by a .pth file.
    for entry in next(Path(path) for path in sys.path if path.endswith("site-packages")).iterdir():
        if "posefield" not in entry.name:
            (own / entry.name).symlink_to(entry)
    cluster.add(python=str(bare / "bin" / "python"))
    found = connect(cluster.address)
    assert found.startswith(f"{cluster.address}: worker tcp://127.0.0.1:")
    assert "cannot run posefield: ModuleNotFoundError" in found


def test_a_worker_with_another_source_is_named(cluster, tmp_path):
    copy = tmp_path / "older"
    shutil.copytree(Path(posefield.__file__).parent, copy / "posefield")
    cluster.add(path=str(copy))
    assert connect(cluster.address) == "2 workers"
    with (copy / "posefield" / "cli/crowd_files.py").open("a") as file:
        file.write("# one more line\n")
    cluster.add(path=str(copy))
    found = connect(cluster.address)
    assert found.count("worker tcp://") == 1
    assert f"expected {dask_scheduler.installed_versions(KIT)['posefield']}" in found


@pytest.mark.parametrize("address", ["nonsense", "nope://127.0.0.1:8786", ""])
def test_what_is_no_address_is_said_at_once(address):
    expected = pytest.raises(ClusterError, match="expected one such as tcp://host:8786")
    with expected, dask_scheduler.connect(address, KIT):
        pass


def test_nobody_there():
    assert connect("tcp://127.0.0.1:1").endswith("no Dask scheduler answers within 3 s")


def test_no_workers(tmp_path):
    with started(tmp_path, 0) as empty:
        assert connect(empty.address) == f"{empty.address}: has no workers after 3 s"


def test_another_source_or_version_is_a_difference(tmp_path):
    here = dask_scheduler.installed_versions(KIT)
    assert set(here) == {"Python", "posefield", "numpy", "onnxruntime"}
    assert dask_scheduler.describe_differences(here, here) == ""
    there = {**here, "numpy": "1.0", "posefield": "source 00000000"}
    assert dask_scheduler.describe_differences(there, here) == (
        f"posefield source 00000000, expected {here['posefield']}, "
        f"numpy 1.0, expected {here['numpy']}"
    )


def test_what_is_missing_is_none():
    found = dask_scheduler.installed_versions(
        dask_scheduler.RequiredSoftware(("no_such_package",), ("no-such-distribution",))
    )
    assert (found["no_such_package"], found["no-such-distribution"]) == ("none", "none")


# As where the extra is not installed.
WITHOUT = """
import sys
sys.modules["distributed"] = None
from posefield.cli import main
main()
"""


@pytest.mark.parametrize("command", [("export", "--sample", "4", "-o", "made"), ("check",)])
def test_without_the_extra_its_name_is_said(command, model_path, tmp_path):
    """Only who names a scheduler needs it: `check` does not."""
    name, *words = command
    words = [name, str(model_path), *words, *(["--scheduler", "tcp://a:1"] if words else [])]
    own = [sys.executable, "-c", WITHOUT, *words]
    done = subprocess.run(own, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert ('pip install "posefield[dask]"' in done.stderr) == (name == "export"), done.stderr
    assert not (tmp_path / "made").exists()
