"""Tests of the page of found families: what it shows, and its decisions in a browser."""

import html
import json
import re
import shutil

import pytest
import rigid_takes
from decided_page import decide

from posefield_train.families import review

WORDS = ("--licence", "ours", "--candidates", "60")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("sheet")


@pytest.fixture
def page(posefield, folder):
    """The page of a folder of recordings."""
    made = folder / "recipes"
    if not made.exists():
        recordings = rigid_takes.write_takes(folder / "recordings")
        (recordings / "broken.bvh").write_text("HIERARCHY <b>")
        assert posefield("discover", recordings, "-o", made, *WORDS)[0] == 0
    return made / "index.html"


def test_each_family_has_its_example_its_best_and_its_worst_clips(page):
    text = page.read_text()
    facts = json.loads((page.parent / "discover.json").read_text())
    for one in facts["families"]:
        section = re.search(rf'<section id="family-{one["number"]}".*?</section>', text, re.DOTALL)
        shown = min(one["clips"], 8)
        assert section[0].count("<svg ") == shown + 1
        assert section[0].count('name="drop"') == shown
        assert all(name in section[0] for name in one["controls"])
        assert all(who in section[0] for who in one["performers"])
    assert "broken.bvh: " in text and "<b>" not in text


def test_the_page_needs_no_other_file(page):
    text = page.read_text()
    assert not re.search(r"""(src|href)=|@import|url\(|https?://""", text)


def test_clips_of_the_page_are_those_that_review_drops(posefield, page, tmp_path):
    made = shutil.copytree(page.parent, tmp_path / "recipes")
    keys = [
        html.unescape(key) for key in re.findall(r'name="drop" value="([^"]+)"', page.read_text())
    ]
    (tmp_path / "d.json").write_text(json.dumps({"drop": keys}))
    assert posefield("review", made, "--decisions", tmp_path / "d.json")[0] == 0
    rows = "".join(path.read_text() for path in made.glob("*.csv"))
    assert rows.count("false") == len(keys) == len(set(keys)) > 5


CLICKS = """
const one = document.querySelector("input[value=accept]");
one.focus(); one.click();
document.querySelector("#family-1 input[name=drop]").click();
const select = document.querySelector("#family-2 select");
select.value = "1"; select.dispatchEvent(new Event("change", { bubbles: true }));
"""


@pytest.mark.system
def test_choices_become_decisions_and_their_command(page, tmp_path):
    decided = decide(page, CLICKS, tmp_path)
    (tmp_path / "decisions.json").write_text(decided.saved)
    read = review.read(tmp_path / "decisions.json")
    assert (read.accept, read.reject, read.merge) == ((1,), (), ((1, 2),)) and len(read.drop) == 1
    words = ["posefield", "review", str(page.parent), "--accept", "1", "--merge", "1,2", "--drop"]
    assert decided.command[:-1] == words
    assert decided.command[-1].startswith(f"{read.drop[0].family}:")
