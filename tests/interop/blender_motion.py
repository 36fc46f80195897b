"""Check of the readers of motion files: what Blender writes as FBX, glTF and USD is read alike."""

import subprocess
import tempfile
from pathlib import Path

import blender_bvh
import cases
import numpy as np

from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion.clip import Clip
from posefield.question.results import ClipAnswer
from posefield_train.convert import converted_file

FURTHEST = 5e-4
"""Largest distance of a joint from its expected place, m."""

TURNED = 1e-6
"""Largest difference of 1 from the product of two quaternions that are the same rotation."""


def faults(python: Path) -> list[str]:
    """Differences of a clip that Blender read and wrote; without its root's path it must differ."""
    answer = blender_bvh.plain_names(cases.answers_by_hand()[1][1])
    clip = answer.clip
    with tempfile.TemporaryDirectory() as name:
        found = _written(python, answer, Path(name))
    wrong = [f"{file}: {said}" for file, own in found.items() if (said := _fault(own, clip))]
    still = Clip(clip.skeleton, clip.rotations, 0.0 * clip.translations, clip.rate)
    return wrong or [f"{file}: no fault" for file, own in found.items() if not _fault(own, still)]


def _written(python: Path, answer: ClipAnswer, folder: Path) -> dict[str, Clip]:
    """The clips of the files that Blender writes, by their names."""
    source = folder / "clip.glb"
    source.write_bytes(CLIP_ENCODERS["glb"].encode(answer))
    script = Path(__file__).with_name("blender_motion_write.py")
    words = [python, script, source, str(answer.clip.rate), folder]
    subprocess.run(words, capture_output=True, check=True)
    return {
        file: converted_file.convert(folder / file, blender=python).clip
        for file in ("blender.fbx", "blender.glb", "blender.usdc")
    }


def _fault(found: Clip, clip: Clip) -> str:
    if (len(found), found.rate) != (len(clip), clip.rate):
        return f"{len(found)} frames at {found.rate}, expected {len(clip)} at {clip.rate}"
    order = [found.skeleton.names.index(name) for name in clip.skeleton.names]
    apart = np.abs(found.positions()[:, order] - clip.positions()).max()
    print(f"joints of another writer are {apart:.1e} m from their places")
    if apart > FURTHEST:
        return f"a joint is {apart:.1e} m from its place"
    # The rest pose is that of the clip, whose rotations are the identity, not Blender's bones.
    turned = 1.0 - np.abs(np.sum(found.rotations[:, order] * clip.rotations, axis=-1)).min()
    return f"a rotation has a cosine of 1 - {turned:.1e}" if turned > TURNED else ""
