"""Tests of the Dockerfile's text, without a container engine."""

import json
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from posefield import __version__

ROOT = Path(__file__).parents[1]
# uv reads the description of every distribution of the workspace, and installs one.
PACKAGING = {"pyproject.toml", "uv.lock"}
MEMBERS = {"model_export/pyproject.toml", "clients/python/pyproject.toml"}


@pytest.fixture(scope="module")
def parts() -> list[list[tuple[str, str]]]:
    """Instructions before the first stage and of each stage: (name, arguments), lines joined."""
    text = (ROOT / "Dockerfile").read_text()
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    joined = "\n".join(lines).replace("\\\n", " ")
    parts: list[list[tuple[str, str]]] = [[]]
    for line in filter(None, joined.splitlines()):
        name, _, arguments = line.partition(" ")
        if name == "FROM":
            parts.append([])
        parts[-1].append((name, arguments.strip()))
    return parts


@pytest.fixture(scope="module")
def stages(parts) -> list[list[tuple[str, str]]]:
    return parts[1:]


def values(stage, instruction):
    return [arguments for name, arguments in stage if name == instruction]


def test_hadolint_finds_nothing():
    hadolint = Path(sys.executable).parent / "hadolint"
    command = [hadolint, "--no-color", ROOT / "Dockerfile"]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (found.returncode, found.stdout) == (0, "")


def test_two_stages_from_one_base_that_is_pinned_by_digest(parts):
    before, *stages = parts
    assert [values(stage, "FROM")[0].split()[0] for stage in stages] == ["${BASE}"] * 2
    ((name, told),) = before
    assert name == "ARG"
    base, _, digest = told.removeprefix("BASE=").partition("@")
    assert re.fullmatch("sha256:[0-9a-f]{64}", digest)
    labels = dict(pair.split("=", 1) for pair in shlex.split(values(stages[1], "LABEL")[0]))
    assert labels["org.opencontainers.image.base.name"] == base
    assert labels["org.opencontainers.image.base.digest"] == digest
    assert base == "docker.io/library/python:3.11-slim-bookworm"


def test_only_the_service_and_its_packaging_are_copied(stages):
    build, final = stages
    copied = {source for line in values(build, "COPY") for source in line.split()[:-1]}
    assert copied == {*PACKAGING, *MEMBERS, "api", "service/pyproject.toml", "service"}
    assert values(final, "COPY") == ["--from=build /opt/posefield /opt/posefield"]
    assert not values(build, "ADD") + values(final, "ADD")


def test_the_build_takes_the_lock_and_what_exports_to_stores_need(stages):
    syncs = [line for line in values(stages[0], "RUN") if "uv sync" in line]
    assert all("--frozen" in line and "--no-dev" in line for line in syncs)
    assert "--no-editable" in syncs[-1]
    assert values(stages[0], "ARG") == ['EXTRAS="--extra store"']
    assert values(stages[1], "ARG") == ['SOURCE=""', 'REVISION=""']
    assert all(line.endswith(" ${EXTRAS}") and "--extra" not in line for line in syncs)
    known = tomllib.loads((ROOT / "service/pyproject.toml").read_text())["project"]
    assert "store" in known["optional-dependencies"]


def test_pods_run_what_the_image_has(stages):
    """The export's manifest names the image's version, user and command."""
    job = yaml.safe_load((ROOT / "service/deploy/export-job.yaml").read_text())
    pod = job["spec"]["template"]["spec"]
    (own,) = pod["containers"]
    assert own["image"] == f"posefield:{__version__}"
    user = pod["securityContext"]
    assert values(stages[1], "USER") == [f"{user['runAsUser']}:{user['runAsGroup']}"]
    assert own["command"][0] == json.loads(values(stages[1], "ENTRYPOINT")[0])[0]
