"""Forms of crowds in USD, and sizes before one is encoded: of its file and of its largest layer.

usd-core holds a layer in memory until it has been exported. The constants of characters are sizes
in memory, which are many times those in binary files (decision 0029).
"""

from dataclasses import dataclass

from posefield.common.errors import InvalidField
from posefield.encode import archives
from posefield.motion.clip import CrowdClip

INSTANCING = ("references", "scenegraph", "flatten")
"""Ways in which the characters of a crowd share data, for different readers.

references: every character refers to one prototype; the only form of sharing that is animated both
by Blender's default import and by pxr. scenegraph: the same, instanceable: fastest to draw and to
open; Blender's default import shows it as one character frozen in its rest pose. flatten: all data
are copied into one layer, for readers without composition.
"""
FILES, STREAMS = ("usd", "usda", "usdc", "usdz"), ("usda", "usdc", "usdz")
"""Extensions of crowds on disk, and of those that are a single file and can be streamed."""

# Bytes of a character that refers to the prototype, of one with its own skeleton and body, and of a
# motion without its frames.
CHARACTER, FLAT, MOTION = 2_600, 40_000, 8_000
# Bytes of a pose, and of each of its joints: seven numbers.
POSE, JOINT = 40, 4 * (3 + 4)
# Bytes of a point of a body, of which a binary file has one, and of a point as text.
POINT, TEXT_POINT = 60, 220
# Bytes of a joint of a pose, and of a joint of a skeleton at rest, as text.
TEXT_JOINT, TEXT_REST = 120, 600
# Bytes of a blend shape of a body in memory and as text, and of a weight in a frame.
SHAPE, TEXT_SHAPE, WEIGHT, TEXT_WEIGHT = 3_000, 500, 4, 20


@dataclass(frozen=True)
class CrowdCounts:
    """Number of joints, characters, motions, frames of each, points of a body, and curves."""

    joints: int
    characters: int
    motions: int
    frames: int
    points: int
    curves: int = 0


def file_size_bound(counts: CrowdCounts, ending: str, flat: bool) -> int:
    """Return an upper bound of the bytes of a crowd as usda, usdc or usdz."""
    body = POINT * counts.points + SHAPE * counts.curves
    binary = body + _characters(counts, flat) + counts.motions * _motion(counts)
    if ending != "usda":
        return binary
    played = counts.characters if flat else counts.motions
    pose = TEXT_JOINT * (counts.joints + 1) + TEXT_WEIGHT * counts.curves
    text = pose * counts.frames * played
    rest = TEXT_REST * counts.joints + TEXT_POINT * counts.points + TEXT_SHAPE * counts.curves
    return max(binary, text) + (counts.characters if flat else 1) * rest


# Bytes of a joint of a pose in tables of bones and OSI traces, and of the rest of a pose in them.
BONE_SIZES = {"npz": JOINT, "bones.npz": 56, "arrow": 56, "osi": 400, "carla.npz": 56}
POSE_SIZE = 800


def table_size_bound(counts: CrowdCounts, ending: str) -> int:
    """Return an upper bound of the bytes of a crowd in a format besides USD."""
    pose = POSE_SIZE + WEIGHT * counts.curves + BONE_SIZES[ending] * counts.joints
    return MOTION * counts.characters + counts.frames * counts.characters * pose


def layer_size_bound(counts: CrowdCounts, ending: str, flat: bool) -> int:
    """Return an upper bound of the bytes of the largest layer of a crowd."""
    if ending == "usdz" and not flat:
        body = POINT * counts.points + SHAPE * counts.curves
        return max(_characters(counts, flat), _motion(counts), body)
    return file_size_bound(counts, ending, flat)


def _characters(counts: CrowdCounts, flat: bool) -> int:
    return counts.characters * (FLAT + SHAPE * counts.curves if flat else CHARACTER)


def _motion(counts: CrowdCounts) -> int:
    return MOTION + counts.frames * (POSE + JOINT * counts.joints + WEIGHT * counts.curves)


def motion_count(crowd: CrowdClip) -> int:
    """Return the number of motions that the characters play."""
    return int(crowd.motion.max()) + 1


# Bytes of a character in the entry of a crowd of many layers, and of the rest of entry and body.
REFERENCE, REST = 2_000, 100_000
# Of a curve: a weight in a frame with its share of the head; its name in a layer; its blend shape.
HEADED_WEIGHT, CURVE_NAME, PLAIN_SHAPE = 12, 200, 1_000


def archive_size_bound(crowd: CrowdClip) -> int:
    """Return an upper bound of the bytes of all layers."""
    curves = len(crowd.curves)
    frame = POSE + JOINT * len(crowd.skeleton) + HEADED_WEIGHT * curves
    layer = MOTION + CURVE_NAME * curves + crowd.frames * frame
    return REST + PLAIN_SHAPE * curves + motion_count(crowd) * layer + len(crowd.motion) * REFERENCE


def check_archive_size(crowd: CrowdClip) -> None:
    """Raise InvalidField if an archive of the crowd could exceed the limits of a zip."""
    size, members = archive_size_bound(crowd), motion_count(crowd) + 3
    if size > archives.BYTES or members > archives.MEMBERS:
        sizes = f"{size / 1e9:.1f} GB in {members} layers"
        expected = f"{archives.BYTES / 1e9:.1f} GB in {archives.MEMBERS}"
        raise InvalidField("format", f"{sizes}, expected at most {expected} in a usdz; take usd")
