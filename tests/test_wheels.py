"""Tests of the wheels and sdists: installed in fresh environments, without the sources."""

import json
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import httpx
import pytest
import serving
import wheels

ROOT = Path(__file__).parents[1]
SHIPPED = [
    f"posefield/shipped/{path.name}"
    for path in (ROOT / "service/posefield/shipped").iterdir()
    if path.suffix in {".onnx", ""}
]
TABLES = ("cmu_walk/strides.csv", "hdm05_reach/returns.csv", "hdm05_squat/clips.csv")

pytestmark = pytest.mark.system


def run(*words, cwd, code=0):
    done = subprocess.run(
        [str(word) for word in words], cwd=cwd, capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stderr
    return done


def assert_serves(posefield, models):
    """The service answers with the page, the docs and a clip."""
    with serving.started([posefield, "serve", models]) as child:
        url = serving.address(child)
        assert 'id="transport"' in httpx.get(f"{url}/").text
        assert "swagger" in httpx.get(f"{url}/docs").text.lower()
        (name,) = (model["name"] for model in httpx.get(f"{url}/v1/models").json()["models"])
        clip = httpx.get(f"{url}/v1/models/{name}/clip.usdc")
        assert clip.content.startswith(b"PXR-USDC"), clip.text


def test_wheels_train_and_serve_in_a_fresh_environment(dist, tmp_path):
    bin_ = wheels.install(dist, tmp_path, sys.executable, "posefield[train]")
    run(bin_ / "posefield", "sample", "reaching", "--output", "sample", cwd=tmp_path)
    trained = run(
        *(bin_ / "posefield", "train", "sample/recipe.toml", "--output", "reaching.onnx", "--json"),
        cwd=tmp_path,
    )
    assert json.loads(trained.stdout)["clips"] == 92
    assert_serves(bin_ / "posefield", tmp_path / "reaching.onnx")
    # No module of ours but the two packages.
    for name in ("service", "model_export"):
        told = run(bin_ / "python", "-c", f"import {name}", cwd=tmp_path, code=1).stderr
        assert f"ModuleNotFoundError: No module named '{name}'" in told


def test_the_service_alone_shows_a_walk_and_tells_how_to_get_the_training_commands(dist, tmp_path):
    bin_ = wheels.install(dist, tmp_path, sys.executable, "posefield", "posefield-client")
    run(bin_ / "posefield", "demo", "--once", "--output", "demo", cwd=tmp_path)
    assert (tmp_path / "demo/walk_1.2.usdc").read_bytes().startswith(b"PXR-USDC")
    run(bin_ / "posefield", "page", "cmu_walk", "--output", "site", cwd=tmp_path)
    scripts = [name for name in (tmp_path / "site").rglob("*.js") if name.stat().st_size > 10_000]
    assert scripts and (tmp_path / "site/models/cmu_walk.onnx").exists()
    grid = ("--grid", "speed=1.0:1.4:2")
    run(bin_ / "posefield", "bake", "cmu_walk", *grid, "--output", "space", cwd=tmp_path)
    space = json.loads((tmp_path / "space/blendspace.json").read_text())
    assert all((tmp_path / "space" / sample["file"]).exists() for sample in space["samples"])
    helped = run(bin_ / "posefield", "--help", cwd=tmp_path).stdout
    assert all(command in helped for command in ("serve", "train", "evaluate"))
    assert 'pip install "posefield[train]"' in " ".join(helped.replace("│", "").split())
    for words in (["train", "a.toml", "--output", "b.onnx"], ["sample", "--help"]):
        told = run(bin_ / "posefield", *words, cwd=tmp_path, code=2).stderr
        # Another package may have brought pydantic.
        missing = "posefield_train, scipy, onnx, (pydantic, )?matplotlib, joblib"
        line = re.escape(': pip install "posefield[train]"\n')
        assert re.fullmatch(f"posefield: needs {missing}{line}", told), told


def test_the_archives_hold_the_pages_the_contract_and_the_licence(dist):
    (wheel,) = dist.glob("posefield-*.whl")
    (source,) = dist.glob("posefield-*.tar.gz")
    with zipfile.ZipFile(wheel) as opened:
        whole = set(opened.namelist())
        assert (
            opened.read("posefield/http/api/openapi.yaml")
            == (ROOT / "api/openapi.yaml").read_bytes()
        )
        shipped = {file: opened.read(file) for file in SHIPPED}
    assert all(shipped[file] == (ROOT / "service" / file).read_bytes() for file in SHIPPED)
    pages = {f"posefield/http/pages/{page}/index.html" for page in ("docs", "model", "viewer")}
    assert pages <= whole
    assert any(name.endswith("licenses/LICENSE") for name in whole)
    assert any(name.endswith("licenses/posefield/shipped/NOTICE") for name in whole)
    (training,) = dist.glob("posefield_train-*.whl")
    with zipfile.ZipFile(training) as opened:
        tables = {f"posefield_train/recipes/{name}" for name in TABLES}
        assert tables <= set(opened.namelist())
    with tarfile.open(source) as opened:
        names = {member.name.partition("/")[2] for member in opened if member.isfile()}
    assert pages | {"posefield/http/api/openapi.yaml", "LICENSE", *SHIPPED} <= names
