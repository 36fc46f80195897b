"""Test of the Blender add-on in Blender against the kinematics of this project.

    .venv/bin/python tests/interop/addon.py

Every joint of every frame must be at the model's position; each row has a control row, whose frames
must differ from those of another request.
"""

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import addon_facts
import environment
import numpy as np
import trained
from compare import FURTHEST, TURNED

from posefield.inference import session
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip, assemble
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.motion_question import ClipQuestion
from posefield.question.performance_question import PerformanceQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
ADDON = ROOT / "clients/blender"
TIMEOUT = 900.0
MAX_FRAMES = 1000

WALK = "cmu_walk"

Models = dict[str, tuple[Synthesizer, bytes]]


@dataclass(frozen=True)
class Row:
    """Largest differences of the joints; within tolerance just where `meant`."""

    name: str
    metres: float
    turn: float
    meant: bool

    @property
    def good(self) -> bool:
        """Return whether it is as `meant`."""
        return (self.metres <= FURTHEST and self.turn <= TURNED) == self.meant


def faults(version: str = environment.NEWEST) -> list[str]:
    """Return the add-on's faults in a version of Blender."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        models = _models()
        (folder / "models").mkdir()
        for known, (_, content) in models.items():
            (folder / "models" / f"{known}.onnx").write_bytes(content)
        archive = _built(folder)
        driven = _driven(environment.blender(version), archive, folder, models)
        return [f"{version}: {fault}" for fault in _of(version, driven, models)]


def _models() -> Models:
    """By name: the procedural family, the procedural walks, and a real one if there is any."""
    found = {
        "reaching": trained.family()[1],
        "stroll": trained.walk(),
        WALK: trained.real(WALK),
        "styled": trained.styled_walk(),
    }
    return {
        name: (Synthesizer(name, session.open_bytes(content, name)), content)
        for name, content in found.items()
        if content is not None
    }


def _built(folder: Path) -> Path:
    done = _run(sys.executable, ADDON / "archive.py", folder)
    return Path(done.stdout.strip())


def _driven(python: Path, archive: Path, folder: Path, models: Models) -> dict[str, Any]:
    """Return the add-on's results in one Blender, with a service of its own."""
    result = folder / f"{python.parents[1].name}.npz"
    # Nothing of the Blender that somebody uses here is read or changed.
    told = {"BLENDER_USER_RESOURCES": str(folder / python.parents[1].name), "POSEFIELD_LOG": "off"}
    service = subprocess.Popen(
        [Path(sys.executable).with_name("posefield"), "serve", folder / "models", "--port", "0"],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | told,
    )
    try:
        assert service.stdout is not None
        address = service.stdout.readline().split()[-1]
        walks = json.dumps(
            [_walk(name, models[name][0]) for name in ("stroll", WALK) if name in models]
        )
        given = (archive, address, str(service.pid), result, ADDON / "README.md", walks)
        _run(python, HERE / "addon_drive.py", *given, **told)
    finally:
        service.kill()
        service.wait()
    said: dict[str, Any] = json.loads(result.with_suffix(".json").read_text())
    with np.load(result) as found:
        return said | {"arrays": dict(found)}


def _walk(name: str, model: Synthesizer) -> list[Any]:
    """A model of a gait, one of its performers, and controls at which it goes straight on."""
    performer = model.session.card.performers[0]
    return [name, performer, {"veer": 0.0} if name == "stroll" else {}]


def _of(version: str, driven: dict[str, Any], models: Models) -> list[str]:
    rows = [row for case in driven["cases"] for row in _rows(case, driven["arrays"], models)]
    for row in rows:
        result = ("ok" if row.good else "FAILED") + ("" if row.meant else " (not to be taken for)")
        print(f"{version:<8}{row.name:<46}{row.metres:>10.1e}{row.turn:>10.1e}  {result}")
    print(f"{sum(row.good for row in rows)} of {len(rows)} as expected")
    facts = driven["facts"]
    seconds = facts["seconds to the last of forty moves"]
    print(f"{version:<8}the last of forty moves of a slider shows after {seconds:.2f} s")
    wrong = [f"{row.name}: {row.metres:.1e} m" for row in rows if not row.good]
    return wrong + addon_facts.faults(facts)


def _rows(case: dict[str, Any], arrays: dict[str, Any], models: Models) -> list[Row]:
    name, wrong = case["name"], case["wrong"]
    made = _Expected(case, arrays[f"{name}/offsets"], models[case["model"]][0])
    found = arrays[f"{name}/matrices"]
    alike = not name.endswith("on purpose") and not (case.get("body") == "armature" and not wrong)
    rows = [_row(name, found, made.of({}), case, alike)]
    if wrong:
        rows.append(_row(f"{name}: other {next(iter(wrong))}", found, made.of(wrong), case, False))
    return rows


def _row(name: str, found: Any, meant: Clip, case: dict[str, Any], right: bool) -> Row:
    """Joints and matrices (F, J, 4, 4) against those of a clip, which where right is as long."""
    joints = [case["joints"].index(joint) for joint in meant.skeleton.names]
    if right and len(found) != len(meant):
        return Row(name, np.inf, np.inf, right)
    positions, turns = skeleton.forward_kinematics(
        meant.skeleton.parents, meant.rotations, meant.translations
    )
    frames = min(len(found), len(meant))
    found = found[:frames, joints]
    metres = np.linalg.norm(found[..., :3, 3] - positions[:frames], axis=-1).max()
    turn = np.abs(found[..., :3, :3] - quat.to_matrix(turns[:frames])).max()
    return Row(name, metres, turn, right)


@dataclass(frozen=True)
class _Expected:
    """Expected clip of a case, or of another question or body."""

    case: dict[str, Any]
    offsets: Any
    model: Synthesizer

    def of(self, other: dict[str, Any]) -> Clip:
        """The clip as asked, but for what is other."""
        script = other.get("script", self.case.get("script"))
        if script is not None:
            return self._on(self.case["body"], self._performed(script))
        question = dict(self.case["question"])
        body = other.get("body", self.case.get("body", "clip"))
        changed = {key: value for key, value in other.items() if key != "body"}
        if "controls" in changed:
            changed["controls"] = question["controls"] | changed["controls"]
        clip = clips.synthesize_clip(self.model, ClipQuestion(**question | changed)).clip
        return self._on(body, _cycles(clip, self.case.get("cycles", 1)))

    def _performed(self, script: dict[str, Any]) -> Clip:
        content = json.dumps(script).encode()
        asked = json_decoding.decode_question(PerformanceQuestion, content)
        resolved = resolve_script(asked, lambda _: self.model)
        return composition.perform(resolved, MAX_FRAMES).clip

    def _on(self, body: str, clip: Clip) -> Clip:
        if body == "clip":
            return clip
        joints = [self.case["joints"].index(joint) for joint in clip.skeleton.names]
        return assemble(
            clip.skeleton, clip.rotations, clip.root_path, self.offsets[joints], clip.rate
        )


def _cycles(clip: Clip, times: int) -> Clip:
    """A loop several times over, each from where the last has led."""
    step = clip.translations[-1] - clip.translations[0]
    rotations = [clip.rotations, *[clip.rotations[1:]] * (times - 1)]
    moved = [clip.translations, *(clip.translations[1:] + n * step for n in range(1, times))]
    return replace(clip, rotations=np.concatenate(rotations), translations=np.concatenate(moved))


def _run(*command: str | Path, **told: str) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        command, capture_output=True, text=True, env=os.environ | told, timeout=TIMEOUT
    )
    if done.returncode:
        sys.exit(f"{command[1]} failed:\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")
    return done


if __name__ == "__main__":
    found = faults()
    print("\n".join(found) or "no fault in the add-on")
    sys.exit(bool(found))
