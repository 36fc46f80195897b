"""Tests of the CI scripts: failures, and the report of unverified parts."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CLEAN = "Found no known vulnerabilities and no adverse project statuses in 201 packages"
UNREACHABLE = "error: Request failed after 3 retries\n  cause: error sending request for url (x)"


def program(path, text):
    """Write an executable that bash runs."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/usr/bin/env bash\n{text}\n")
    path.chmod(0o755)
    return path


def run(*command, **environ):
    given = {**os.environ, **environ}
    return subprocess.run(
        command, env=given, capture_output=True, text=True, timeout=120, check=False
    )


# --- audit ----------------------------------------------------------------------------------------


@pytest.fixture
def fake_uv(tmp_path):
    """Function that writes a uv which says something on standard error and ends with a code."""

    def write(said, code):
        (tmp_path / "said").write_text(said + "\n")
        return program(tmp_path / "uv", f"cat {tmp_path / 'said'} >&2; exit {code}")

    return write


AUDITS = {
    # what uv says, its exit code, the audit's, whether something was audited
    "clean": (CLEAN, 0, 0, True),
    "known": ("uvicorn 0.1 has 1 known vulnerability: PYSEC-1", 1, 1, True),
    "unreachable": (UNREACHABLE, 2, 75, False),
    "wrong arguments": ("error: unexpected argument '--x' found", 2, 2, False),
    "crash": ("panicked at crates/uv", 101, 2, False),
    "nothing to audit": (CLEAN.replace("201", "0"), 0, 2, False),
}


@pytest.mark.parametrize("name", AUDITS)
def test_an_audit_passes_only_where_something_was_audited(name, fake_uv):
    said, code, expected, audited = AUDITS[name]
    done = run(ROOT / ".ci/audit", UV=str(fake_uv(said, code)))
    assert done.returncode == expected
    assert said in done.stdout
    assert ("NOT AUDITED" not in done.stderr) is audited


# --- the whole ------------------------------------------------------------------------------------


@pytest.fixture
def checkout(tmp_path):
    """A folder with CI's own scripts, whose make and other Pythons only say that they ran."""
    shutil.copytree(ROOT / ".ci", tmp_path / ".ci")
    program(tmp_path / "bin/make", 'echo "made $*"')
    program(tmp_path / ".ci/pythons", "echo proven")
    return tmp_path


def ci(checkout, uv):
    path = f"{checkout / 'bin'}{os.pathsep}{os.environ['PATH']}"
    return run(checkout / ".ci/run", PATH=path, UV=str(uv))


@pytest.mark.parametrize("name", ["unreachable", "known", "crash"])
def test_ci_fails_by_what_is_known_and_says_last_what_was_not_audited(name, checkout, fake_uv):
    said, code, expected, _ = AUDITS[name]
    done = ci(checkout, fake_uv(said, code))
    unaudited = expected == 75
    assert done.returncode == (0 if unaudited else expected)
    assert ("made demo" in done.stdout) is unaudited
    assert not unaudited or "NOT AUDITED" in done.stdout.splitlines()[-1]


def test_ci_fails_where_tests_were_skipped(checkout, fake_uv):
    program(checkout / "bin/make", 'echo "no browser: none found"')
    done = ci(checkout, fake_uv(CLEAN, 0))
    assert done.returncode == 1 and "were skipped" in done.stderr


@pytest.mark.parametrize("step", ["page", "types", "test-system", "demo"])
def test_ci_fails_with_any_of_its_steps(step, checkout, fake_uv):
    program(checkout / "bin/make", f'[[ " $* " != *" {step} "* ]]')
    assert ci(checkout, fake_uv(CLEAN, 0)).returncode != 0


def test_the_scripts_are_sound_to_shellcheck():
    shellcheck = Path(sys.executable).with_name("shellcheck")
    done = run(
        shellcheck, *sorted(file for file in (ROOT / ".ci").iterdir() if file.suffix != ".py")
    )
    assert (done.returncode, done.stdout) == (0, "")
