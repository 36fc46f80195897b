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
from pathlib import Path
from typing import Any

import environment
import numpy as np
import trained
from compare import FURTHEST

from posefield.inference import session
from posefield.motion import skeleton
from posefield.motion.clip import Clip
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.motion_question import ClipQuestion
from posefield.question.performance_question import PerformanceQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

HERE = Path(__file__).parent
ADDON = HERE.parents[1] / "clients/blender"
TIMEOUT = 900.0
MAX_FRAMES = 1000

# Facts of the driver: words that the text has, or the value.
FACTS: dict[str, Any] = {
    "drawn before": ["Model", "no model is picked"],
    "drawn after": ["stature (m)", "off by about", "captured near here"],
    "drawn labels": ["Performer", "Style"],
    "drawn outside": ["Outside: stature is 2.5", "sampled: "],
    "range": True,
    "live: objects": True,
    "live: data": [1, 1, 1],
    "no such control": ["no control is named speed; there are stature"],
    "far outside": ["(422)", "controls/turn"],
    "no such label set": ["no label set is named mood; there are "],
    "no such label": ["(422)", "did you mean 'marching'?"],
    "no such model": ["(404)", "nobody"],
    "no gait": ["no gait that travels"],
    "no script": ["no text block 'go.json', expected one of none"],
    "a bad script": ["(400)", "segments/0/kind"],
    "no JSON": ["no.json: ", "line 1"],
    "drawn refusal": ["no.json: "],
    "refused: unchanged": True,
    "repeated": True,
    "markers": ["go.json: 0 walk", "go.json: 1 hold"],
    "performed twice": 2,
    "crowd": 3,
    "nobody answers": ["no service answers at http://127.0.0.1:9"],
    "elsewhere": ["Allow Online Access"],
    "left": [],
}


def faults(version: str = environment.NEWEST) -> list[str]:
    """Return the add-on's faults in a version of Blender."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        contents = {
            "reaching": trained.family()[1],
            "stroll": trained.walk(),
            "styled": trained.styled_walk(),
        }
        (folder / "models").mkdir()
        for known, content in contents.items():
            (folder / "models" / f"{known}.onnx").write_bytes(content)
        result = _driven(environment.blender(version), folder)
        models = {
            name: Synthesizer(name, session.open_bytes(content, name))
            for name, content in contents.items()
        }
        said = json.loads(result.with_suffix(".json").read_text())
        with np.load(result) as arrays:
            found = [fault for case in said["cases"] for fault in _compared(case, arrays, models)]
    found += [
        f"{name}: {said['facts'][name]}"
        for name, expected in FACTS.items()
        if not _holds(said["facts"][name], expected)
    ]
    return [f"{version}: {fault}" for fault in found]


def _holds(fact: Any, expected: Any) -> bool:
    if isinstance(fact, str):
        return all(word in fact for word in expected)
    return bool(fact == expected)


def _driven(python: Path, folder: Path) -> Path:
    """Return the file of the driver's results in Blender, with a service of its own."""
    archive = _run(sys.executable, ADDON / "archive.py", folder).stdout.strip()
    result = folder / "result.npz"
    # Nothing of the Blender that somebody uses here is read or changed.
    told = {"BLENDER_USER_RESOURCES": str(folder / "user"), "POSEFIELD_LOG": "off"}
    service = subprocess.Popen(
        [Path(sys.executable).with_name("posefield"), "serve", folder / "models", "--port", "0"],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | told,
    )
    try:
        assert service.stdout is not None
        address = service.stdout.readline().split()[-1]
        drive = HERE / "addon_drive.py"
        _run(python, drive, archive, address, result, ADDON / "README.md", **told)
    finally:
        service.kill()
        service.wait()
    return result


def _compared(case: dict[str, Any], arrays: Any, models: dict[str, Synthesizer]) -> list[str]:
    """Return the fault of a case, and of its negative control: another question."""
    name, found = case["name"], arrays[case["name"]]
    meant = _meant(case, models, {})
    distance = _distance(case, found, meant)
    print(f"{name:<46}{distance:>10.1e} m, {len(found)} frames")
    wrong = [] if distance <= FURTHEST else [f"{name}: off by {distance:.1e} m"]
    if len(found) != len(meant):
        wrong.append(f"{name}: {len(found)} frames, expected {len(meant)}")
    if "question" in case and _distance(case, found, _meant(case, models, {"level": 2})) < FURTHEST:
        wrong.append(f"{name}: taken for another level")
    return wrong


def _distance(case: dict[str, Any], found: Any, meant: Clip) -> float:
    """Return the largest distance of a joint, m, over the frames that both have."""
    joints = [case["joints"].index(joint) for joint in meant.skeleton.names]
    positions, _ = skeleton.forward_kinematics(
        meant.skeleton.parents, meant.rotations, meant.translations
    )
    count = min(len(found), len(meant))
    apart = found[:count, :, :3, 3][:, joints] - positions[:count]
    return float(np.linalg.norm(apart, axis=-1).max())


def _meant(case: dict[str, Any], models: dict[str, Synthesizer], other: dict[str, Any]) -> Clip:
    model = models[case["model"]]
    if "script" in case:
        question = json_decoding.decode_question(PerformanceQuestion, case["script"].encode())
        return composition.perform(resolve_script(question, lambda _: model), MAX_FRAMES).clip
    return clips.synthesize_clip(model, ClipQuestion(**case["question"] | other)).clip


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
