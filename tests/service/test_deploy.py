"""Tests of service/deploy: valid manifests and scripts, which run a complete export in parts."""

import os
import subprocess
import sys
from pathlib import Path

import kubernetes_validate
import pytest
import yaml
from typer.testing import CliRunner

from posefield import cli

DEPLOY = Path(__file__).parents[2] / "service/deploy"
BIN = Path(sys.executable).parent
KUBERNETES = "1.37"
ROWS, CHUNK, PARTS = 24, 5, 3


@pytest.fixture(scope="module")
def queries(tmp_path_factory):
    """A table of small clips."""
    path = tmp_path_factory.mktemp("queries") / "queries.csv"
    rows = [f"{1.6 + 0.01 * n},0.9,{n},1.0,json" for n in range(ROWS)]
    path.write_text("\n".join(["stature,hip_height,turn,target_height,format", *rows]) + "\n")
    return path


def content(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def export(*words):
    """`posefield export`, in this process."""
    done = CliRunner().invoke(cli.app, ["export", *map(str, words)])
    assert done.exit_code == 0, (done.output, done.exception)
    return done.output


@pytest.fixture(scope="module")
def whole(model_path, queries, tmp_path_factory):
    """Content of the export in one go."""
    folder = tmp_path_factory.mktemp("whole")
    export(model_path, queries, "-o", folder, "--workers", 1, "--chunk", CHUNK)
    return content(folder)


@pytest.fixture
def manifest():
    return yaml.safe_load((DEPLOY / "export-job.yaml").read_text())


def container(manifest):
    (own,) = manifest["spec"]["template"]["spec"]["containers"]
    return own


def assert_valid(manifest):
    kubernetes_validate.validate(manifest, KUBERNETES, strict=True)


def test_kubernetes_knows_every_field(manifest):
    assert_valid(manifest)


def test_what_the_pods_run_makes_the_whole(manifest, model_path, queries, whole, tmp_path):
    """Their very arguments, the index put in as the kubelet does, the places those of here."""
    own = container(manifest)
    assert own["command"] == ["posefield", "export"]
    places = {
        "/input/reaching.onnx": str(model_path),
        "/input/queries.csv": str(queries),
        "--output=s3://motions/reaching": f"--output={tmp_path / 'made'}",
    }
    assert places.keys() <= set(own["args"])
    for index in reversed(range(manifest["spec"]["completions"])):
        words = [places.get(word, word) for word in own["args"]]
        words = [word.replace("$(JOB_COMPLETION_INDEX)", str(index)) for word in words]
        export(*words, "--chunk", CHUNK)
    assert content(tmp_path / "made") == whole


def run(words, **more):
    own = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}", **more}
    return subprocess.run(
        [str(word) for word in words], env=own, capture_output=True, text=True, check=False
    )


def slurm(*words, **more):
    return run([DEPLOY / "export-slurm.sh", *words], **more)


@pytest.mark.system
def test_tasks_of_an_array_make_the_whole(model_path, queries, whole, tmp_path):
    made = tmp_path / "made"
    for task in range(PARTS):
        told = {"SLURM_ARRAY_TASK_ID": str(task), "SLURM_ARRAY_TASK_MAX": str(PARTS - 1)}
        done = slurm(model_path, queries, made, "--chunk", CHUNK, **told)
        assert done.returncode == 0, done.stderr
        assert ("manifest.jsonl" in content(made)) == (task == PARTS - 1)
    assert content(made) == whole


def test_shellcheck_finds_nothing():
    script = DEPLOY / "export-slurm.sh"
    assert (run([BIN / "shellcheck", script]).stdout, os.access(script, os.X_OK)) == ("", True)


def openjd(*words):
    return run([BIN / "openjd", *words])


def test_the_openjd_template_is_valid():
    assert openjd("check", DEPLOY / "export-openjd.yaml").returncode == 0


@pytest.mark.system
def test_tasks_of_a_farm_make_the_whole(model_path, tmp_path):
    # The template's chunks are the usual ones: rows for two of them.
    queries = tmp_path / "queries.csv"
    rows = [f"1.7,0.9,{0.1 * n:.1f},1.0,json,0.1" for n in range(300)]
    heading = "stature,hip_height,turn,target_height,format,end"
    queries.write_text("\n".join([heading, *rows]) + "\n")
    export(model_path, queries, "-o", tmp_path / "whole", "--workers", 1)
    made = tmp_path / "made"
    told = {"Model": model_path, "Queries": queries, "Target": made, "Parts": 2}
    words = [word for name, value in told.items() for word in ("-p", f"{name}={value}")]
    done = openjd("run", DEPLOY / "export-openjd.yaml", "--step", "Export", *words)
    assert done.returncode == 0, done.stdout
    assert "clips of this part: 256, all finished; other parts are not" in done.stdout
    assert content(made) == content(tmp_path / "whole")
