/** One cycle of a motion, or its straight line, and poses relative to the travel. */

import { vectorAt } from "./limbs.ts";
import {
  arcFactor,
  type Complex,
  conj,
  difference,
  direction,
  type Quaternion,
  scaled,
  sum,
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
  const [left, ahead, turned] = vectorAt(travel, row);
  const arc = arcFactor(turned);
  const way = scaled(times([ahead, left], conj(arc)), 1 / (arc[0] ** 2 + arc[1] ** 2));
  // A cycle without its travel ends at its start.
  const start = difference(floorAt(root_position, row), [ahead, left]);
  return { duration, way, turned, start };
}

/** The straight line of a motion between two rows of roots. */
export function lineOf(roots: Float32Array, first: number, duration: number): Stride {
  const [start, end] = [floorAt(roots, first), floorAt(roots, first + 1)];
  return { duration, way: difference(end, start), turned: 0, start };
}

/** A root relative to the travel at a phase, 0 to 1, and the turn that its rotation takes. */
export function relativeRoot(
  { way, turned, start }: Stride,
  phase: number,
  roots: ArrayLike<number>,
  row: number,
): { readonly root: Vector; readonly heading: Quaternion } {
  const gone = sum(start, times(scaled(way, phase), arcFactor(phase * turned)));
  const [z, x] = times(difference(floorAt(roots, row), gone), direction(-phase * turned));
  return { root: [x, roots[3 * row + 1]!, z], heading: turn([0, 1, 0], -phase * turned) };
}

function floorAt(roots: ArrayLike<number>, row: number): Complex {
  return [roots[3 * row + 2]!, roots[3 * row]!];
}
