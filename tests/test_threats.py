"""The page on threats names a test for each guard, and there is one of that name."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_every_threat_has_a_test_that_exists():
    page = (ROOT / "ARCHITECTURE.md").read_text().partition("## Threats")[2].partition("\n## ")[0]
    rows = [line.split("|") for line in page.splitlines() if line.startswith("| ")][1:]
    there = {path.stem for path in (ROOT / "tests").rglob("test_*.py")}
    assert len(rows) > 10
    for _, threat, _, shown, _ in rows:
        named = re.findall(r"`(test_\w+)`", shown)
        assert named and set(named) <= there, threat
