"""Tests of the report's page: self-contained, escaped and reproducible."""

import base64
import json
import re
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest

from posefield_train.report import clip_errors, training_report
from posefield_train.report import controls as control_sections
from posefield_train.report.page import LABEL, draw_chart

LOADING = {"src", "href", "xlink:href", "srcset", "action", "data", "poster", "background"}
ACTIVE = {"script", "link", "iframe", "object", "embed", "base"}
SVG, PNG = "data:image/svg+xml;base64,", "data:image/png;base64,"
# Characters with a meaning in HTML, in SVG, in CSS, in templates or in matplotlib's labels.
MARKUP = """<script>'&" {{7}} $x^2$"""
CHARTS = 9


class Parsed(HTMLParser):
    """Parsed HTML or SVG: what it loads, its ids, references to them, images, text and tags."""

    def __init__(self, content):
        super().__init__()
        self.loads, self.ids, self.references = [], [], []
        self.images, self.texts, self.tags = [], [], Counter()
        self.feed(content.decode())

    def handle_starttag(self, tag, attrs):
        self.tags[tag] += 1
        given = dict(attrs)
        self.ids += [given["id"]] if "id" in given else []
        self.images += [given] if tag == "img" else []
        for name, value in attrs:
            if name in LOADING and not value.startswith((SVG, PNG)):
                (self.references if value.startswith("#") else self.loads).append(value.lstrip("#"))
            self.find_urls(value or "")

    def handle_data(self, data):
        self.texts.append(data)
        self.find_urls(data)

    def find_urls(self, text):
        for target in re.findall(r"url\(([^)]*)\)", text):
            (self.references if target.startswith("#") else self.loads).append(target.lstrip("#"))
        self.loads += re.findall(r"@import[^;]*", text)

    @property
    def charts(self):
        """The decoded SVG files."""
        return [base64.b64decode(image["src"].removeprefix(SVG)) for image in self.images]


@pytest.fixture(scope="module")
def page(rendered):
    return Parsed(rendered.html)


def test_the_page_and_its_charts_load_nothing(page):
    assert len(page.charts) == CHARTS
    for part in (page, *map(Parsed, page.charts)):
        assert part.loads == []
        assert not ACTIVE & set(part.tags)


def test_a_planted_load_is_found(rendered, page):
    """Negative control of the test above."""
    planted = '<p style="background: url(x.png)">x</p>'
    assert Parsed(rendered.html.replace(b"</main>", f"{planted}</main>".encode())).loads
    assert Parsed(page.charts[0].replace(b"</svg>", f"{planted}</svg>".encode())).loads


def test_every_id_is_unique_and_every_reference_has_its_target(page):
    for part in (page, *map(Parsed, page.charts)):
        assert [name for name, count in Counter(part.ids).items() if count > 1] == []
        assert set(part.references) <= set(part.ids)
        assert len(part.references) > 5


def test_charts_and_tables_have_captions_text_alternatives_and_scopes(rendered, page):
    assert len(page.images) == page.tags["figcaption"] == CHARTS
    assert all(len(image["alt"]) > 30 for image in page.images)
    assert page.tags["table"] == page.tags["caption"] > 9
    text = rendered.html.decode()
    assert text.count("<th ") == text.count('scope="col"') + text.count('scope="row"')


def test_every_section_is_linked_from_the_top(rendered, page):
    sections = re.findall(r'<section id="([a-z]+)">', rendered.html.decode())
    assert len(sections) == page.tags["section"] == 11
    assert set(sections) <= set(page.references)


@pytest.fixture(scope="module")
def hostile(trained, exported):
    """A model whose user-given texts are markup: description, clips, performer, controls."""
    first = exported.card.controls[0]
    controls = (replace(first, description=MARKUP, unit=MARKUP), *exported.card.controls[1:])
    card = replace(exported.card, name=MARKUP, description=MARKUP, controls=controls)
    worst = int(np.argmax(trained.left_out_errors))
    examples = list(trained.examples)
    row = replace(examples[worst].row, file=Path(f"{MARKUP}.bvh"), performer=MARKUP)
    examples[worst] = replace(examples[worst], row=row)
    return replace(trained, examples=tuple(examples)), replace(exported, card=card)


def test_user_given_text_is_shown_and_not_interpreted(hostile, levels, steps, page):
    trained, exported = hostile
    found = Parsed(training_report.render(trained, exported, levels, steps).html)
    assert found.tags["script"] == 0 and found.tags["img"] == page.tags["img"]
    assert found.loads == []
    # Title, heading and lead; unit and description of the control; performer; and the clip.
    assert found.texts.count(MARKUP) >= 6
    assert (
        f"{MARKUP} (line {trained.examples[int(np.argmax(trained.left_out_errors))].row.line})"
        in (found.texts)
    )
    for svg in found.charts:
        assert b"<script>" not in svg
    drawn = [element.text for svg in found.charts for element in ElementTree.fromstring(svg).iter()]
    assert MARKUP in drawn
    assert f"stature ({MARKUP})" in drawn


def test_a_long_name_leaves_space_for_the_charts(trained, exported):
    """matplotlib warns, which is an error here, where a label leaves no space."""
    long = "a" * 200
    first, *others = exported.card.controls
    section = control_sections.coverage_section(trained, (replace(first, name=long), *others))
    (svg,) = (drawn.svg.decode() for drawn in section.charts)
    assert f"{'a' * (LABEL - 1)}… (m)" in svg and long not in svg
    assert long in section.tables[0].rows[0]
    examples = [replace(e, row=replace(e.row, performer=long)) for e in trained.examples]
    bars = clip_errors.error_section(
        replace(trained, examples=tuple(examples)), exported.card.controls
    )
    assert "a…" in bars.charts[0].svg.decode()


def test_charts_do_not_depend_on_the_users_matplotlib_settings():
    def paint(figure):
        figure.subplots().plot([1, 2], [3, 4])

    expected = draw_chart(1.0, paint, "", "")
    with matplotlib.rc_context({"lines.linewidth": 9.0, "svg.fonttype": "path"}):
        assert draw_chart(1.0, paint, "", "") == expected
    # Negative control: another curve gives another file.
    assert draw_chart(1.0, lambda figure: figure.subplots().plot([1, 3]), "", "") != expected


def test_two_reports_of_a_model_differ_only_in_the_times(
    trained, exported, levels, steps, rendered
):
    late = [*steps[:1], (steps[1][0], 9.75)]
    slower = training_report.render(trained, exported, levels, late)
    assert slower.html != rendered.html and slower.json != rendered.json
    # The step's own time, and its sums at the top and below the steps.
    kept = slower.html.replace(b">9.75<", b">1.50<").replace(b">10.00<", b">1.75<")
    assert kept.replace(b">10.0 s<", b">1.8 s<") == rendered.html
    # Other numbers may hold the same digits: some are measured times.
    found, expected = json.loads(slower.json), json.loads(rendered.json)
    assert found["about"]["steps"][-1].pop("seconds") == 9.75
    assert expected["about"]["steps"][-1].pop("seconds") == 1.5
    assert found == expected


def test_no_date_and_no_path_is_in_the_report(rendered, page, trained):
    folder = str(trained.examples[0].row.file.parent)
    for content in (rendered.html, rendered.json, *page.charts):
        assert not re.search(rb"20\d\d-\d\d-\d\d", content)
        assert folder.encode() not in content
        assert not re.search(rb"matplotlib v|<metadata|dc:date", content)
