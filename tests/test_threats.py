"""Tests of the threat table in SECURITY.md: each guard has a test or a check of `interop`."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_every_threat_has_a_test_that_exists():
    page = (ROOT / "SECURITY.md").read_text().partition("## Threats")[2].partition("\n## ")[0]
    rows = [line.split("|") for line in page.splitlines() if line.startswith("| ")][1:]
    tests = {path.stem for path in (ROOT / "tests").rglob("test_*.py")}
    run = (ROOT / "tests/interop/run.py").read_text()
    checks = {f"interop/{name}" for name in re.findall(r"\b(\w+)\.faults\b", run)}
    assert len(rows) > 10
    for _, threat, _, shown, _ in rows:
        named = re.findall(r"`((?:test_|interop/)\w+)`", shown)
        assert named and set(named) <= tests | checks, threat
