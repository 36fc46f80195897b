"""Tests of compose.yaml and of the quickstarts, without a container engine where there is none."""

import json
import re
import shlex
from pathlib import Path

import kubernetes_validate
import pytest
import typer
import yaml
from packaging.version import Version

from posefield import __version__, cli
from posefield.http.access import access_control
from posefield.http.api import settings

ROOT = Path(__file__).parents[1]
DEPLOY = ROOT / "service/deploy"
QUICKSTARTS = DEPLOY / "README.md"


@pytest.fixture(scope="module")
def services():
    whole = yaml.safe_load((ROOT / "compose.yaml").read_text())
    assert whole.keys() == {"name", "services", "volumes"}
    assert whole["services"].keys() == {"posefield", "nginx"}
    return whole["services"]


@pytest.fixture(scope="module")
def dockerfile():
    return (ROOT / "Dockerfile").read_text()


@pytest.fixture(scope="module")
def nginx():
    return (DEPLOY / "nginx.conf").read_text()


def test_the_image_is_the_dockerfiles_and_serves_what_ships(services, dockerfile):
    own = services["posefield"]
    name, _, tag = own["image"].partition(":")
    assert name == "ghcr.io/posefield/posefield"
    assert Version(tag) >= Version(__version__)
    assert (ROOT / own["build"] / "Dockerfile").exists()
    # The image's argument is a folder of models; an empty list leaves it out.
    assert 'ENTRYPOINT ["posefield", "serve"]\nCMD ["/models"]' in dockerfile
    assert own["command"] == []
    ((health,),) = [re.findall(r"^HEALTHCHECK .*CMD (.*)$", dockerfile, re.MULTILINE)]
    assert own["healthcheck"]["test"] == ["CMD", *json.loads(health)]
    times = {f"--{key.replace('_', '-')}={text}" for key, text in own["healthcheck"].items()}
    assert set(re.findall(r"--[\w-]+=\d+s", dockerfile)) <= times


def test_the_service_starts_with_these_settings_and_no_keys(services, monkeypatch):
    for name, value in services["posefield"]["environment"].items():
        monkeypatch.setenv(name, value)
    given = settings.read_settings()
    access_control.from_settings(given)
    assert (given.host, given.port, given.alias_seconds) == ("127.0.0.1", 8000, 1)


def test_nginx_stands_in_front(services, nginx):
    own, front = services["posefield"], services["nginx"]
    (port,) = own["ports"]
    address, outside, inside = port.split(":")
    assert (address, outside) == ("127.0.0.1", inside), "no keys: for this machine only"
    assert f"listen {inside};" in nginx
    # One network namespace, so that both addresses are those of the files.
    assert front["network_mode"] == "service:posefield" and "ports" not in front
    assert f"server 127.0.0.1:{own['environment']['POSEFIELD_PORT']};" in nginx
    assert front["depends_on"] == {"posefield": {"condition": "service_healthy"}}
    mounts = dict(volume.split(":")[:2] for volume in front["volumes"])
    assert (ROOT / "service/deploy/nginx.conf").samefile(ROOT / next(iter(mounts)))
    assert mounts["./service/deploy/nginx.conf"] == "/etc/nginx/conf.d/default.conf"
    (cache,) = re.findall(r"proxy_cache_path (\S+)", nginx)
    assert cache.startswith(f"{mounts['cache']}/")
    assert front["healthcheck"]["test"][-1] == f"http://127.0.0.1:{inside}/livez"


def blocks(kind):
    """Fenced blocks of the quickstarts, without their indent."""
    text = QUICKSTARTS.read_text()
    found = re.findall(rf"^( *)```{kind}\n(.*?)^ *```", text, re.DOTALL | re.MULTILINE)
    return [re.sub(rf"^{indent}", "", block, flags=re.MULTILINE) for indent, block in found]


def test_manifests_of_the_quickstarts_are_valid_and_fit_the_service():
    (block,) = blocks("yaml")
    claim, pod = yaml.safe_load_all(block)
    for manifest in (claim, pod):
        kubernetes_validate.validate(manifest, "1.37", strict=True)
    deployment = next(
        each
        for each in yaml.safe_load_all((DEPLOY / "serve.yaml").read_text())
        if each["kind"] == "Deployment"
    )
    served = deployment["spec"]["template"]["spec"]
    claims = [each["persistentVolumeClaim"] for each in served["volumes"] if "persist" in str(each)]
    assert [each["claimName"] for each in claims] == [claim["metadata"]["name"]]
    (filling,) = pod["spec"]["containers"]
    assert filling["image"] == served["containers"][0]["image"] == f"posefield:{__version__}"


def test_commands_of_the_quickstarts_exist(tmp_path):
    commands = typer.main.get_command(cli.app).commands
    lines = [shlex.split(line) for block in blocks("sh") for line in block.splitlines()]
    assert {words[0] for words in lines} == {"docker", "kubectl", "posefield"}
    # In a pod, the command follows two dashes.
    own = [words[words.index("--") + 1 :] if "--" in words else words for words in lines]
    used = {words[1] for words in own if words[0] == "posefield"}
    assert used == {"key", "serve"} <= commands.keys()
    assert ["kubectl", "apply", "-f", "serve.yaml"] in lines
    (code,) = (words[words.index("-c") + 1] for words in lines if "-c" in words)
    exec(code.replace("/models", str(tmp_path)))
    assert (tmp_path / "cmu_walk.onnx").stat().st_size > 100_000
