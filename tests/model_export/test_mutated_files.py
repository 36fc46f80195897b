"""Mutations of motion files, tables and recipes: each command ends with an answer or a refusal.

POSEFIELD_FUZZ_SECONDS and POSEFIELD_FUZZ_SEED make a longer run of other mutations (`make fuzz`).
"""

import json
import os
import random
import re
import shutil
import struct
import time
import traceback
import warnings

import pytest
import rigid_takes
from exported_clips import encoded
from minimal import TOML, small_clip, write_clips

pytestmark = pytest.mark.system

SECONDS = float(os.environ.get("POSEFIELD_FUZZ_SECONDS", "10"))
SEED = int(os.environ.get("POSEFIELD_FUZZ_SEED", "1"))
LONGEST = 60.0
"""CPU seconds that a command may take; each takes less than two."""
CODES = {0, 2, 3, 4}
NUMBERS = ("nan", "-1", "0", "1e400", "1e9", "1e-30", "-1e30", "33.333", "999999999999", "x", "")
VALUES = (None, -1, 0, 1e30, 2**40, "x", [], {}, [None], True)
FORMATS = ("bvh", "glb", "usda")
COMMANDS = (
    "probe {files} --json",
    "convert {file} --unit 0.5 --up y --rate 24 -o o.bvh",
    "convert {file} -o o.bvh",
    "train recipe.toml -o m.onnx --json",
    "evaluate recipe.toml --jobs 1 --json",
    "init . --json",
    "discover . -o found --candidates 20 --licence CC0-1.0 --json",
    "discover . --strides -o found.csv --json",
)


def mutated_text(text, draw):
    """Text with a line lost, repeated or exchanged, a number or a byte replaced, or an end lost."""
    lines = text.split("\n")
    at, other = draw.randrange(len(lines)), draw.randrange(len(lines))
    match draw.randrange(6):
        case 0:
            del lines[at]
        case 1:
            lines.insert(at, lines[other])
        case 2:
            lines[at], lines[other] = lines[other], lines[at]
        case 3:
            words = re.split(r"(\s+)", lines[at])
            words[draw.randrange(len(words))] = draw.choice(NUMBERS)
            lines[at] = "".join(words)
        case 4:
            lines[at] = lines[at][: draw.randrange(len(lines[at]) + 1)]
        case 5:
            lines = lines[:at]
    return "\n".join(lines)


def mutated_json(value, draw):
    """JSON with one value somewhere in it replaced, lost or repeated."""
    if isinstance(value, dict | list) and value and draw.random() < 0.9:
        keys = [*value] if isinstance(value, dict) else [*range(len(value))]
        key = draw.choice(keys)
        inner = value[key]
        if draw.random() < 0.2:
            del value[key]
        elif isinstance(value, list) and draw.random() < 0.1:
            value.append(inner)
        else:
            value[key] = mutated_json(inner, draw)
        return value
    return draw.choice(VALUES)


def mutated(content, suffix, draw):
    """Content of a file after one mutation, or two of a text."""
    if suffix == ".glb" and draw.random() < 0.2:
        at = draw.randrange(len(content))
        return content[:at] + bytes([draw.randrange(256)]) + content[at + 1 :]
    if suffix == ".glb":
        size = struct.unpack_from("<I", content, 12)[0]
        text = json.dumps(mutated_json(json.loads(content[20 : 20 + size]), draw)).encode()
        text += b" " * (-len(text) % 4)
        rest = content[20 + size :]
        sizes = (20 + len(text) + len(rest), len(text))
        return struct.pack("<4sIII4s", b"glTF", 2, *sizes, b"JSON") + text + rest
    text = content.decode()
    for _ in range(draw.choice((1, 1, 2))):
        text = mutated_text(text, draw)
    return text.encode()


def refuse_constant(name):
    raise AssertionError(f"{name} in JSON")


@pytest.fixture(scope="module")
def takes(tmp_path_factory):
    """A folder of long takes."""
    return rigid_takes.write_takes(tmp_path_factory.mktemp("mutated") / "takes")


@pytest.fixture(scope="module")
def family(tmp_path_factory):
    """A folder of four clips in three formats, its table and its recipe."""
    folder = tmp_path_factory.mktemp("mutated") / "family"
    write_clips(folder, [small_clip(phase) for phase in (0.0, 0.5, 1.0, 1.5)])
    for form in FORMATS[1:]:
        (folder / f"4.{form}").write_bytes(encoded(small_clip(2.0), form))
    (folder / "recipe.toml").write_text(TOML)
    return folder


def test_a_mutated_file_is_read_or_refused(posefield, family, takes, tmp_path, monkeypatch):
    draw, end, faults, codes = random.Random(SEED), time.monotonic() + SECONDS, [], []
    while time.monotonic() < end:
        folder, words = tmp_path / "mutated", draw.choice(COMMANDS)
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(takes if words.startswith("discover") else family, folder)
        if words.startswith("init"):
            (folder / "recipe.toml").unlink()
            (folder / "clips.csv").unlink()
        monkeypatch.chdir(folder)
        path = draw.choice(sorted(folder.iterdir()))
        path.write_bytes(mutated(path.read_bytes(), path.suffix, draw))
        files = " ".join(sorted(f.name for f in folder.iterdir() if f.suffix[1:] in FORMATS))
        words = words.format(file=path.name, files=files).split()
        began = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                code, out, _ = posefield(*words)
            if "--json" in words and code == 0:
                json.loads(out, parse_constant=refuse_constant)
            assert code in CODES and time.process_time() - began < LONGEST
            codes.append(code)
        except Exception:
            faults.append(f"{path.name}: posefield {' '.join(words)}\n{traceback.format_exc(-4)}")
            if kept := os.environ.get("POSEFIELD_FUZZ_KEEP"):
                shutil.copytree(folder, f"{kept}/{len(faults)}", dirs_exist_ok=True)
    assert faults == [], "\n".join(faults[:5])
    # Negative control: mutations reach both the readers' answers and their refusals.
    assert {0, 3} <= set(codes)
