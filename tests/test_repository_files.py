"""Tests of the files for contributors: workflows, templates and the citation."""

import re
import subprocess

import yaml
from document_pages import ROOT

GITHUB = ROOT / ".github"
WORKFLOWS = sorted((GITHUB / "workflows").glob("*.yml"))


def steps(workflow):
    """Return the steps of all jobs of a workflow."""
    return [step for job in workflow["jobs"].values() for step in job.get("steps", [])]


def make_targets():
    return set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))


def targets(step):
    """Return the targets of `make` that a step runs."""
    lines = re.findall(r"^make (.*)$", step.get("run", ""), re.MULTILINE)
    # Without variables, which may be expressions such as ${{ matrix.python }}.
    return {word for line in lines for word in re.sub(r"\w+=.*$", "", line).split()}


def test_workflows_run_targets_of_the_makefile():
    found = {path.stem: yaml.safe_load(path.read_text()) for path in WORKFLOWS}
    run = {name: set().union(*map(targets, steps(each))) for name, each in found.items()}
    assert run == {"test": {"test", "test-system", "docs", "audit"}, "publish": {"wheels", "docs"}}
    assert set().union(*run.values()) <= make_targets()


def test_a_tag_publishes_only_the_version_of_the_packages():
    workflow = yaml.safe_load((GITHUB / "workflows/publish.yml").read_text())
    (check,) = [step["run"] for step in steps(workflow) if "GITHUB_REF_NAME" in step.get("run", "")]
    project = (ROOT / "service/pyproject.toml").read_text()
    version = re.search(r'^version = "(.*)"$', project, re.MULTILINE)[1]
    for tag, code in ((f"v{version}", 0), ("v99.0.0", 1)):
        done = subprocess.run(["bash", "-c", check], cwd=ROOT, env={"GITHUB_REF_NAME": tag})
        assert done.returncode == code, tag


def test_the_citation_names_the_paper_and_the_licence():
    found = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert found.keys() >= {"cff-version", "message", "title", "authors"}
    assert found["license"] in (ROOT / "service/pyproject.toml").read_text()
    paper = found["preferred-citation"]["title"]
    assert paper in re.sub(r"\s+", " ", (ROOT / "README.md").read_text())
