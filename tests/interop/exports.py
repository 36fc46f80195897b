"""Check of an export of a thousand clips: every file is checked, and twenty are read back."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import cases
import numpy as np
import trained
from usd_checks import defects

from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

CLIPS, READ = 1000, 20
ENDINGS = ("usdc", "usda", "usdz")
COMMAND = Path(sys.executable).with_name("posefield")


def write(folder: Path) -> dict[str, dict[str, Path]]:
    """Twenty clips of an export of a thousand, and by file name and character what to expect."""
    model, content = trained.family()
    entries = [entry for ending in ENDINGS for entry in _export(content, folder, ending)]
    chosen = np.random.default_rng(20).choice(len(entries), READ, replace=False)
    return dict(_taken(model, entries[index], folder) for index in chosen)


def faults(folder: Path) -> list[str]:
    """Return the faults of the thousand files, a line each."""
    files = sorted((folder / "export").rglob("clips/**/*.usd*"))
    found = [f"{path}: {finding}" for path in files for finding in defects(path)]
    return found if len(files) == CLIPS else [f"{len(files)} files, expected {CLIPS}", *found]


def _export(content: bytes, folder: Path, ending: str) -> list[dict]:
    """Entries of the manifest: a half of the clips binary, a quarter each text and packages."""
    model, target = folder / "export/reaching.model", folder / f"export/{ending}"
    target.parent.mkdir(exist_ok=True)
    model.write_bytes(content)
    count = CLIPS // 2 if ending == "usdc" else CLIPS // 4
    asked = ("--sample", str(count), "--method", "hull", "--seed", str(count), "--format", ending)
    subprocess.run([COMMAND, "export", model, "-o", target, *asked], check=True)
    lines = (target / "manifest.jsonl").read_text().splitlines()
    return [{**json.loads(line), "target": target} for line in lines]


def _taken(model: Synthesizer, entry: dict, folder: Path) -> tuple[str, dict[str, Path]]:
    made = entry["target"] / entry["file"]
    path = folder / f"export_{made.name.replace('-', '_')}"
    shutil.copyfile(made, path)
    expectation = folder / f"{path.name}.npz"
    question = ClipQuestion(controls=entry["controls"], fps=entry["fps"])
    np.savez(expectation, **cases.matrices_of(clips.synthesize_clip(model, question).clip))
    return path.name, {cases.WHO: expectation}
