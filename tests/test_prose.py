"""Tests of the prose check, which `make lint` runs: planted sentences do not pass."""

import subprocess
import sys
from pathlib import Path

import pytest

CHECK = Path(__file__).parents[1] / "docs/check_prose.py"


def check(*files):
    words = [sys.executable, str(CHECK), *map(str, files)]
    return subprocess.run(words, capture_output=True, text=True, check=False)


PYTHON = [
    ('"""What the answer is held to."""', "'held to' in: "),
    ('"""What the answer is."""', "begins with 'What'"),
    ("# Somebody never seen.", "'Somebody' in: "),
    ('said = f"nobody knows {name}"', "'nobody' in: "),
    ('"""Return the answer."""', ""),
    ("nobody = [somebody]", ""),
    ('said = f"a {nobody} performer"', ""),
]
TYPESCRIPT = [
    ("/** What the answer is. */", "begins with 'What'"),
    ("const a = 1; // Whether it is.", "begins with 'Whether'"),
    ("/** The answer.\n * It is held to a target. */", ":2: 'held to' in: "),
    ('const a = "https://held to";', ""),
    ("/** The answer. */", ""),
]


@pytest.mark.parametrize(("ending", "cases"), [("py", PYTHON), ("ts", TYPESCRIPT)])
def test_sentences_of_sources_are_judged(ending, cases, tmp_path):
    file = tmp_path / f"planted.{ending}"
    for line, fault in cases:
        file.write_text(f"{line}\n")
        done = check(file)
        assert (done.returncode, fault in done.stdout) == (int(bool(fault)), True), done.stdout


def test_a_sentence_of_a_document_is_judged(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# A page\n\nWhoever asks is held to a target.\n")
    assert len(check(page).stdout.splitlines()) == 2


def test_the_lint_step_runs_it():
    makefile = (CHECK.parents[1] / "Makefile").read_text()
    lint = makefile.partition("\nlint:")[2].partition("\n\n")[0]
    assert "docs/check_prose.py" in lint
