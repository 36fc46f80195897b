/** One cycle of a motion, or its straight line, and poses relative to the travel. */

import {
  arcFactor,
  type Complex,
  direction,
  type Quaternion,
  times,
  turn,
  type Vector,
} from "./vectors.ts";

/** Way along the arc in the axes of its start, m; turn, rad; and where the root begins. */
export interface Stride {
  readonly duration: number;
  readonly way: Complex;
  readonly turned: number;
  readonly start: Complex;
}

/** The cycle that ends at a row of the graph's outputs. */
export function cycleOf(
  { root_position, travel }: Record<"root_position" | "travel", Float32Array>,
  row: number,
  duration: number,
): Stride {
  const [left, ahead, turned] = [0, 1, 2].map((axis) => travel[3 * row + axis]!) as [
    number,
    number,
    number,
  ];
  const [re, im] = arcFactor(turned);
  const size = re ** 2 + im ** 2;
  const end = floorAt(root_position, row);
  // A cycle without its travel ends at its start.
  const start: Complex = [end[0] - ahead, end[1] - left];
  return { duration, way: times([ahead, left], [re / size, -im / size]), turned, start };
}

/** The straight line of a motion between two rows of roots. */
export function lineOf(roots: Float32Array, first: number, duration: number): Stride {
  const [start, end] = [floorAt(roots, first), floorAt(roots, first + 1)];
  return { duration, way: [end[0] - start[0], end[1] - start[1]], turned: 0, start };
}

/** A root relative to the travel at a phase, 0 to 1, and the turn that its rotation takes. */
export function relativeRoot(
  { way, turned, start }: Stride,
  phase: number,
  roots: ArrayLike<number>,
  row: number,
): { readonly root: Vector; readonly heading: Quaternion } {
  const gone = times([phase * way[0], phase * way[1]], arcFactor(phase * turned));
  const place = floorAt(roots, row);
  const [z, x] = times(
    [place[0] - start[0] - gone[0], place[1] - start[1] - gone[1]],
    direction(-phase * turned),
  );
  return { root: [x, roots[3 * row + 1]!, z], heading: turn([0, 1, 0], -phase * turned) };
}

function floorAt(roots: ArrayLike<number>, row: number): Complex {
  return [roots[3 * row + 2]!, roots[3 * row]!];
}
