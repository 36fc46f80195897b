"""Tests of the documentation: the code is described, and generated pages are current."""

import re
import subprocess
import sys
import tomllib
from dataclasses import fields

import document_pages
import typer
import yaml
from document_pages import DOCS, ROOT

from posefield import cli
from posefield.encode.formats import CLIP_ENCODERS
from posefield.http.api.settings import PREFIX, Settings
from posefield.http.performance_operations import MAX_SCRIPT_BYTES
from posefield.performance import join_quality
from posefield.performance.script import MAX_SECONDS
from posefield.question import json_decoding
from posefield.question.performance_question import (
    MAX_SEGMENTS,
    PerformanceQuestion,
    PerformancesQuestion,
)
from posefield.question.performance_report import JoinReport, PerformanceReport
from posefield_train.cli import commands
from posefield_train.source.recipe import Recipe

README = ROOT / "README.md"
GENERATE = [sys.executable, str(DOCS / "generate.py")]
VARIABLE = re.compile(r"\bPOSEFIELD_[A-Z_]+[A-Z]\b")


def page(name):
    return (DOCS / name).read_text()


def undescribed(names, text):
    """Return the names that a text does not show as code."""
    return [name for name in names if f"`{name}`" not in text]


def known_commands():
    commands(cli.app)
    return typer.main.get_command(cli.app).commands


# --- size and order -------------------------------------------------------------------------------


def test_every_page_is_in_the_navigation():
    nav = yaml.safe_load((ROOT / "mkdocs.yml").read_text())["nav"]
    listed = re.findall(r"'([\w/-]+\.md)'", str(nav))
    outside = {f"decisions/{path.name}" for path in (DOCS / "decisions").glob("[0-9]*.md")}
    found = {str(path.relative_to(DOCS)) for path in DOCS.rglob("*.md")} - outside
    assert sorted(listed) == sorted(found)


# --- generated pages ------------------------------------------------------------------------------


def test_generated_pages_are_current():
    """They are made of the code: settings, commands, problems, recipe keys and columns."""
    done = subprocess.run([*GENERATE, "--check"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, "", "")


def test_the_figures_of_the_readme_are_measured_ones():
    rows = re.findall(r"^\| ([^|\[]+) \| ([^|\[]+) \|$", README.read_text(), re.MULTILINE)
    figures = [value for name, value in rows if re.search(r"\d", value)]
    pages = [path.read_text() for path in (DOCS / "results").glob("*.md")]
    assert len(figures) == 8
    numbers = [figure.rpartition(" ")[0] if " → " not in figure else figure for figure in figures]
    for number in numbers:
        assert any(number.removesuffix(" cm") in text for text in pages), number


# --- nothing is undescribed -----------------------------------------------------------------------


def test_variables_in_the_documents_exist():
    known = {f"{PREFIX}{setting.name.upper()}" for setting in fields(Settings)}
    for path in document_pages.pages():
        if path.name != "changelog.md":
            assert set(VARIABLE.findall(path.read_text())) <= known, path


def test_options_in_the_documents_exist():
    found = known_commands()
    for path in document_pages.pages():
        for block in document_pages.blocks(path.read_text()):
            text = block.text.replace("\\\n", " ")
            for name, rest in re.findall(r"^posefield (\w+)(.*)$", text, re.MULTILINE):
                assert name in found, (path, name)
                options = {word for each in found[name].params for word in each.opts}
                words = re.findall(r"(?<!\S)(--[a-z-]+)", rest.partition("#")[0])
                assert set(words) <= options, (path, name)


def test_every_metric_is_described():
    source = (ROOT / "service/posefield/http/metrics.py").read_text()
    names = re.findall(r'^ +"(posefield_\w+)"', source, re.MULTILINE)
    assert len(names) >= 7
    assert undescribed([*names, "posefield_build"], page("operate/metrics.md")) == []


def test_every_format_is_described():
    assert undescribed(CLIP_ENCODERS, page("guide/formats.md")) == []


def test_a_name_that_is_not_described_is_found():
    """Negative control of the tests above."""
    assert undescribed(["known", "other"], "| `known` | other |") == ["other"]


# --- recipes in the documents ---------------------------------------------------------------------


def test_whole_recipes_in_the_documents_are_valid():
    found = [
        tomllib.loads(block.text)
        for path in document_pages.pages()
        for block in document_pages.blocks(path.read_text())
        if block.language == "toml"
    ]
    whole = [each for each in found if "schema" in each]
    assert len(found) > 4
    assert {Recipe.model_validate(each).name for each in whole} == {"biped", "my_walk"}


# --- performances in the documents ----------------------------------------------------------------


def scripts_of_performances():
    """Return the scripts of the guide: files that its examples write, and JSON blocks; and the
    requests for many performances."""
    text = page("guide/performances.md")
    written = re.findall(r"<<'END'\n(.*?)\nEND\n", text, re.DOTALL)
    shown = [each.text for each in document_pages.blocks(text) if each.language == "json"]
    many = [each for each in written if '"scripts":' in each]
    return [each for each in (*written, *shown) if each not in many], many


def test_scripts_of_performances_in_the_guide_are_valid():
    found = [
        json_decoding.decode_question(PerformanceQuestion, text.encode())
        for text in scripts_of_performances()[0]
    ]
    assert len(found) == 7
    kinds = [[type(each).__name__ for each in script.segments] for script in found[-2:]]
    assert kinds == [["Walk", "Act", "Hold", "Act", "Walk"], ["Walk", "Act", "Act", "Walk"]]


def test_requests_for_many_performances_in_the_guide_are_valid():
    (text,) = scripts_of_performances()[1]
    asked = json_decoding.decode_question(PerformancesQuestion, text.encode())
    assert [each.name for each in asked.scripts] == ["left", "right"]


def test_the_limits_of_archives_of_performances_are_those_of_the_settings():
    limits = Settings()
    said = f"at most {limits.performances_limit} performances, with\n"
    said += f"{limits.performances_segments:,} segments and {limits.performances_seconds:,} seconds"
    assert said in page("guide/performances.md")
    said = f"{limits.clips_body_limit >> 20} MiB, {limits.performances_limit} scripts, "
    said += f"{limits.performances_segments:,} segments in all, and "
    contract = (ROOT / "api/openapi.yaml").read_text()
    assert f"{said}{limits.performances_seconds:,} seconds in all." in contract


def test_every_field_of_a_performance_report_is_described():
    text = page("guide/performances.md")
    names = {
        *PerformanceReport.__struct_encode_fields__,
        *(each.name for each in fields(JoinReport)),
    }
    own = {"begins", "ends", "place", "heading", "event", "targets", "path", "pointer", "message"}
    assert undescribed(sorted(names | own), text) == []


def test_the_limits_of_performances_are_those_of_the_code():
    text = page("guide/performances.md")
    assert f"at most {MAX_SCRIPT_BYTES // 1024} KiB and {MAX_SEGMENTS} segments" in text
    assert MAX_SECONDS == 600.0 and "a performance ten minutes" in text
    assert f"poses more than {100 * join_quality.MOST_DISTANCE:.0f} cm apart" in text
    assert f"heights differ by {100 * join_quality.MOST_DROP:.0f} cm" in text
    assert join_quality.MOST_PEAK == 3.0 and "more than three times" in text
    assert all(f"`{reference}`" in text for reference in join_quality.MOTIONS)
