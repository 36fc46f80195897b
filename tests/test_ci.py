"""Tests of the CI scripts: order of steps, failures, and the report of unverified parts."""

import os
import re
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


def test_ci_passes_in_this_order(checkout, fake_uv):
    done = ci(checkout, fake_uv(CLEAN, 0))
    assert done.returncode == 0
    lines = [line for line in done.stdout.splitlines() if not line.startswith("=== ")]
    made = ["made page", "made --no-print-directory -j2 lint types typescript", "proven"]
    assert lines[:6] == [*made, "made test-system", CLEAN, "made demo"]
    # Each step with its time.
    times = [re.fullmatch(r" +\d+ s  (.+)", line) for line in lines[6:]]
    assert [time[1].split()[-1] for time in times] == [
        "page",
        "typescript",
        ".ci/pythons",
        "system",
        "audit",
        "demo",
    ]


def test_ci_fails_where_tests_were_skipped(checkout, fake_uv):
    program(checkout / "bin/make", 'echo "no browser: none found"')
    done = ci(checkout, fake_uv(CLEAN, 0))
    assert done.returncode == 1 and "were skipped" in done.stderr


@pytest.mark.parametrize("step", ["page", "types", "test-system", "demo"])
def test_ci_fails_with_any_of_its_steps(step, checkout, fake_uv):
    program(checkout / "bin/make", f'[[ " $* " != *" {step} "* ]]')
    assert ci(checkout, fake_uv(CLEAN, 0)).returncode != 0


# --- Pythons --------------------------------------------------------------------------------------


def python(path, version, venv=True):
    """Write a Python of a version, with or without what makes environments."""
    missing = "" if venv else "[[ $2 == *ensurepip* ]] && exit 1; "
    return program(path, f"{missing}[[ $2 == *version_info* ]] && echo {version}; exit 0")


def listed(tmp_path, uv, *versions):
    """.ci/pythons --list on a machine that has programs of such versions, by a uv."""
    root = tmp_path / "pyenv"
    for version in versions:
        python(root / f"versions/{version}.0/bin/python{version}", version)
    # Nothing but the tools that the script itself takes.
    tools = tmp_path / "tools"
    tools.mkdir()
    for name in ("bash", "env", "dirname", "grep"):
        (tools / name).symlink_to(shutil.which(name))
    return run(ROOT / ".ci/pythons", "--list", PATH=str(tools), PYENV_ROOT=str(root), UV=str(uv))


FINDS = """
for folder in ${PATH//:/ }; do
    [ -x "$folder/python${!#}" ] && { echo "$folder/python${!#}"; exit 0; }
done
exit 2"""


@pytest.mark.parametrize(
    ("versions", "unusable", "code"),
    [
        (("3.11", "3.12", "3.13"), "", 0),
        (("3.11", "3.12"), "3.12", 1),
        ((), "", 1),
    ],
)
def test_two_pythons_that_are_installed_have_to_be_usable(versions, unusable, code, tmp_path):
    refuse = f'[ "${{!#}}" = "{unusable}" ] && exit 2' if unusable else ""
    uv = program(tmp_path / "uv", refuse + FINDS)
    done = listed(tmp_path, uv, *versions)
    assert done.returncode == code, done.stderr
    usable = [version for version in versions if version != unusable]
    assert [line.rpartition("python")[2] for line in done.stdout.splitlines()] == usable


def test_the_scripts_are_sound_to_shellcheck():
    shellcheck = Path(sys.executable).with_name("shellcheck")
    done = run(
        shellcheck, *sorted(file for file in (ROOT / ".ci").iterdir() if file.suffix != ".py")
    )
    assert (done.returncode, done.stdout) == (0, "")
