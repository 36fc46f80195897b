"""VRM animations on avatars: three-vrm moves avatars of other proportions as the motions move.

Each avatar is a VRM 1.0 file made here, without a mesh, whose nodes rest in random orientations.
"""

import json
import struct
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import environment
import numpy as np

import posefield
from posefield.motion import quat

HERE = Path(__file__).parent
PACKAGES = ("three@0.180.0", "@pixiv/three-vrm@3.5.5", "@pixiv/three-vrm-animation@3.5.5")
CLIPS: dict[str, dict[str, Any]] = {
    "cmu_walk": {"speed": 1.3, "turn": 0.0},
    "hdm05_kick": {},
    "hdm05_squat": {},
    "hdm05_deposit_floor": {},
}
CONTROL = "control"
"""Name of the walk whose nodes rest as the motion does, in no T-pose."""
# Heights, and x and heights on the left, of the bones of an avatar that faces +Z in a T-pose, m.
TRUNK = {"hips": 0.65, "spine": 0.72, "chest": 0.8, "upperChest": 0.88, "neck": 1.0, "head": 1.06}
ARM = {
    "Shoulder": (0.03, 0.95),
    "UpperArm": (0.1, 0.95),
    "LowerArm": (0.3, 0.95),
    "Hand": (0.5, 0.95),
}
LEG = {"UpperLeg": (0.07, 0.62), "LowerLeg": (0.07, 0.34), "Foot": (0.07, 0.06)}
SIDES = {"left": 1.0, "right": -1.0}
LIMBS = [
    (side + upper, side + lower)
    for side in SIDES
    for chain in (("UpperArm", "LowerArm", "Hand"), ("UpperLeg", "LowerLeg", "Foot"))
    for upper, lower in pairwise(chain)
]
# Joints between the bones of the motion, such as wrists, turn the way to the next by hundredths.
CLOSE = 0.1
"""Largest angle between bones of avatar and motion, degrees."""


def bones() -> dict[str, tuple[str | None, np.ndarray]]:
    """Parent and place of each bone of the avatar, parents first."""
    names = [None, *TRUNK]
    found: dict[str, tuple[str | None, np.ndarray]] = {
        name: (above, np.array([0.0, TRUNK[name], 0.0]))
        for above, name in zip(names, TRUNK, strict=False)
    }
    for side, sign in SIDES.items():
        for start, limb in (("upperChest", ARM), ("hips", LEG)):
            above = start
            for bone, (x, height) in limb.items():
                found[side + bone] = (above, np.array([sign * x, height, 0.0]))
                above = side + bone
        found[side + "Toes"] = (side + "Foot", np.array([sign * 0.07, 0.01, 0.1]))
    return found


def avatar(rng: np.random.Generator) -> bytes:
    """A VRM 1.0 file whose nodes rest in random orientations."""
    nodes: list[dict[str, Any]] = []
    numbers: dict[str | None, int] = {}
    turns = {None: quat.IDENTITY}
    places = {None: np.zeros(3)}
    for name, (above, place) in bones().items():
        turns[name], places[name] = quat.normalize(rng.normal(size=4)), place
        local = quat.mul(quat.conj(turns[above]), turns[name])[[1, 2, 3, 0]]
        offset = quat.rotate(quat.conj(turns[above]), place - places[above])
        node = {"name": name, "translation": offset.tolist(), "rotation": local.tolist()}
        numbers[name] = len(nodes)
        nodes.append(node)
        if above is not None:
            nodes[numbers[above]].setdefault("children", []).append(numbers[name])
    meta = {
        "name": "plain",
        "authors": ["posefield"],
        "licenseUrl": "https://vrm.dev/licenses/1.0/",
    }
    humanoid = {"humanBones": {name: {"node": number} for name, number in numbers.items()}}
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["VRMC_vrm"],
        "extensions": {"VRMC_vrm": {"specVersion": "1.0", "meta": meta, "humanoid": humanoid}},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<5L", 0x46546C67, 2, 20 + len(text), len(text), 0x4E4F534A) + text


def at_identity(content: bytes) -> bytes:
    """The same animation with nodes that rest without rotations, as the motion does."""
    length = struct.unpack_from("<L", content, 12)[0]
    document = json.loads(content[20 : 20 + length])
    for node in document["nodes"]:
        node.pop("rotation", None)
    text = json.dumps(document, separators=(",", ":")).encode()
    return content[:20] + text.ljust(length) + content[20 + length :]


def play(folder: Path, node: Path, npm: Path) -> tuple[dict[str, Any], dict[str, posefield.Clip]]:
    """Places of bones in each frame as three-vrm has them, by file, and the clips."""
    rng = np.random.default_rng(3)
    clips = {name: posefield.load(name).clip(**controls) for name, controls in CLIPS.items()}
    for name, clip in clips.items():
        clip.save(folder / f"{name}.vrma")
        (folder / f"{name}.vrm").write_bytes(avatar(rng))
    (folder / f"{CONTROL}.vrma").write_bytes(at_identity((folder / "cmu_walk.vrma").read_bytes()))
    (folder / f"{CONTROL}.vrm").write_bytes((folder / "cmu_walk.vrm").read_bytes())
    clips[CONTROL] = clips["cmu_walk"]
    modules = environment.modules(environment.ROOT / "build/vrm", PACKAGES, node, npm)
    result = folder / "result.json"
    subprocess.run([node, HERE / "vrma_read.mjs", modules, folder, result], check=True)
    return json.loads(result.read_text()), clips


def angles(
    frames: Sequence[Mapping[str, Sequence[float]]], clip: posefield.Clip
) -> dict[str, float]:
    """Largest angle, degrees, between each bone of arms and legs of the avatar and the motion."""
    positions, roles = clip.clip.positions(), clip.clip.roles
    found = {}
    for upper, lower in LIMBS:
        motion = positions[:, roles[lower]] - positions[:, roles[upper]]
        avatars = np.array([np.subtract(frame[lower], frame[upper]) for frame in frames])
        crosses = np.linalg.norm(np.cross(motion, avatars), axis=-1)
        dots = np.sum(motion * avatars, axis=-1)
        found[upper] = float(np.degrees(np.arctan2(crosses, dots)).max())
    return found


def faults(node: Path, npm: Path) -> list[str]:
    """Return the faults of three-vrm's avatars, a line each."""
    with tempfile.TemporaryDirectory() as name:
        readings, clips = play(Path(name), node, npm)
        return [*_compared(readings, clips)]


def _compared(readings: Mapping[str, Any], clips: Mapping[str, posefield.Clip]) -> Iterator[str]:
    print(f"{'avatar':<22}{'bones off, degrees':>20}{'hips off, mm':>14}")
    for name, clip in clips.items():
        frames = readings[f"{name}.vrma"]["frames"]
        if len(frames) != len(clip.clip):
            yield f"{name}.vrma: {len(frames)} frames, expected {len(clip.clip)}"
            continue
        largest = max(angles(frames, clip).values())
        hips, path = np.array([frame["hips"] for frame in frames]), clip.clip.root_path
        # Hips travel in proportion to their height at rest.
        scale = np.linalg.norm(hips[-1] - hips[0]) / np.linalg.norm(path[-1] - path[0])
        off = 1000.0 * float(np.abs(hips - hips[0] - scale * (path - path[0])).max())
        print(f"{name:<22}{largest:>20.4f}{off:>14.4f}")
        if name == CONTROL and largest < 15.0:
            yield f"{name}.vrma: a file in no T-pose is off by {largest:g} degrees only"
        if name != CONTROL and (largest > CLOSE or off > 0.1 or not 0.4 < scale < 0.8):
            yield f"{name}.vrma: bones off by {largest:g} degrees, hips by {off:g} mm, x {scale:g}"


if __name__ == "__main__":
    print("\n".join(faults(*environment.node())) or "no fault in avatars")
