"""What the service is made of: listed as it is installed, and asked about."""

import http.server
import json
import re
import shlex
import subprocess
import sys
import threading
from importlib.metadata import distribution
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def lister():
    """The command of the Dockerfile that lists what is installed, for some interpreter."""
    text = (ROOT / "Dockerfile").read_text()
    (command,) = re.findall(r"cyclonedx-py (environment .*) --output-file \S+sbom.cdx.json", text)
    tool = Path(sys.executable).with_name("cyclonedx-py")

    def listed(python):
        whole = [tool, *shlex.split(command), python]
        return subprocess.run(whole, cwd=ROOT, capture_output=True, check=True).stdout

    return listed


def named(content):
    """Names and versions of a list's components."""
    document = json.loads(content)
    return {(canonical(c["name"]), c["version"]) for c in document["components"]}


def canonical(name):
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.fixture
def environment(tmp_path):
    """Make an environment in which some of what is installed here is."""

    def made(*names):
        root = tmp_path / "env"
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", root], check=True)
        (packages,) = root.glob("lib/*/site-packages")
        for name in names:
            told = distribution(name)._path
            (packages / told.name).symlink_to(told)
        return root / "bin/python"

    return made


def test_the_list_is_what_is_installed_and_nothing_else(lister, environment):
    names = ("numpy", "starlette", "uvicorn", "PyYAML", "usd-core")
    python = environment(*names)
    content = lister(python)
    assert named(content) == {(canonical(n), distribution(n).version) for n in names}
    whole = json.loads(content)
    assert (whole["bomFormat"], whole["metadata"]["component"]["name"]) == (
        "CycloneDX",
        "posefield",
    )
    assert content == lister(python)


def test_what_is_not_installed_is_not_in_the_list(lister, environment):
    """Negative control: neither the tool's own packages nor those of this environment."""
    assert json.loads(lister(environment())).get("components", []) == []


@pytest.fixture
def database(request):
    """An OSV database that knows of faults in some packages, and what it was asked."""
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


def audit(url):
    command = [ROOT / ".ci/audit", "--service-url", url]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.parametrize("database", [["uvicorn"]], indirect=True)
def test_a_known_vulnerability_fails_the_audit(database):
    url, asked = database
    done = audit(url)
    assert done.returncode == 1
    assert "uvicorn" in done.stdout and "PYSEC-1" in done.stdout
    locked = re.findall(r'^name = "(.+)"', (ROOT / "uv.lock").read_text(), re.MULTILINE)
    assert set(asked) <= set(locked) and len(asked) > 100


@pytest.mark.parametrize("database", [[]], indirect=True)
def test_nothing_known_passes_it(database):
    done = audit(database[0])
    assert (done.returncode, "no known vulnerabilities" in done.stdout) == (0, True)


def test_a_database_that_cannot_be_reached_is_said_in_one_line():
    done = audit("http://127.0.0.1:9/")
    assert done.returncode == 0
    (line,) = done.stdout.splitlines()
    assert "NOT audited" in line


def test_what_is_wrong_with_the_audit_itself_fails():
    command = [ROOT / ".ci/audit", "--no-such-option"]
    assert subprocess.run(command, capture_output=True, check=False).returncode == 2
