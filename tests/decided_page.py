"""Decisions made on the contact sheet in a browser: the saved file, and the command it shows."""

import html
import re
import shlex
import shutil
import subprocess
from dataclasses import dataclass

import pytest

SAVE = """
<script>
URL.createObjectURL = (blob) => {
  blob.text().then((text) => { document.title = text; });
  return "#";
};
HTMLAnchorElement.prototype.click = () => {};
CLICKS
document.getElementById("save").click();
</script>
"""
"""The button saves to the title: a browser without a window writes no file."""


@dataclass(frozen=True)
class Decided:
    """Decisions of a page. saved: text of decisions.json. command: words that the page shows."""

    saved: str
    command: list[str]


def decide(page, clicks, folder):
    """Return the decisions after clicks, lines of JavaScript, on a page; skip without a browser."""
    browser = shutil.which("chromium")
    if browser is None:
        pytest.skip("no chromium")
    clicked = folder / "clicked.html"
    script = SAVE.replace("CLICKS", clicks)
    clicked.write_text(page.read_text().replace("</body>", f"{script}</body>"))
    options = ("--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=5000")
    words = [browser, *options, f"--user-data-dir={folder}/browser", "--dump-dom", clicked.as_uri()]
    done = subprocess.run(words, capture_output=True, timeout=120, check=True)
    found = done.stdout.decode()
    title = html.unescape(re.search(r"<title>(.*?)</title>", found, re.DOTALL)[1])
    said = html.unescape(re.search(r"<output[^>]*>(.*?)</output>", found, re.DOTALL)[1])
    return Decided(title, shlex.split(said))
