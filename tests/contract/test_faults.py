"""A short run of benchmarks/serve_faults.py, and tests of its detection of errors."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

from faults_book import Book  # noqa: E402
from faults_known import Answer, Known, Question  # noqa: E402

pytestmark = pytest.mark.system

RIGHT = Answer(200, {"etag": '"a"'}, b"what it is")
KNOWN = Known(Question("GET", "/pose"), "reach", (RIGHT,))
PROBLEM = {"content-type": "application/problem+json"}
OVERLOADED = Answer(503, PROBLEM, b'{"type": "urn:posefield:problem:overloaded"}')


def test_whatever_is_done_to_it_no_answer_is_wrong_and_none_is_lost(models):
    command = [sys.executable, BENCHMARKS / "serve_faults.py", models / "reach.onnx"]
    done = subprocess.run([*command, "--seconds", "4"], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "no fault"


@pytest.mark.parametrize(
    "answer",
    [
        replace(RIGHT, body=b"what it is not"),
        replace(RIGHT, headers={"etag": '"b"'}),
        replace(OVERLOADED, status=500),
        replace(OVERLOADED, body=b'{"type": "urn:posefield:problem:internal-error"}'),
    ],
)
def test_a_wrong_answer_is_noticed(answer):
    book = Book()
    book.answered(KNOWN, answer)
    assert len(book.wrong) == 1


def test_a_right_answer_and_a_documented_refusal_are_none():
    book = Book()
    book.answered(KNOWN, RIGHT)
    book.answered(KNOWN, OVERLOADED)
    assert book.wrong == []
    assert (book.right, book.refused) == ({200: 1}, {"overloaded": 1})
