"""Coarse faces of a body mesh: the same points, fewer of them, for characters seen from afar.

Edges are contracted to one of their ends, the cheapest first, by the quadric error of Garland and
Heckbert (Surface simplification using quadric error metrics, 1997). Points that different joints
move are dearer to join, so that elbows and knees keep points that bend.
"""

import heapq
from collections.abc import Iterator
from operator import add

import numpy as np

from posefield.encode.body import skinned_mesh
from posefield.encode.body.skinned_mesh import FULL_WEIGHT, Integers, SkinnedMesh

FACES = 300
"""Number of triangles of coarse faces."""
BEND = 0.5
"""Distance, as a share of an edge's length, that counts as error where joints differ wholly."""
SHORT = 1e-3
"""Share of an edge's squared length that counts as error, so that flat parts stay even."""
STEEPEST = 0.2
"""Smallest cosine between the normals of a triangle before and after a contraction."""

Quadric = tuple[float, ...]
Corners = tuple[int, int, int]


def coarse_faces(mesh: SkinnedMesh, faces: int = FACES) -> Integers:
    """Return triangles (T, 3) on points of a mesh; more than `faces` only where none can go.

    Closed skins stay closed: a contraction that would join other edges is not made.
    """
    made = _Contraction(mesh)
    made.run(faces)
    return np.array(sorted(made.triangles.values()), np.int32)


class _Contraction:
    """Mesh whose edges are contracted.

    triangles: corners by index. around: the triangles of each point.
    """

    def __init__(self, mesh: SkinnedMesh) -> None:
        cut = skinned_mesh.triangles(mesh.counts, mesh.corners).tolist()
        self.triangles: dict[int, Corners] = {at: (a, b, c) for at, (a, b, c) in enumerate(cut)}
        self.points: list[list[float]] = mesh.points.astype(float).tolist()
        self.around: list[set[int]] = [set() for _ in self.points]
        for at, corners in self.triangles.items():
            for point in corners:
                self.around[point].add(at)
        self._weights = _weights(mesh)
        self._quadrics = [_zero() for _ in self.points]
        for corners in self.triangles.values():
            plane = _plane_quadric(*(self.points[point] for point in corners))
            for point in corners:
                self._quadrics[point] = _sum(self._quadrics[point], plane)
        self._versions = [0] * len(self.points)
        self._queue: list[tuple[float, int, int, int]] = []

    def run(self, faces: int) -> None:
        """Contract the cheapest edges until at most so many triangles remain."""
        for point in range(len(self.points)):
            self._offer(point)
        while len(self.triangles) > faces and self._queue:
            _, lost, kept, version = heapq.heappop(self._queue)
            if version == self._versions[lost] + self._versions[kept] and self._allowed(lost, kept):
                self._contract(lost, kept)

    def _offer(self, lost: int) -> None:
        """Queue the contractions of a point to each of its neighbours."""
        for kept in sorted(self._neighbours(lost)):
            version = self._versions[lost] + self._versions[kept]
            heapq.heappush(self._queue, (self._cost(lost, kept), lost, kept, version))

    def _neighbours(self, point: int) -> set[int]:
        return {other for at in self.around[point] for other in self.triangles[at]} - {point}

    def _cost(self, lost: int, kept: int) -> float:
        """Return the error, m^2, of a contraction."""
        target = self.points[kept]
        planes = _sum(self._quadrics[lost], self._quadrics[kept])
        (x, y, z), (u, v, w) = self.points[lost], target
        gap = (x - u) ** 2 + (y - v) ** 2 + (z - w) ** 2
        apart = 1.0 - _shared_weight(self._weights[lost], self._weights[kept])
        return _error(planes, target) + ((BEND * apart) ** 2 + SHORT) * gap

    def _allowed(self, lost: int, kept: int) -> bool:
        """Return True if the edge exists, no triangle turns over and no other edge is joined."""
        shared = self.around[lost] & self.around[kept]
        if len(shared) != 2 or len(self._neighbours(lost) & self._neighbours(kept)) != 2:
            return False
        for at in self.around[lost] - shared:
            before = [self.points[point] for point in self.triangles[at]]
            after = [self.points[_replaced(point, lost, kept)] for point in self.triangles[at]]
            if _cosine(_normal(*before), _normal(*after)) < STEEPEST:
                return False
        return True

    def _contract(self, lost: int, kept: int) -> None:
        for at in sorted(self.around[lost]):
            corners = self.triangles[at]
            if kept in corners:
                for point in corners:
                    if point != lost:
                        self.around[point].discard(at)
                del self.triangles[at]
                continue
            a, b, c = (_replaced(point, lost, kept) for point in corners)
            self.triangles[at] = (a, b, c)
            self.around[kept].add(at)
        self.around[lost] = set()
        self._quadrics[kept] = _sum(self._quadrics[kept], self._quadrics[lost])
        self._versions[lost] += 1
        self._versions[kept] += 1
        self._offer(kept)
        for point in sorted(self._neighbours(kept)):
            version = self._versions[point] + self._versions[kept]
            heapq.heappush(self._queue, (self._cost(point, kept), point, kept, version))


def _replaced(point: int, lost: int, kept: int) -> int:
    return kept if point == lost else point


def _weights(mesh: SkinnedMesh) -> list[dict[int, float]]:
    """Return the weight of each joint that moves each point."""
    pairs = zip(mesh.joints.tolist(), mesh.weights.tolist(), strict=True)
    return [
        {joint: weight / FULL_WEIGHT for joint, weight in zip(*pair, strict=True) if weight}
        for pair in pairs
    ]


def _shared_weight(first: dict[int, float], second: dict[int, float]) -> float:
    """Return the weight, from 0 to 1, with which the same joints move two points."""
    return sum(min(weight, second.get(joint, 0.0)) for joint, weight in first.items())


def _normal(a: list[float], b: list[float], c: list[float]) -> tuple[float, float, float]:
    """Return the normal of a triangle, as long as twice its area."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


def _cosine(first: tuple[float, ...], second: tuple[float, ...]) -> float:
    size = _length(first) * _length(second)
    return _dot(first, second) / size if size > 0 else -1.0


def _length(vector: tuple[float, ...]) -> float:
    return _dot(vector, vector) ** 0.5


def _dot(first: tuple[float, ...], second: tuple[float, ...]) -> float:
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


def _zero() -> Quadric:
    return (0.0,) * 10


def _sum(first: Quadric, second: Quadric) -> Quadric:
    return tuple(map(add, first, second))


def _plane_quadric(a: list[float], b: list[float], c: list[float]) -> Quadric:
    """Return the quadric of the squared distance from a triangle's plane."""
    normal = _normal(a, b, c)
    size = _length(normal)
    if size == 0.0:
        return _zero()
    plane = *(part / size for part in normal), -_dot(normal, tuple(a)) / size
    return tuple(_products(plane))


def _products(plane: tuple[float, ...]) -> Iterator[float]:
    for row in range(4):
        for column in range(row, 4):
            yield plane[row] * plane[column]


def _error(quadric: Quadric, point: list[float]) -> float:
    """Return the value of a quadric at a point, m^2."""
    x, y, z = point
    xx, xy, xz, xw, yy, yz, yw, zz, zw, ww = quadric
    squares = xx * x * x + yy * y * y + zz * z * z + ww
    return squares + 2.0 * (xy * x * y + xz * x * z + yz * y * z + xw * x + yw * y + zw * z)
