"""Mesh under construction: rings of points, joined by quads, welded at common points."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from posefield.common.units import Floats
from posefield.encode.body.bone_chain import BoneChain, ChainPlace


@dataclass
class MeshBuilder:
    """Points with their places along chains of bones, and faces.

    points: m. chains, places: of each point, the chain of bones that moves it and where along it.
    faces: points of each face, counterclockwise from outside.
    """

    points: list[Floats] = field(default_factory=list)
    chains: list[BoneChain] = field(default_factory=list)
    places: list[ChainPlace] = field(default_factory=list)
    faces: list[tuple[int, ...]] = field(default_factory=list)

    def add(self, point: Floats, chain: BoneChain, place: ChainPlace) -> int:
        """Return the index of a new point."""
        self.points.append(point)
        self.chains.append(chain)
        self.places.append(place)
        return len(self.points) - 1

    def add_ring(self, points: Floats, chain: BoneChain, place: ChainPlace) -> list[int]:
        """Return the indices of new points (N, 3) at one place of a chain."""
        return [self.add(point, chain, place) for point in points]

    def join(self, lower: Sequence[int], upper: Sequence[int], *, closed: bool = True) -> None:
        """Add quads between two rings of as many points.

        Seen from outside, with the upper ring above, the points of a ring follow each other to the
        right.
        """
        count = len(lower)
        for at in range(count if closed else count - 1):
            after = (at + 1) % count
            self.faces.append((lower[at], lower[after], upper[after], upper[at]))

    def close(self, ring: Sequence[int], pole: int) -> None:
        """Add triangles from a ring to a point above it."""
        for at, point in enumerate(ring):
            self.faces.append((point, ring[(at + 1) % len(ring)], pole))

    def drop_unused(self) -> None:
        """Remove the points that no face has."""
        used = sorted({point for face in self.faces for point in face})
        place = {point: index for index, point in enumerate(used)}
        self.points[:] = [self.points[point] for point in used]
        self.chains[:] = [self.chains[point] for point in used]
        self.places[:] = [self.places[point] for point in used]
        self.faces[:] = [tuple(place[point] for point in face) for face in self.faces]
