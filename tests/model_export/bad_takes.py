"""Motion files with faults, for tests of what is read, noted and refused."""

from dataclasses import replace

import numpy as np
import rigid_takes
from exported_clips import encoded
from gltf_files import GltfFile

from posefield.motion import bvh_writer, quat

CENTIMETRES = 0.01
FAR_AWAY = 5
"""Frames that a fault takes."""


def good(seed=20):
    """A recording like those of `rigid_takes.write_takes`, of a third order of motions."""
    return rigid_takes.clip("FSSFSF", seed)


def bvh(clip, metres_per_unit=CENTIMETRES):
    """A clip as a BVH file."""
    return bvh_writer.dumps(clip, metres_per_unit=metres_per_unit)


def moved(clip, rotations=None, translations=None):
    """A clip with other rotations or translations."""
    return replace(
        clip,
        rotations=clip.rotations if rotations is None else rotations,
        translations=clip.translations if translations is None else translations,
    )


def rest_first():
    """A recording that begins with arms forward, after a frame in which all joints rest."""
    clip = good(21)
    turns = clip.rotations.copy()
    arm_forward = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(-1.2))
    left = clip.skeleton.names.index("LeftArm")
    turns[1:, left] = arm_forward
    return moved(clip, turns)


def dropped():
    """A recording in which a frame of a fast motion stands in place of those after it."""
    clip = good(22)
    speed = np.abs(np.diff(clip.rotations, axis=0)).sum(axis=(1, 2))
    at = int(np.argmax(speed))
    turns, places = clip.rotations.copy(), clip.translations.copy()
    turns[at : at + FAR_AWAY], places[at : at + FAR_AWAY] = turns[at], places[at]
    return moved(clip, turns, places)


def leaping():
    """A recording in which a hand is elsewhere for some frames, as of swapped markers."""
    clip = good(23)
    places = clip.translations.copy()
    hand = clip.skeleton.names.index("RightHand")
    places[200 : 200 + FAR_AWAY, hand] += [0.0, 0.6, 0.0]
    return moved(clip, translations=places)


def mirrored(clip):
    """The mirror image of a recording, with the names of the sides swapped."""
    names = clip.skeleton.names
    swap = {"Left": "Right", "Right": "Left"}
    other = [
        names.index(next((swap[s] + n.removeprefix(s) for s in swap if n.startswith(s)), n))
        for n in names
    ]
    turns = clip.rotations[:, other] * [1.0, 1.0, -1.0, -1.0]
    return moved(clip, turns, clip.translations[:, other] * [-1.0, 1.0, 1.0])


def one_frame():
    """A recording of a single frame."""
    clip = good()
    return moved(clip, clip.rotations[:1], clip.translations[:1])


def without_legs():
    """The file of a body with tentacles."""
    text = bvh(good(24)).decode()
    for name in ("UpLeg", "Leg", "Foot", "ToeBase"):
        text = text.replace(f"Left{name}", f"a{name[0]}1").replace(f"Right{name}", f"b{name[0]}2")
    return text.encode()


def z_up():
    """The file of a recording in a world whose z is up."""
    clip = good(25)
    turned = clip.rotations[..., [0, 1, 3, 2]] * [1.0, 1.0, -1.0, 1.0]
    places = clip.translations[..., [0, 2, 1]] * [1.0, -1.0, 1.0]
    bones = clip.skeleton
    offsets, tips = (own[:, [0, 2, 1]] * [1, -1, 1] for own in (bones.offsets, bones.tip_offsets))
    own = replace(bones, offsets=offsets, tip_offsets=tips)
    return bvh(replace(clip, skeleton=own, rotations=turned, translations=places))


def without_skeleton():
    """A GLB file in which a box moves."""
    times = np.arange(13) / 30.0
    turns = quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), times)
    file = GltfFile([{"name": "box"}])
    return file.animate((0, "rotation", times, turns[:, [1, 2, 3, 0]], "LINEAR")).glb()


def contents():
    """Return the files of a folder with faults, by name, and what is said of each.

    A text that begins with "note: " is of a file that is searched all the same.
    """
    text = bvh(good()).decode()
    head, numbers = text.split("Frame Time", 1)
    copied = good(26)
    return {
        "empty.bvh": (b"", "expected"),
        "cut.bvh": (text[: len(text) // 2].encode(), "expected"),
        "nan.bvh": (
            f"{head}Frame Time{numbers.replace('92.0', 'nan', 1)}".encode(),
            "expected a number",
        ),
        "one_frame.bvh": (bvh(one_frame()), "1 frame, expected a motion"),
        "no_legs.bvh": (without_legs(), "no joint for"),
        "metres.bvh": (bvh(good(27), 1.0), "search files of one unit together"),
        "z_up.bvh": (z_up(), "search files of one up axis together"),
        "other_format.glb": (encoded(good(28), "glb"), "search files of one unit together"),
        "box.glb": (without_skeleton(), "without a skeleton"),
        "broken.usda": (b"#usda 1.0\n(", "does not open as USD"),
        "scene.fbx": (b"Kaydara", "posefield convert"),
        "rest_first.bvh": (bvh(rest_first()), "note: frame 0 is the rest pose"),
        "dropped.bvh": (bvh(dropped()), "note: 4 frames repeated while the body moves"),
        "leaping.bvh": (bvh(leaping()), "note: 2 leaps, rightHand by 0.6"),
        "copied.bvh": (bvh(copied), ""),
        "copied_again.bvh": (
            bvh(moved(copied, copied.rotations[90:], copied.translations[90:])),
            "note: copied_again.bvh shares frames with copied.bvh",
        ),
        "mirrored.bvh": (bvh(mirrored(copied)), "note: mirrored.bvh mirrors copied.bvh"),
    }
