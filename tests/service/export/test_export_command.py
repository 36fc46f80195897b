"""Tests of `posefield export`: arguments, output and exit codes."""

import os
import pty
import subprocess
import sys
from pathlib import Path

import exporting
import pytest

POSEFIELD = Path(sys.executable).parent / "posefield"
HEADING = "name,stature,hip_height,turn,target_height,format,fps\n"
TABLE = f"{HEADING}low,1.7,0.9,10,0.6,usdc,30\nhigh,1.7,0.9,10,1.4,bvh,60\nusual,1.7,0.9,10,1.0,,\n"


@pytest.fixture
def table(tmp_path):
    """Path of a table of three clips."""
    path = tmp_path / "queries.csv"
    path.write_text(TABLE)
    return path


@pytest.fixture
def export(model_path, posefield):
    """Function that exports in this process; gives exit code, output and errors."""

    def run(*words):
        return posefield("export", model_path, *words, "--workers", "1")

    return run


def test_a_table_becomes_files(export, table, tmp_path, monkeypatch):
    # A CI system that asks for colours gets no control sequences.
    monkeypatch.setenv("FORCE_COLOR", "1")
    code, out, err = export(table, "-o", tmp_path / "made", "--format", "json")
    assert (code, err) == (0, "")
    assert out.startswith(f"{tmp_path}/made: 3 clips, ")
    lines = exporting.lines(tmp_path / "made/manifest.jsonl")
    assert [(line["file"], line["fps"]) for line in lines] == [
        ("clips/000/low.usdc", 30.0),
        ("clips/000/high.bvh", 60.0),
        ("clips/000/usual.json", 30.0),
    ]


def test_damage_is_told_and_mended_to_verify(export, table, tmp_path):
    export(table, "-o", tmp_path / "made")
    code, out, err = export(table, "-o", tmp_path / "made", "--verify")
    assert (code, err) == (0, "")
    assert out.strip().endswith("; it was complete before, and all checksums agree")
    clip = tmp_path / "made/clips/000/low.usdc"
    content = clip.read_bytes()
    clip.write_bytes(content[::-1])
    assert "it was complete before" in export(table, "-o", tmp_path / "made")[1]
    code, out, err = export(table, "-o", tmp_path / "made", "--verify")
    assert (code, err) == (0, f"{clip}: missing or damaged; the export is made again\n")
    assert ": 3 clips, " in out and "complete before" not in out
    assert clip.read_bytes() == content


def test_rows_at_fault_are_told_of_by_line(export, table, tmp_path):
    table.write_text(f"{TABLE}again,1.7,0.9,10,1.0,usdc,often\nlow,1.7,0.9,10,1.0,usdc,30\n")
    code, out, err = export(table, "-o", tmp_path / "made")
    assert (code, out) == (2, "")
    assert err.startswith(
        "posefield: queries: rows that cannot be answered: 2 (--skip-errors leaves them out):"
    )
    assert "/queries.csv:5: fps: 'often', expected" in err
    assert "/queries.csv:6: name: 'low'" in err
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--layout", "heap"), "layout: 'heap', expected one of folder"),
        (("--chunk", "0"), "chunk: 0, expected 1 or more"),
        (("--layout", "library"), "queries: rows that cannot be answered: 1 "),
        (("--sample", "3"), "queries: a file and --sample, expected one of"),
    ],
)
def test_what_makes_no_sense_is_refused(words, said, export, table, tmp_path):
    code, out, err = export(table, "-o", tmp_path / "made", *words)
    assert (code, out) == (2, "")
    assert err.startswith(f"posefield: {said}")
    assert not (tmp_path / "made").exists()


@pytest.mark.system
def test_a_terminal_sees_a_bar(model_path, tmp_path):
    ours, its = pty.openpty()
    sample = ["--sample", "200", "--chunk", "4"]
    words = [POSEFIELD, "export", model_path, *sample, "-o", tmp_path / "t"]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=its, env=environment) as process:
        os.close(its)
        seen = b""
        # The system says that nobody has the other end any more by an error.
        try:
            while more := os.read(ours, 4096):
                seen += more
        except OSError:
            pass
        assert b"200 clips" in process.stdout.read()
    os.close(ours)
    assert process.returncode == 0
    assert b"/200" in seen and b"a second" in seen and b"left" in seen
