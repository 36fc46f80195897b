"""Check of BVH files in Blender: joints are where our own kinematics has them, at the same rate."""

import subprocess
import tempfile
from pathlib import Path

import cases
import numpy as np

from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion import skeleton
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield.question.results import ClipAnswer

FURTHEST = 1e-4
"""Largest distance of a joint from its expected place, m."""


def faults(python: Path) -> list[str]:
    """Differences of a clip in Blender, with and without its scale; the latter must differ."""
    answer = plain_names(cases.answers_by_hand()[1][1])
    with tempfile.TemporaryDirectory() as name:
        joints, places, rate = _read(python, answer, Path(name))
    clip = answer.clip
    parents = clip.skeleton.parents
    meant, _ = skeleton.forward_kinematics(parents, clip.rotations, clip.translations)
    if places.shape[0] != len(meant) or rate != clip.rate:
        return [f"bvh: {len(places)} frames at {rate}, expected {len(meant)} at {clip.rate}"]
    found = places[:, [joints.index(each) for each in clip.skeleton.names]]
    apart = np.abs(found - meant).max()
    # Negative control: without the scale the joints lie elsewhere.
    if apart > FURTHEST or np.abs(100 * found - meant).max() < 1.0:
        return [f"bvh: a joint is {apart:.1e} m from its place, expected {FURTHEST}"]
    return []


def plain_names(answer: ClipAnswer) -> ClipAnswer:
    """Return the clip with names that Blender keeps as they are."""
    own = answer.clip.skeleton
    names = tuple(f"joint{number}" for number in range(len(own)))
    renamed = Skeleton(names, own.parents, own.offsets, own.tip_joints, own.tip_offsets)
    clip = answer.clip
    return ClipAnswer(Clip(renamed, clip.rotations, clip.translations, clip.rate), answer.trust)


def _read(python: Path, answer: ClipAnswer, folder: Path) -> tuple[list[str], np.ndarray, float]:
    path, result = folder / "clip.bvh", folder / "result.npz"
    path.write_bytes(CLIP_ENCODERS["bvh"].encode(answer))
    script = Path(__file__).with_name("blender_bvh_read.py")
    subprocess.run([python, script, path, result], capture_output=True, check=True)
    with np.load(result) as found:
        return found["joints"].tolist(), found["places"], float(found["rate"])
