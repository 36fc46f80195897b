"""Checks of the image on a read-only file system: responses equal those of the service here."""

import json
import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import debian
import httpx
import image
import running
import trained
from image import Image

from posefield import __version__
from posefield.encode.formats import CLIP_ENCODERS, POSE_ENCODERS
from posefield.http import static_page
from posefield.http.access import api_keys
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer

# What the Dockerfile adds to its base: 334 MB were measured, 428 before anything was left out.
BUDGET = 350_000_000
PORT = "8000"
# A process that ended because it was told to, and one that stands still.
PATIENCE, STILL = 15.0, 60.0


def faults() -> list[str]:
    """Return the image's faults, a line each."""
    if reason := debian.missing(image.TOOLS):
        print(f"the image is not built: {reason}")
        return []
    began = time.monotonic()
    with image.built() as built, tempfile.TemporaryDirectory() as name:
        print(f"image in {time.monotonic() - began:.0f} s: {built.own / 1e6:.0f} MB", end=" ")
        print(f"on a base of {built.base / 1e6:.0f}")
        folder = Path(name)
        found = [*_described(built), *_listed(built)]
        found += [*_jailed(built, folder), *_served(built, folder)]
    return [f"image: {fault}" for fault in found]


def _described(built: Image) -> Iterator[str]:
    """Faults of what the image says of itself."""
    labels, prefix = built.config["Labels"], "org.opencontainers.image."
    expected = {
        "User": "10001:10001",
        "ExposedPorts": {f"{PORT}/tcp": {}},
        "Entrypoint": ["posefield", "serve"],
        "Cmd": ["/models"],
        "Volumes": {},
    }
    said = {
        "title": "posefield",
        "version": __version__,
        "licenses": "Apache-2.0 AND CC-BY-SA-3.0",
        "base.name": "docker.io/library/python:3.11-slim-bookworm",
        "source": image.SOURCE,
        "revision": image.REVISION,
    }
    for key, value in expected.items():
        if built.config[key] != value:
            yield f"{key} {built.config[key]!r}, expected {value!r}"
    for key, value in said.items():
        if labels.get(prefix + key) != value:
            yield f"label {key} {labels.get(prefix + key)!r}, expected {value!r}"
    if built.own > BUDGET:
        yield f"{built.own} bytes beyond the base, expected at most {BUDGET}"


def _listed(built: Image) -> Iterator[str]:
    """Faults of the bill of materials: what it names has to be what is installed."""
    content = (built.root / "opt/posefield/share/sbom.cdx.json").read_bytes()
    bill = json.loads(content)
    named = {each["name"] for each in bill["components"]} | {bill["metadata"]["component"]["name"]}
    (packages,) = built.root.glob("opt/posefield/lib/python*/site-packages")
    there = {dist.name for dist in metadata.distributions(path=[str(packages)])}
    if (found := {*map(_plain, named)}) != (expected := {*map(_plain, there)}):
        yield f"only in the bill or only installed: {sorted(found ^ expected)}"


def _plain(name: str) -> str:
    return name.lower().replace("_", "-").replace(".", "-")


def _jailed(built: Image, folder: Path) -> Iterator[str]:
    """Faults of the container itself: what is tested in it has to be one."""
    script = "id -u; id -g; grep -E '^(CapEff|NoNewPrivs)' /proc/self/status"
    tried = " ".join(f"{place}/x" for place in ("", "/opt/posefield", "/models", "/var/tmp"))
    script = f"{script}; touch /tmp/x && rm /tmp/x; touch {tried}"
    said, complaint, _ = _run(built, ["sh", "-c", script], folder)
    expected = ["10001", "10001", "CapEff:\t0000000000000000", "NoNewPrivs:\t1"]
    if said.splitlines() != expected:
        yield f"the process is {said.splitlines()}, expected {expected}"
    if complaint.count("Read-only file system") != 4:
        yield f"the root can be written: {complaint!r}"


def _served(built: Image, folder: Path) -> Iterator[str]:
    """Faults of the service in the image."""
    models, temporary = _places(folder)
    model, content = trained.family()
    (models / "reaching.onnx").write_bytes(content)
    port, key = str(running.ports(1)[0]), api_keys.generate_key()
    told = {"POSEFIELD_PORT": port}
    health = built.config["Healthcheck"]["Test"][1:]
    command = [*built.config["Entrypoint"], *built.config["Cmd"]]
    if _run(built, health, folder, **told)[2] == 0:
        yield "healthy before it was started"
    if "POSEFIELD_KEYS" not in (said := _run(built, command, folder, **told)[1]):
        yield f"without keys it says {said!r}"
    told["POSEFIELD_KEYS"] = api_keys.key_line("somebody", ["read:*"], key)
    began = time.monotonic()
    with built.start(command, models, temporary, **told) as jail:
        line = jail.stdout.readline().decode() if jail.stdout else ""
        print(f"it answers after {time.monotonic() - began:.1f} s: {line}", end="")
        if line:
            yield from _answers(f"http://127.0.0.1:{port}", key, model)
            if _run(built, health, folder, **told)[2]:
                yield "not healthy while it answers"
            os.kill(_first(jail.pid), signal.SIGTERM)
        said, complaint = jail.communicate(timeout=PATIENCE)
    if (jail.returncode, said) != (0, b""):
        yield f"SIGTERM ends it with {jail.returncode}, {said!r} {complaint!r}"
    statuses = [json.loads(line)["status"] for line in complaint.splitlines()]
    if set(statuses) != {httpx.codes.OK}:
        yield f"requests of statuses {statuses}"
    if left := sorted(path.name for path in temporary.iterdir()):
        yield f"it leaves {left} in /tmp"


def _answers(url: str, key: str, model: Synthesizer) -> Iterator[str]:
    """Faults of answers, which have to be those of here to the last byte."""
    controls = {control.name: control.default for control in model.session.card.controls}
    clip = clips.synthesize_clip(model, ClipQuestion(controls=controls))
    expected = {
        f"/v1/models/{model.name}/pose": POSE_ENCODERS["json"].encode(
            poses.synthesize_poses(model, PoseQuestion(controls=controls, times=[0.5]))
        ),
        f"/v1/models/{model.name}/clip.usdc": CLIP_ENCODERS["usdc"].encode(
            clip, CLIP_ENCODERS["usdc"].convention(None, None)
        ),
    }
    known = {"Authorization": f"Bearer {key}"}
    with httpx.Client(base_url=url, timeout=STILL, headers=known) as client:
        for path in ("/livez", "/readyz"):
            if (status := client.get(path).status_code) != httpx.codes.OK:
                yield f"{path} answers {status}"
        for path, built in (("/", static_page.VIEWER), ("/docs", static_page.DOCS)):
            if client.get(path).content != built.read_bytes():
                yield f"{path} is not the page that was built here"
        for path, content in expected.items():
            answer = client.get(
                path, params=controls | {"time": 0.5} if "pose" in path else controls
            )
            if answer.content != content:
                yield f"{path} answers {answer.status_code} with other bytes than here"


def _run(built: Image, command: list[str], folder: Path, **told: str) -> tuple[str, str, int]:
    """Output, complaints and exit code of a command in a container."""
    with built.start(command, *_places(folder), **told) as jail:
        said, complaint = jail.communicate(timeout=STILL)
    return said.decode(), complaint.decode(), jail.returncode


def _places(folder: Path) -> tuple[Path, Path]:
    """Folders for models and for /tmp."""
    models, temporary = folder / "models", folder / "tmp"
    models.mkdir(exist_ok=True)
    temporary.mkdir(exist_ok=True)
    # The container's user is nobody here.
    folder.chmod(0o755)
    temporary.chmod(0o1777)
    return models, temporary


def _first(unshare: int) -> int:
    """The container's first process, which unshare started, as it is numbered here."""
    return int(Path(f"/proc/{unshare}/task/{unshare}/children").read_text())


if __name__ == "__main__":
    found = faults()
    print("\n".join(found) or "no fault in the image")
    sys.exit(bool(found))
