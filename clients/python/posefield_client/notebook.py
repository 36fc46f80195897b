"""A clip or a performance as a picture for notebooks: a stick figure in a view that turns.

It is an SVG with animated attributes, which needs neither scripts nor a network.
"""

from html import escape

import numpy as np
import numpy.typing as npt

from posefield_client.generated import PerformanceReport
from posefield_client.numbers import ClipNumbers, PerformanceNumbers

TURN_SECONDS = 6.0
"""Time of a whole turn of the view, which lasts a whole number of clips, s."""
MAX_PICTURES = 120
"""Poses in a whole turn: between them the picture interpolates."""
PICTURE_RATE, MOST_PICTURES = 10.0, 600
"""Poses a second of a motion that is longer than MAX_PICTURES of them, and their largest number."""
WIDTH, HEIGHT, MARGIN = 240, 260, 12
TILT = np.radians(12.0)
"""Angle by which the view looks down, rad."""

Array = npt.NDArray[np.float64]


def picture(clip: ClipNumbers | PerformanceNumbers) -> str:
    """Return HTML with the animated figure, the models, the duration and the warnings."""
    seconds = max(len(clip.times) - 1, 1) / clip.rate
    repeats = max(1, round(TURN_SECONDS / seconds))
    most = max(MAX_PICTURES, min(MOST_PICTURES, round(PICTURE_RATE * seconds * repeats)))
    frames = _frames(len(clip.times), repeats, most)
    shown = _projected(positions(clip)[frames], np.linspace(0.0, 2.0 * np.pi, len(frames)))
    paths = [_path(points, clip.parents) for points in shown]
    said, noted = _caption(clip, seconds)
    warnings = "".join(f"<br>{escape(warning)}" for warning in noted)
    return (
        f'<figure style="display:inline-block;margin:0"><svg width="{WIDTH}" height="{HEIGHT}" '
        f'viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(said)}">'
        '<path fill="none" stroke="currentColor" stroke-width="3" stroke-linecap="round" '
        f'd="{paths[0]}"><animate attributeName="d" dur="{seconds * repeats:.3f}s" '
        f'repeatCount="indefinite" values="{";".join(paths)}"/></path></svg>'
        f"<figcaption>{escape(said)}{warnings}</figcaption></figure>"
    )


def _caption(clip: ClipNumbers | PerformanceNumbers, seconds: float) -> tuple[str, tuple[str, ...]]:
    """Return what a picture shows, and the warnings below it."""
    trust = clip.trust
    if isinstance(trust, PerformanceReport):
        name = ", ".join(trust.models)
        noted = tuple(f"{each.pointer}: {each.message}" for each in trust.warnings)
    else:
        name, noted = trust.model, tuple(trust.warnings)
    return f"{name}: {seconds:.2f} s, give or take {100.0 * trust.sigma:.1f} cm", noted


def _frames(count: int, repeats: int, most: int) -> npt.NDArray[np.intp]:
    """Return the frames of a clip that is shown several times, at most `most` of them."""
    each = min(count, max(2, most // repeats))
    once = np.linspace(0, count - 1, each).round().astype(np.intp)
    return np.tile(once, repeats)


def positions(clip: ClipNumbers | PerformanceNumbers) -> Array:
    """Return the joint positions (F, J, 3) with y up, by forward kinematics."""
    turns = np.asarray(clip.rotations, float)
    places = np.zeros((*turns.shape[:-1], 3))
    world = turns.copy()
    places[:, 0] = clip.root_position
    for joint, parent in enumerate(clip.parents):
        if parent >= 0:
            world[:, joint] = _product(world[:, parent], turns[:, joint])
            arm = np.broadcast_to(np.asarray(clip.bone_offsets[joint], float), (len(turns), 3))
            places[:, joint] = places[:, parent] + _rotated(world[:, parent], arm)
    z_up = clip.units.get("up") == "Z"
    return places[..., [0, 2, 1]] * np.array([1.0, 1.0, -1.0]) if z_up else places


def _product(a: Array, b: Array) -> Array:
    """Return the product (F, 4) of quaternions w x y z."""
    w = a[:, :1] * b[:, :1] - np.sum(a[:, 1:] * b[:, 1:], axis=1, keepdims=True)
    rest = a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:] + np.cross(a[:, 1:], b[:, 1:])
    return np.concatenate([w, rest], axis=1)


def _rotated(turns: Array, vectors: Array) -> Array:
    """Return vectors (F, 3) rotated by quaternions (F, 4)."""
    twice = 2.0 * np.cross(turns[:, 1:], vectors)
    rotated: Array = vectors + turns[:, :1] * twice + np.cross(turns[:, 1:], twice)
    return rotated


def _projected(places: Array, angles: Array) -> Array:
    """Return the points (F, J, 2) of the picture, seen at angles (F,) about the vertical."""
    centred = places.copy()
    # The view follows the root over the floor.
    centred[..., [0, 2]] -= places[:, :1, [0, 2]]
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    across = c * centred[..., 0] + s * centred[..., 2]
    depth = c * centred[..., 2] - s * centred[..., 0]
    down = -(np.cos(TILT) * centred[..., 1] + np.sin(TILT) * -depth)
    points = np.stack([across, down], axis=-1)
    low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    room = np.array([WIDTH, HEIGHT]) - 2.0 * MARGIN
    scale = float(np.min(room / np.maximum(high - low, 1e-9)))
    return np.asarray(
        (points - 0.5 * (low + high)) * scale + 0.5 * np.array([WIDTH, HEIGHT]), float
    )


def _path(points: Array, parents: tuple[int, ...]) -> str:
    """Return one picture (J, 2) as an SVG path with a line for each bone."""
    words = [
        f"M{points[parent, 0]:.0f} {points[parent, 1]:.0f}"
        f"L{points[joint, 0]:.0f} {points[joint, 1]:.0f}"
        for joint, parent in enumerate(parents)
        if parent >= 0
    ]
    return "".join(words)
