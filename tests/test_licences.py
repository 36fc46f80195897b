"""Tests of the licences of shipped packages: none is GPL, LGPL or AGPL."""

import json
import re
from importlib.metadata import Distribution, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
COPYLEFT = re.compile(r"\b[AL]?GPL|GNU (Affero |Lesser |Library )?General Public", re.IGNORECASE)
# Libraries that auditwheel has put into wheels of shipped packages, by their own licence files.
# GCC's runtime may be shipped with anything by its exception; libquadmath, which is not under it,
# is a shared library of NumPy's wheels that anybody may replace.
CARRIED = {
    "libXau": "MIT",
    "libavif": "BSD-2-Clause",
    "libbrotlicommon": "MIT",
    "libbrotlidec": "MIT",
    "libfreetype": "FTL OR GPL-2.0-or-later",
    "libgfortran": "GPL-3.0-or-later WITH GCC-exception-3.1",
    "libgomp": "GPL-3.0-or-later WITH GCC-exception-3.1",
    "libharfbuzz": "MIT-Modern-Variant",
    "libjpeg": "IJG AND BSD-3-Clause AND Zlib",
    "liblcms2": "MIT",
    "liblzma": "0BSD",
    "libopenjp2": "BSD-2-Clause",
    "libpng16": "libpng-2.0",
    "libquadmath": "LGPL-2.1-or-later",
    "libscipy_openblas": "BSD-3-Clause",
    "libscipy_openblas64_": "BSD-3-Clause",
    "libsharpyuv": "BSD-3-Clause",
    "libtbb": "Apache-2.0",
    "libtiff": "libtiff",
    "libusd_ms": "LicenseRef-TOST-1.0",
    "libwebp": "BSD-3-Clause",
    "libwebpdemux": "BSD-3-Clause",
    "libwebpmux": "BSD-3-Clause",
    "libxcb": "MIT",
    "libzstd": "BSD-3-Clause",
}
BOUND = {"libquadmath"}


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def shipped() -> dict[str, Distribution]:
    """Return the packages installed with the service, training job and client, with every extra."""
    found: dict[str, Distribution] = {}
    seen: set[tuple[str, str]] = set()
    wanted = [("posefield", ""), ("posefield-client", "")]
    for name in ("posefield", "posefield-client"):
        extras = distribution(name).metadata.get_all("Provides-Extra") or []
        wanted += [(name, extra) for extra in extras]
    while wanted:
        name, extra = wanted.pop()
        if (name, extra) in seen:
            continue
        seen.add((name, extra))
        found[name] = distribution(name)
        for line in found[name].requires or []:
            needed = Requirement(line)
            if needed.marker is None or needed.marker.evaluate({"extra": extra}):
                wanted += [(canonical(needed.name), each) for each in ("", *needed.extras)]
    return found


def licences(package: Distribution) -> list[str]:
    """Return the alternatives of a package's licence: its expression, or else its words for it."""
    told = package.metadata
    if expression := told.get("License-Expression"):
        return alternatives(expression)
    # Some give the whole text as their licence.
    line = (told.get("License") or "").partition("\n")[0]
    classifiers = [each for each in told.get_all("Classifier") or [] if each.startswith("License")]
    said = " ".join([line if len(line) < 100 else "", *classifiers]).strip()
    return [said] if said else []


def alternatives(expression: str) -> list[str]:
    """Return what an SPDX expression lets one choose from; parentheses stay as they are."""
    parts = re.split(r"\s+OR\s+(?![^(]*\))", expression)
    return [part for part in parts if part]


def free(found: list[str]) -> bool:
    """Return whether a licence can be chosen that is not copyleft."""
    return any(not COPYLEFT.search(each) for each in found)


def test_no_python_package_that_ships_is_copyleft():
    packages = shipped()
    assert {"numpy", "usd-core", "scipy", "pyarrow", "cryptography", "httpx"} <= packages.keys()
    assert {
        name: licences(each) for name, each in packages.items() if not free(licences(each))
    } == {}


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("MIT", True),
        ("GPL-2.0-only OR FTL", True),
        ("MIT AND AGPL-3.0-only", False),
        ("License :: OSI Approved :: GNU General Public License v3 (GPLv3)", False),
        ("", False),
    ],
)
def test_licences_are_told_apart(expression, expected):
    assert free(alternatives(expression)) is expected


def test_libraries_within_wheels_are_known_and_none_but_one_is_copyleft():
    installed = Path(distribution("numpy").locate_file(""))
    carried = {
        path.name.partition("-")[0].partition(".")[0]
        for name in shipped()
        for path in (installed / f"{name.replace('-', '_')}.libs").glob("*.so*")
    }
    assert carried <= CARRIED.keys()
    excepted = {
        name: said.replace("GPL-3.0-or-later WITH GCC", "") for name, said in CARRIED.items()
    }
    assert {name for name, said in excepted.items() if not free(alternatives(said))} == BOUND


def test_no_npm_package_is_copyleft():
    """The page holds some of them; none of the lock file's others is copyleft either."""
    packages = json.loads((ROOT / "clients/package-lock.json").read_bytes())["packages"]
    theirs = {name: each for name, each in packages.items() if "node_modules/" in name}
    own = {name for name, each in theirs.items() if each.get("link")}
    assert own and all(name.startswith("node_modules/@posefield/") for name in own)
    found = {name: theirs[name].get("license", "") for name in theirs.keys() - own}
    assert all(found.values())
    assert found["node_modules/three"] == "MIT"
    assert {name: said for name, said in found.items() if not free(alternatives(said))} == {}


def test_our_software_is_under_one_licence():
    for name in ("posefield-train", "posefield-client"):
        assert licences(distribution(name)) == ["Apache-2.0"]
    # Beside the software its wheel holds models that stay under the licence of their motion.
    assert licences(distribution("posefield")) == ["Apache-2.0 AND CC-BY-SA-3.0"]
    addon = (ROOT / "clients/blender/addon/blender_manifest.toml").read_text()
    assert 'license = ["SPDX:Apache-2.0"]' in addon
