"""Clips for the readers' tests, and an invalid clip that they must refuse."""

from pathlib import Path

import numpy as np
import trained

from posefield.encode import character
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion import clip as clips
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield.question.results import ClipAnswer, Trust

FORMATS = ("usda", "usdc", "usdz", "glb")
CONTROL = "control"
"""Name of the clip whose quaternions are written in the wrong order."""

INVALID = "invalid.glb"

WHO = "Character"
"""Name of a clip's only character."""

# Names that readers stumble over; some are alike once what is illegal is replaced.
JOINTS = [
    ("mixamorig:Hips", -1, (0.02, 0.95, 0.01)),
    ("Lower Back", 0, (0, 0.1, -0.01)),
    ("Lower-Back", 1, (0, 0.12, 0.0)),
    ("Lower_Back", 2, (0, 0.12, 0.01)),
    ("Neck", 3, (0, 0.12, 0.01)),
    ("1Head", 4, (0, 0.1, 0.02)),
    ("LHipJoint", 0, (0, 0, 0)),
    ("Left:Leg", 6, (0.1, -0.05, 0.0)),
    ("Left Leg", 7, (0.02, -0.42, 0.01)),
    ("LeftFoot", 8, (0.0, -0.4, -0.02)),
    ("RHipJoint", 0, (0, 0, 0)),
    ("RightUpLeg", 10, (-0.1, -0.05, 0.0)),
    ("RightLeg", 11, (-0.02, -0.42, 0.01)),
    ("RightFoot", 12, (0.0, -0.4, -0.02)),
    ("左腕", 3, (0.18, 0.05, 0.0)),
    ("LeftForeArm", 14, (0.28, 0.0, 0.0)),
    ("LeftHand", 15, (0.25, 0.0, 0.01)),
    ("右腕", 3, (-0.18, 0.05, 0.0)),
    ("RightForeArm", 17, (-0.28, 0.0, 0.0)),
    ("Right\\Hand", 18, (-0.25, 0.0, 0.01)),
]
TIPS = [(5, (0, 0.18, 0.02)), (9, (0, -0.08, 0.15)), (13, (0, -0.08, 0.15)), (16, (0, 0, 0))]


def answers() -> list[tuple[str, ClipAnswer]]:
    """The clips by name."""
    return [*answers_by_hand(), *trained.answers()]


def answers_by_hand() -> list[tuple[str, ClipAnswer]]:
    """Those that no model made."""
    return [
        ("film", _answer(frames=45, rate=29.97)),
        ("fast", _answer(frames=100, rate=60.0)),
        ("pose", _answer(frames=1, rate=30.0)),
    ]


def write(folder: Path) -> dict[str, dict[str, Path]]:
    """Every clip and the control in every format that the readers read, and by file name and
    character what to expect of it."""
    given = answers()
    control = given[0][1]
    expected = {}
    for name, written, meant in (
        *((name, answer, answer) for name, answer in given),
        (CONTROL, _swapped(control), control),
    ):
        found = matrices_of(meant.clip)
        for extension in FORMATS:
            path = folder / f"{name}.{extension}"
            path.write_bytes(CLIP_ENCODERS[extension].encode(written))
            expectation = folder / f"{path.name}.npz"
            np.savez(expectation, **found | {"joints": _names(meant.clip, extension)})
            expected[path.name] = {WHO: expectation}
    return expected


def write_invalid(folder: Path) -> str:
    """Name of a glTF file whose quaternions are no rotations."""
    clip, trust = (made := answers_by_hand()[0][1]).clip, made.trust
    longer = Clip(clip.skeleton, 1.1 * clip.rotations, clip.translations, clip.rate)
    (folder / INVALID).write_bytes(CLIP_ENCODERS["glb"].encode(ClipAnswer(longer, trust)))
    return INVALID


def person() -> Skeleton:
    """A person whose joints have those names."""
    leaves, parents, offsets = zip(*JOINTS, strict=True)
    joints, arms = zip(*TIPS, strict=True)
    return Skeleton(leaves, parents, np.array(offsets, float), joints, np.array(arms, float))


def matrices_of(clip: Clip) -> dict[str, np.ndarray]:
    """Joint names in the file and matrices (F, J, 4, 4) in the world, for column vectors, m."""
    parents = clip.skeleton.parents
    positions, turns = skeleton.forward_kinematics(parents, clip.rotations, clip.translations)
    matrices = np.zeros((*positions.shape[:-1], 4, 4))
    matrices[..., :3, :3], matrices[..., :3, 3] = quat.to_matrix(turns), positions
    matrices[..., 3, 3] = 1.0
    return {"joints": np.array(character.legal_names(clip.skeleton.names)), "matrices": matrices}


def _names(clip: Clip, extension: str) -> np.ndarray:
    """Return the joint names in a format: glTF allows any names."""
    own = clip.skeleton.names
    return np.array(own if extension == "glb" else character.legal_names(own))


def _answer(frames: int, rate: float) -> ClipAnswer:
    rng = np.random.default_rng(7)
    somebody = person()
    t = np.arange(frames) / rate
    phases = rng.uniform(0, 2 * np.pi, (len(somebody), 3))
    turns = quat.exp(0.6 * np.sin(2 * np.pi * t[:, None, None] + phases))
    path = np.stack([0.3 * np.sin(t), 0.9 + 0.05 * np.cos(5 * t), 1.2 * t], axis=-1)
    made = clips.assemble(somebody, turns, path, 1.07 * somebody.offsets, rate)
    return ClipAnswer(made, Trust("hand@0", {"speed": 1.0}, None, 0, made.duration, 0.01, True, ()))


def _swapped(answer: ClipAnswer) -> ClipAnswer:
    clip = answer.clip
    rotations = np.roll(clip.rotations, 1, axis=-1)
    return ClipAnswer(Clip(clip.skeleton, rotations, clip.translations, clip.rate), answer.trust)
