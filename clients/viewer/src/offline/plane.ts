/** Places on the floor and turns about +Y: service/posefield/locomotion/floor_plane.py, with x and z by name. */

export interface Place {
  readonly x: number;
  readonly z: number;
}

/** A way gone evenly while turning by `turn`: where one gets to. */
export function arc(way: Place, turn: number): Place {
  return scaled(turned(way, turn / 2), bend(turn));
}

/** The way whose arc leads over a gap. */
export function straightened(gap: Place, turn: number): Place {
  return scaled(turned(gap, -turn / 2), 1 / bend(turn));
}

export function turned({ x, z }: Place, angle: number): Place {
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  return { x: cos * x + sin * z, z: cos * z - sin * x };
}

export function scaled({ x, z }: Place, by: number): Place {
  return { x: by * x, z: by * z };
}

function bend(turn: number): number {
  return turn === 0 ? 1 : Math.sin(turn / 2) / (turn / 2);
}

/** Turns a quaternion w x y z on about +Y, in place. */
export function turnRoot(rotations: Float32Array | Float64Array, at: number, angle: number): void {
  const [cos, sin] = [Math.cos(angle / 2), Math.sin(angle / 2)];
  const [w, x, y, z] = [rotations[at]!, rotations[at + 1]!, rotations[at + 2]!, rotations[at + 3]!];
  rotations[at] = cos * w - sin * y;
  rotations[at + 1] = cos * x + sin * z;
  rotations[at + 2] = cos * y + sin * w;
  rotations[at + 3] = cos * z - sin * x;
}
