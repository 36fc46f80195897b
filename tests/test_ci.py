"""Tests of the CI scripts: order of steps, failures, and the report of unverified parts."""

import http.server
import json
import os
import re
import shutil
import subprocess
import sys
import threading
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
    "broken database": ("error: HTTP status server error (503 Service Unavailable)", 2, 75, False),
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


@pytest.fixture
def database(request):
    """An OSV database that knows of faults in some packages, and the packages it was asked for."""
    asked = []

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_POST(self):
            content = self.rfile.read(int(self.headers["content-length"]))
            asked.extend(q["package"]["name"] for q in json.loads(content)["queries"])
            known = [{"vulns": [{"id": "PYSEC-1", "modified": "2026-01-01T00:00:00Z"}]}, {}]
            self.answer({"results": [known[name not in request.param] for name in asked]})

        def do_GET(self):
            self.answer({"id": "PYSEC-1", "modified": "2026-01-01T00:00:00Z", "summary": "bad"})

        def answer(self, document):
            content = json.dumps(document).encode()
            self.send_response(200)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/", asked
    server.shutdown()
    thread.join()
    server.server_close()


def audit(*words):
    return run(ROOT / ".ci/audit", *words)


@pytest.mark.system
@pytest.mark.parametrize("database", [["uvicorn"]], indirect=True)
def test_a_known_vulnerability_fails_the_audit(database):
    url, asked = database
    done = audit("--service-url", url)
    assert done.returncode == 1
    assert "uvicorn" in done.stdout and "PYSEC-1" in done.stdout
    locked = re.findall(r'^name = "(.+)"', (ROOT / "uv.lock").read_text(), re.MULTILINE)
    assert set(asked) <= set(locked) and len(asked) > 100


@pytest.mark.system
def test_a_database_that_cannot_be_reached_has_a_code_of_its_own():
    assert audit("--service-url", "http://127.0.0.1:9/").returncode == 75


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


def test_ci_says_last_and_loudly_what_was_not_audited(checkout, fake_uv):
    done = ci(checkout, fake_uv(UNREACHABLE, 2))
    assert done.returncode == 0
    assert "NOT AUDITED" in done.stdout.splitlines()[-1]


@pytest.mark.parametrize("name", [n for n, audit in AUDITS.items() if audit[2] not in (0, 75)])
def test_ci_fails_with_every_other_audit(name, checkout, fake_uv):
    said, code, expected, _ = AUDITS[name]
    done = ci(checkout, fake_uv(said, code))
    assert done.returncode == expected and "made demo" not in done.stdout


@pytest.mark.parametrize(
    "said", ["no browser: none found", "no motion capture in /work/shared/data"]
)
def test_ci_fails_where_tests_were_skipped(said, checkout, fake_uv):
    program(checkout / "bin/make", f'echo "{said}"')
    done = ci(checkout, fake_uv(CLEAN, 0))
    assert done.returncode == 1 and "were skipped" in done.stderr


@pytest.mark.parametrize("step", ["page", "types", "test-system", "demo"])
def test_ci_fails_with_any_of_its_steps(step, checkout, fake_uv):
    program(checkout / "bin/make", f'[[ " $* " != *" {step} "* ]]')
    assert ci(checkout, fake_uv(CLEAN, 0)).returncode != 0


def test_a_slow_run_says_so_and_passes(checkout, fake_uv):
    text = (checkout / ".ci/run").read_text()
    assert "LIMIT=1500\n" in text
    (checkout / ".ci/run").write_text(text.replace("LIMIT=1500", "LIMIT=-1"))
    done = ci(checkout, fake_uv(CLEAN, 0))
    assert done.returncode == 0 and "SLOW" in done.stdout.splitlines()[-1]


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
