"""Comparison of glTF files in Godot 3, of Debian's package, with the kinematics of this project.

Its editor runs without a display. Godot 3 keeps frames at whole rates only. It keeps only Latin
letters and digits of the names of joints, and imports no joint whose name has none. The clips have
such rates and names.
"""

import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import cases
import debian
import numpy as np
import trained
from compare import Motion, compare

from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion.clip import Clip
from posefield.question.results import ClipAnswer

PROGRAM = "godot3-server"
SCRIPT = Path(__file__).with_name("godot_read.gd")
PATIENCE = 120.0
"""Seconds for the import of all files."""
PROJECT = 'config_version=4\n\n[application]\n\nconfig/name="interop"\n'
# Defaults are 15 frames a second, and keys left out where the error is small.
IMPORT = """[remap]

importer="scene"
type="PackedScene"

[params]

animation/fps={rate}
animation/optimizer/enabled=false
"""


def faults() -> list[str]:
    """Return the faults of Godot's import, a line each; print the largest errors of each file."""
    if reason := debian.missing({PROGRAM: PROGRAM}):
        print(f"no Godot: {reason}")
        return []
    clips = dict(_clips())
    with tempfile.TemporaryDirectory() as name:
        found = _import_clips(Path(name), clips)
        return [*_compared(Path(name), clips, found)]


def _clips() -> Iterator[tuple[str, ClipAnswer]]:
    """Yield clips by name of file."""
    yield trained.middle()
    for name, answer in cases.answers_by_hand():
        clip = answer.clip
        names = tuple(f"Joint {index}" for index in range(len(clip.skeleton)))
        rate = float(round(clip.rate))
        renamed = Clip(replace(clip.skeleton, names=names), clip.rotations, clip.translations, rate)
        yield name, replace(answer, clip=renamed)


def _compared(
    folder: Path, clips: Mapping[str, ClipAnswer], found: Mapping[str, Motion]
) -> Iterator[str]:
    """Yield a line for each clip that is read wrongly, and if the wrong clip is not noticed."""
    print(f"{'file':<26}{'reader':<10}{'metres':>10}{'turn':>10}")
    for name, read, good in (*((name, name, True) for name in clips), ("film", "fast", False)):
        expected = folder / "expected.npz"
        meant = cases.matrices_of(clips[name].clip)
        names = [*map(_key, clips[name].clip.skeleton.names)]
        np.savez(expected, **meant | {"joints": np.array(names)})
        joints, matrices = found[read]
        motion = [*map(_key, joints)], matrices[: len(meant["matrices"])]
        row = compare(f"{read}.glb", "godot", {"": motion}, {"": expected})
        print(f"{row.file:<26}{row.reader:<10}{row.metres:>10.1e}{row.turn:>10.1e}  {row.fault}")
        if row.good != good:
            yield f"Godot: {read}.glb as {name}: {row.metres:g} m off, {row.fault or 'read'}"


def _key(name: str) -> str:
    """Return what Godot 3 keeps of a joint's name: it writes LeftUpLeg as left_up_leg."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _import_clips(project: Path, clips: Mapping[str, ClipAnswer]) -> dict[str, Motion]:
    """Return joints and matrices (F, J, 4, 4) of the clips as Godot sees them, by name."""
    (project / "project.godot").write_text(PROJECT)
    (project / SCRIPT.name).write_bytes(SCRIPT.read_bytes())
    times = {}
    for name, answer in clips.items():
        file = project / f"{name}.glb"
        file.write_bytes(CLIP_ENCODERS["glb"].encode(answer))
        clip = answer.clip
        file.with_name(f"{name}.glb.import").write_text(IMPORT.format(rate=round(clip.rate)))
        times[file.name] = (np.arange(len(clip)) / clip.rate).tolist()
    (project / "requests.json").write_text(json.dumps(times))
    _let_editor_import(project, len(times))
    found = json.loads(_run_script(project).read_text())
    return {
        name.removesuffix(".glb"): (read["joints"], _matrices(read)) for name, read in found.items()
    }


def _let_editor_import(project: Path, count: int) -> None:
    """Start the editor and end it after the last import: --quit does not end this version."""
    command = [PROGRAM, "--path", project, "--editor"]
    said = project / "editor.txt"
    with said.open("wb") as out, subprocess.Popen(command, stdout=out, stderr=out) as editor:
        end = time.monotonic() + PATIENCE
        # The digest of a file is written after its scene.
        while len([*project.glob(".import/*.md5")]) < count:
            if time.monotonic() > end or editor.poll() is not None:
                editor.kill()
                raise RuntimeError(f"Godot imported too few files:\n{said.read_text()[-2000:]}")
            time.sleep(0.2)
        editor.kill()


def _run_script(project: Path) -> Path:
    command = [PROGRAM, "--path", project, "--script", SCRIPT.name]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    result = project / "found.json"
    if not result.exists():
        raise RuntimeError(f"{SCRIPT.name} failed:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return result


def _matrices(read: Mapping[str, list]) -> np.ndarray:
    columns = np.array(read["matrices"], float).reshape(-1, len(read["joints"]), 4, 3)
    matrices = np.zeros((*columns.shape[:2], 4, 4))
    matrices[..., :3, :], matrices[..., 3, 3] = np.swapaxes(columns, -1, -2), 1.0
    return matrices


if __name__ == "__main__":
    found = faults()
    print("\n".join(found) or "no fault in Godot")
    sys.exit(bool(found))
