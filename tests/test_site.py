"""Tests of the documentation site: strict builds, search, and nothing loaded from elsewhere."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from document_pages import DOCS, ROOT

pytestmark = pytest.mark.system

ZENSICAL = Path(sys.executable).with_name("zensical")
LOADED = re.compile(r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(https?:)?//')


@pytest.fixture
def sources(tmp_path):
    """Return a folder with all that the site is built from."""
    shutil.copytree(DOCS, tmp_path / "docs")
    for name in ("mkdocs.yml", "CHANGELOG.md"):
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def build(folder):
    words = [ZENSICAL, "build", "--config-file", "mkdocs.yml", "--strict", "--clean"]
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)


def test_the_site_builds_with_search_and_dark_mode_and_nothing_from_elsewhere(sources):
    done = build(sources)
    assert done.returncode == 0, done.stdout + done.stderr
    site = sources / "build/site"
    pages = list(site.rglob("index.html"))
    assert len(pages) > 90
    assert [page for page in pages if LOADED.search(page.read_text())] == []
    index = (DOCS / "index.md").read_text()
    guides = [f"{path.parent.name}/{path.name}" for path in DOCS.glob("[gt]*/*.md")]
    assert [page for page in guides if page not in index and page != "tools/index.md"] == []
    assert not list(site.rglob("*.pyc"))
    assert 'data-md-color-scheme="slate"' in (site / "index.html").read_text()
    search = json.dumps(json.loads((site / "search.json").read_text()))
    assert "POSEFIELD_CROWD_LIMIT" in search and "decisions/0" not in search
    assert "Keep a Changelog" in (site / "changelog/index.html").read_text()


@pytest.mark.parametrize("fault", ["[page](none.md)", "[part](index.md#none)"])
def test_a_broken_link_stops_the_build(fault, sources):
    """Negative control: of a page and a heading; test_documents.py finds missing pictures."""
    with (sources / "docs/limits.md").open("a") as page:
        page.write(f"\n{fault}\n")
    assert build(sources).returncode != 0
