"""The page stands by itself, is the same twice, and shows every part to everyone."""

import re
from collections import Counter
from html import unescape
from html.parser import HTMLParser

import numpy as np
import pytest

from model_export.report import left_out, render
from model_export.report.about import Step

LOADING = {"src", "href", "xlink:href", "srcset", "action", "data", "poster", "background"}
ACTIVE = {"script", "link", "iframe", "object", "embed", "base"}


class Page(HTMLParser):
    """What a page would load, its names, what refers to them, its pictures and its words."""

    def __init__(self, content):
        super().__init__()
        self.loads, self.names, self.meant = [], [], []
        self.pictures, self.words, self.tags = [], [], Counter()
        self.feed(content.decode())

    def handle_starttag(self, tag, attrs):
        self.tags[tag] += 1
        for name, value in attrs:
            if name in LOADING and value.startswith("#"):
                self.meant.append(value[1:])
            elif name in LOADING and not value.startswith("data:image/png;base64,"):
                self.loads.append(value)
            self.styled(value or "")
        given = dict(attrs)
        self.names += [given["id"]] if "id" in given else []
        self.pictures += [given] if tag == "svg" else []

    def handle_data(self, data):
        self.words.append(data)
        self.styled(data)

    def styled(self, text):
        for target in re.findall(r"url\(([^)]*)\)", text):
            (self.meant if target.startswith("#") else self.loads).append(target.lstrip("#"))
        self.loads += re.findall(r"@import[^;]*", text)


@pytest.fixture(scope="module")
def page(rendered):
    return Page(rendered.html)


def test_the_page_loads_nothing(page):
    assert page.loads == []
    assert not ACTIVE & set(page.tags)


@pytest.mark.parametrize(
    "planted",
    [
        '<img src="http://example.com/x.png">',
        '<a href="https://example.com">x</a>',
        "<style>@import 'x.css';</style>",
        '<p style="background: url(x.png)">x</p>',
        '<image xlink:href="picture.png"/>',
    ],
)
def test_what_a_page_would_load_is_found(rendered, planted):
    """Negative control of the test above."""
    assert Page(rendered.html.replace(b"</main>", f"{planted}</main>".encode())).loads


def test_every_name_is_used_once_and_every_reference_meets_one(page):
    assert [name for name, count in Counter(page.names).items() if count > 1] == []
    assert set(page.meant) <= set(page.names)
    assert len(page.meant) > 100


def test_names_of_two_pictures_would_meet(rendered):
    """Negative control: this is what the pictures' names are prefixed for."""
    plain = re.sub(rb'id="[a-z0-9-]*-(axes_1|figure_1)"', rb'id="\1"', rendered.html)
    assert max(Counter(Page(plain).names).values()) > 1


def test_every_picture_says_what_it_shows(page):
    assert len(page.pictures) == page.tags["figcaption"] == 12
    for given in page.pictures:
        assert given["role"] == "img" and len(given["aria-label"]) > 30
        assert "width" not in given and "viewbox" in given


def test_every_section_can_be_reached_from_the_top(rendered, page):
    sections = re.findall(r'<section id="([a-z]+)">', rendered.html.decode())
    assert len(sections) == 12 and set(sections) <= set(page.meant)


def test_what_was_given_is_written_and_not_obeyed(rendered, note):
    assert b"<b>odd" not in rendered.html and b"reading <recipe>" not in rendered.html
    text = unescape(rendered.html.decode())
    assert note in text and "reading <recipe>" in text


def test_the_same_model_gives_the_same_bytes(trained, exported, ladder, steps, rendered):
    assert render.render(trained, exported, ladder, steps) == rendered


def test_another_time_gives_other_bytes(trained, exported, ladder, steps, rendered):
    """Negative control; and times are all that differs between two trainings of one recipe."""
    late = [*steps[:1], Step(steps[1].name, 9.75)]
    slower = render.render(trained, exported, ladder, late)
    assert slower.html != rendered.html and slower.json != rendered.json
    # The step's own, and both sums of them: at the top, and below the steps.
    kept = slower.html.replace(b">9.75<", b">1.50<").replace(b">10.00<", b">1.75<")
    assert kept.replace(b">10.0 s<", b">1.8 s<") == rendered.html


def test_no_date_and_no_path_is_told(rendered, trained):
    folder = str(trained.examples[0].row.place.parent)
    for content in (rendered.html.decode(), rendered.json.decode()):
        assert not re.search(r"20\d\d-\d\d-\d\d", content)
        assert folder not in content
    assert not re.search(r"matplotlib v|<metadata|dc:date", rendered.html.decode())


def test_the_worst_clip_is_named_first(rendered, trained):
    order = np.argsort(-trained.missed)
    worst, best = (left_out.label(trained.examples[order[i]]) for i in (0, -1))
    said = re.search(r"The worst is (.*?), ([0-9.]+) cm away", rendered.html.decode())
    assert said.group(1) == worst != best
    assert float(said.group(2)) == pytest.approx(100 * np.sqrt(trained.missed.max()), abs=0.005)
