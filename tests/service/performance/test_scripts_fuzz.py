"""Random scripts: no jump without a flag, no foot below the floor, and the same bytes again."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "benchmarks"))

import random_scripts  # noqa: E402

from posefield.encode.formats import CLIP_ENCODERS  # noqa: E402
from posefield.registry import model_registry  # noqa: E402

COUNTS = {"stroll": 48, "cmu_walk": 12}


def cast_of(path):
    return random_scripts.cast(model_registry.load([path]).models)


@pytest.fixture(scope="module")
def casts(walk_path):
    """Models that scripts are drawn from: the procedural walk, and the shipped captured one."""
    shipped = model_registry.SHIPPED_FOLDER / "cmu_walk.onnx"
    return {"stroll": cast_of(walk_path), "cmu_walk": cast_of(shipped)}


@pytest.mark.parametrize("name", COUNTS)
def test_random_scripts_are_performed_or_refused_with_a_pointer(casts, name):
    cast = casts[name]
    drawn = random_scripts.scripts(cast, COUNTS[name])
    found = [random_scripts.check(own, cast.find) for own in drawn]
    assert [fault for own in found for fault in own.faults] == []
    assert sum(own.answer is not None for own in found) > 0.5 * COUNTS[name]


@pytest.fixture(scope="module")
def walked(casts):
    """A script of two walks with a hold between them, and its answer."""
    cast = casts["stroll"]
    document = {
        "segments": [
            {"kind": "walk", "model": "stroll", "seconds": 3.0},
            {"kind": "hold", "seconds": 1.0},
            {"kind": "walk", "model": "stroll", "seconds": 3.0, "turn": 0.1},
        ],
        "fps": 60.0,
    }
    question = random_scripts.read(document)
    script = random_scripts.resolve_script(question, cast.find)
    return script, random_scripts.check(document, cast.find).answer


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda own: {"rotations": own.clip.rotations * np.float32(1.1)}, "quaternions"),
        (lambda own: {"translations": own.clip.translations * np.float32(np.nan)}, "finite"),
        (lambda own: {"translations": lowered(own.clip.translations)}, "below"),
        (lambda own: turned(own, 290), "away from joins"),
        (lambda own: turned(own, 3 + round(60.0 * own.trust.joins[0].time)), "join at"),
    ],
)
def test_a_spoiled_answer_has_a_fault(walked, spoil, said):
    script, answer = walked
    spoiled = replace(answer, clip=replace(answer.clip, **spoil(answer)))
    assert said in " ".join(random_scripts.faults(script, spoiled))


def lowered(translations):
    """The translations with the root 2 cm lower."""
    found = translations.copy()
    found[:, 0, 1] -= 0.02
    return found


def turned(answer, frame):
    """The rotations with one frame of them as in the first frame."""
    found = answer.clip.rotations.copy()
    found[frame, 1:] = found[0, 1:]
    return {"rotations": found}


def encoded(outcome):
    if outcome.answer is None:
        return outcome.refused
    encoder = CLIP_ENCODERS["npz"]
    return encoder.encode(outcome.answer, encoder.convention(None, None, None))


@pytest.mark.system
@pytest.mark.parametrize("threads", [1, 2])
def test_another_process_with_other_threads_gives_the_same_bytes(
    casts, walk_path, tmp_path, threads
):
    cast = casts["stroll"]
    number, names = 0, ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    environment = os.environ | dict.fromkeys(names, str(threads))
    for document in random_scripts.scripts(cast, 6):
        expected = encoded(random_scripts.check(document, cast.find))
        if isinstance(expected, str):
            continue
        script, made = tmp_path / f"{number}.json", tmp_path / f"{number}.npz"
        script.write_bytes(msgspec.json.encode(document))
        words = ["posefield", "perform", script, "--model", walk_path, "-o", made]
        command = f"import sys; sys.argv = {json.dumps(list(map(str, words)))}"
        command += "; from posefield.cli import main; main()"
        subprocess.run([sys.executable, "-c", command], env=environment, check=True)
        assert made.read_bytes() == expected
        number += 1
    assert number > 2
