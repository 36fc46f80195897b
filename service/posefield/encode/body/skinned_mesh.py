"""A body mesh skinned to a skeleton, which follows the bone lengths of each clip."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, Singles

Integers = npt.NDArray[np.int32]
Bytes = npt.NDArray[np.uint8]

SKIN, ROUGHNESS = (0.62, 0.64, 0.69), 0.6
"""Colour and roughness of a body's material."""
# Centre, left, right: readers that support one colour per mesh use the first.
TINTS = np.array([(0.75, 0.75, 0.75), (0.25, 0.45, 0.85), (0.85, 0.4, 0.25)])
FULL_WEIGHT = 255
"""Sum of the weights of a point, which are whole numbers, so that they fit a byte in glTF."""


@dataclass(frozen=True)
class BonePlaces:
    """R places along bones, which follow their ends.

    anchors (R, 2): two joints or, after all joints, tips. shares (R,): a place moves by (1 - share)
    of the displacement of its first anchor and share of its second's.
    """

    anchors: Integers
    shares: Floats

    def displacements(self, moved: Floats) -> Floats:
        """Return how far (M, R, 3) the places move, m, with anchors moved by (M, J + E, 3)."""
        first, second = (moved.take(self.anchors[:, end], axis=1) for end in (0, 1))
        second -= first
        second *= self.shares[:, None]
        first += second
        return first


@dataclass(frozen=True)
class SkinnedMesh:
    """P points, with normals, faces and weights, about a skeleton of J joints and E tips at rest.

    points (P, 3): m. normals (P, 3): unit, outward. places: along bones; place (P,): the one that
    each point moves with where bones are longer or shorter. joints, weights (P, I): the joints that
    move each point, and their weights out of FULL_WEIGHT; points with fewer of them have zeros.
    counts: corners of each face; corners: their points, counterclockwise from outside. tints (P,):
    index of the point's colour. coarse (T, 3): fewer triangles
    on the same points, for characters seen from afar.
    """

    points: Singles
    normals: Singles
    places: BonePlaces
    place: Integers
    joints: Integers
    weights: Bytes
    counts: Integers
    corners: Integers
    tints: Integers
    coarse: Integers

    def points_at(self, moved: Floats) -> Singles:
        """Return the points (M, P, 3), m, for places that move by (M, R, 3), m."""
        found = moved.astype(np.float32).take(self.place, axis=1)
        found += self.points
        return found


def colours(mesh: SkinnedMesh) -> Singles:
    """Return the colours (C, 3) that the tints of a mesh stand for: one for all, or three."""
    found = TINTS if mesh.tints.any() else np.array([SKIN])
    return found.astype(np.float32)


def distinct_places(anchors: Integers, shares: Floats) -> tuple[BonePlaces, Integers]:
    """Return the distinct places of points, and the index (P,) of each point's."""
    rows = np.concatenate([anchors, shares[:, None]], axis=1)
    found, index = np.unique(rows, axis=0, return_inverse=True)
    places = BonePlaces(found[:, :2].astype(np.int32), found[:, 2].copy())
    return places, index.reshape(-1).astype(np.int32)


def triangles(counts: Integers, corners: Integers) -> Integers:
    """Return the corners (T, 3) of faces cut into triangle fans."""
    cut = counts - 2
    owner = np.repeat(np.arange(len(cut)), cut)
    first = (np.cumsum(counts) - counts)[owner]
    turn = np.arange(len(owner)) - (np.cumsum(cut) - cut)[owner]
    return corners[np.stack([first, first + turn + 1, first + turn + 2], axis=-1)]


def vertex_normals(points: Floats, faces: Integers) -> Singles:
    """Return unit normals (P, 3): the mean of the triangles (T, 3) at a point, by their areas."""
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    areas = np.cross(b - a, c - a)
    summed = np.zeros_like(points)
    for corner in range(3):
        np.add.at(summed, faces[:, corner], areas)
    lengths = np.linalg.norm(summed, axis=-1, keepdims=True)
    up = np.array([0.0, 1.0, 0.0])
    return np.where(lengths > 0, summed / np.where(lengths > 0, lengths, 1.0), up).astype(
        np.float32
    )
