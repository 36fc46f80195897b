"""BVH writer: a clip to the bytes of a file that all BVH readers interpret alike."""

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common.units import Bones, Floats, Vector
from posefield.motion import joint_roles, quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton

WORD = re.compile(r"[^\s{}]+", re.ASCII)
"""Only ASCII blanks separate words: the ideographic space belongs to a Japanese name."""
BLANKS = re.compile(r"[\s{}]+")

AXES = "ZYX"
ROTATIONS = "Zrotation Yrotation Xrotation"
POSITIONS = "Xposition Yposition Zposition"
CONSTANT_TOLERANCE = 1e-9
"""Largest variation, m, of a translation that is written as OFFSET, without channels."""

MAX_STEPS = 1e18
LENGTH_STEP = 1e-8
MIN_DECIMALS = 7
"""Step of written lengths in metres, and digits of an angle in degrees.

Six digits hold each joint within 1e-6, but not the hand at the end of a chain: its error is the sum
of all roundings before it, each turned into a length by the arm behind it.
"""


def dumps(clip: Clip, *, metres_per_unit: float) -> bytes:
    """Return the clip as a BVH file, in degrees and the given unit, with joints depth first.

    Blanks and braces in names become underscores: many readers end a name at its first blank. The
    root, and a joint whose translation varies, have six channels and an OFFSET of zero, since
    readers differ on whether channels replace or follow it; others have three. A leaf without an
    end site gets one of zero length, which other readers require. Readers recover the exact rate
    where it lies within 1e-4 of a whole or broadcast rate. Raises ValueError for numbers that are
    not finite.
    """
    if not (np.isfinite(metres_per_unit) and metres_per_unit > 0):
        raise ValueError(f"metres_per_unit {metres_per_unit}, expected a positive number")
    if not all(np.all(np.isfinite(values)) for values in (clip.rotations, clip.translations)):
        raise ValueError("rotations or translations that are not finite, expected numbers")
    sheet = BvhLayout(clip, metres_per_unit)
    header = f"MOTION\nFrames: {len(clip)}\nFrame Time: {1.0 / clip.rate:.10g}\n"
    return ("HIERARCHY\n" + sheet.hierarchy() + header).encode() + sheet.motion_lines()


@dataclass(frozen=True)
class BvhLayout:
    """Clip laid out as the sections of a BVH file."""

    clip: Clip
    metres_per_unit: float

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Return the names of the joints, each one word."""
        return joint_roles.clean_names(
            self.clip.skeleton.names, lambda name: BLANKS.sub("_", name) or "_"
        )

    @cached_property
    def has_position_channels(self) -> list[bool]:
        """Return whether each joint has position channels."""
        spread = np.ptp(self.clip.translations, axis=0).max(axis=-1)
        return [True, *(spread[1:] > CONSTANT_TOLERANCE).tolist()]

    @cached_property
    def offsets(self) -> Bones:
        """Return the mean translations (J, 3) from parents, m; zero with position channels."""
        offsets = self.clip.translations.mean(axis=0)
        offsets[self.has_position_channels] = 0.0
        return offsets

    def hierarchy(self) -> str:
        """Return the lines of all joints, from the root to its closing brace."""
        lines: list[str] = []
        levels: list[int] = []
        for joint, level in depth_first(self.clip.skeleton):
            while levels and levels[-1] >= level:
                lines.append("\t" * levels.pop() + "}")
            lines += ["\t" * level + line for line in self.joint_lines(joint)]
            levels.append(level)
        lines += ["\t" * level + "}" for level in reversed(levels)]
        return "\n".join(lines) + "\n"

    def joint_lines(self, joint: int) -> list[str]:
        """Return the lines of one joint and its end sites, without children and closing brace."""
        channels = (
            f"6 {POSITIONS} {ROTATIONS}" if self.has_position_channels[joint] else f"3 {ROTATIONS}"
        )
        lines = [
            f"{'JOINT' if joint else 'ROOT'} {self.names[joint]}",
            "{",
            f"\tOFFSET {self.format_lengths(self.offsets[joint])}",
            f"\tCHANNELS {channels}",
        ]
        for tip in self.end_sites(joint):
            lines += ["\tEnd Site", "\t{", f"\t\tOFFSET {self.format_lengths(tip)}", "\t}"]
        return lines

    def end_sites(self, joint: int) -> list[Vector]:
        """Return the offsets of the joint's end sites; one of zero length for a bare leaf."""
        sites = zip(self.clip.skeleton.tip_joints, self.clip.skeleton.tip_offsets, strict=True)
        tips = [offset for owner, offset in sites if owner == joint]
        return tips if tips or joint in self.clip.skeleton.parents else [np.zeros(3)]

    def format_lengths(self, metres: Vector) -> str:
        """Return three lengths as text, in the unit of the file."""
        # Without a negative zero.
        lengths = np.round(metres / self.metres_per_unit, self.decimals) + 0.0
        return " ".join(f"{length:.{self.decimals}f}" for length in lengths.tolist())

    @property
    def decimals(self) -> int:
        """Return the digits after the decimal point: more for a unit above a decimetre."""
        return max(MIN_DECIMALS, int(np.ceil(np.log10(self.metres_per_unit / LENGTH_STEP))))

    def motion_lines(self) -> bytes:
        """Return the motion lines, one per frame."""
        angles = np.rad2deg(unwrap_euler(quat.to_euler(self.clip.rotations, AXES)))
        lengths = self.clip.translations / self.metres_per_unit
        blocks = []
        for joint, _ in depth_first(self.clip.skeleton):
            blocks += [lengths[:, joint]] if self.has_position_channels[joint] else []
            blocks.append(angles[:, joint])
        return format_numbers(np.concatenate(blocks, axis=1), self.decimals)


def format_numbers(values: Annotated[Floats, "rows columns"], decimals: int) -> bytes:
    """Return numbers (rows, columns) as text with fixed decimals and without a negative zero.

    The same bytes as %f in a fifth of the time: the digits of all numbers are computed at once, one
    decimal place at a time from the last; unused places are zero bytes, which are removed at the
    end. Raises ValueError for numbers of more digits than 64 bits hold.
    """
    scaled = np.rint(np.abs(values) * 10.0**decimals)
    if scaled.max() > MAX_STEPS:
        raise ValueError(f"numbers of up to {np.abs(values).max():g}, expected fewer digits")
    steps = scaled.astype(np.int64)
    digits = max(len(str(steps.max())), decimals + 1)
    text = np.zeros((*values.shape, digits + 3), np.uint8)
    text[..., 0] = np.where((values < 0.0) & (steps > 0), ord("-"), 0)
    text[..., -decimals - 2], text[..., -1], text[:, -1, -1] = b". \n"
    rest = steps
    for digit in range(digits):
        column = -2 - digit - (digit >= decimals)
        tenth = rest // 10
        needed = True if digit <= decimals else rest > 0
        text[..., column] = np.where(needed, rest - 10 * tenth + ord("0"), 0)
        rest = tenth
    return text.tobytes().translate(None, b"\0")


def depth_first(skeleton: Skeleton) -> list[tuple[int, int]]:
    """Return every joint and its depth, each joint followed by its descendants."""
    children: list[list[int]] = [[] for _ in skeleton.names]
    for joint in range(len(skeleton) - 1, 0, -1):
        children[skeleton.parents[joint]].append(joint)
    order, pending = [], [(0, 0)]
    while pending:
        joint, level = pending.pop()
        order.append((joint, level))
        pending += [(child, level + 1) for child in children[joint]]
    return order


def unwrap_euler(
    angles: Annotated[Floats, "frames *joints 3"],
) -> Annotated[Floats, "frames *joints 3"]:
    """Return equal rotations as ZYX angles (frames, ..., 3), rad, without jumps between frames.

    Besides whole turns there is a second triple for each rotation: the outer angles half a turn on,
    the middle one mirrored. The test whether the other triple is nearer has the same result from
    either triple, so the parity of all tests so far selects the triple of each frame.
    """
    mirrored = np.array([1.0, -1.0, 1.0]) * angles + np.pi
    same, other = (_squared_wrapped(both[1:] - angles[:-1]) for both in (angles, mirrored))
    crossed = np.zeros(angles.shape[:-1], bool)
    crossed[1:] = other < same
    unwrapped = np.where(np.cumsum(crossed, axis=0)[..., None] % 2, mirrored, angles)
    turns = np.round(np.diff(unwrapped, axis=0, prepend=unwrapped[:1]) / (2.0 * np.pi))
    return unwrapped - 2.0 * np.pi * np.cumsum(turns, axis=0)


def _squared_wrapped(differences: Annotated[Floats, "*batch 3"]) -> Annotated[Floats, "*batch"]:
    """Return squared lengths (...) of differences of angles (..., 3), rad, each wrapped to pi."""
    nearest = differences - 2.0 * np.pi * np.round(differences / (2.0 * np.pi))
    return np.einsum("...k,...k->...", nearest, nearest)
