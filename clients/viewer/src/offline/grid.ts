/** Cubic interpolation in a grid: the same for every quantity of a table. */

/** Values of an axis that take part, two on each side of a point. */
const NODES = 4;

/** A point of the grid and its share of an answer; the shares of an answer sum to one. */
export interface Corner {
  readonly index: number;
  readonly weight: number;
}

/** The points around `values`, one value for each axis; the last axis is the fastest. */
export function corners(
  axes: readonly (readonly number[])[],
  values: ArrayLike<number>,
): readonly Corner[] {
  let found: Corner[] = [{ index: 0, weight: 1 }];
  for (const [i, axis] of axes.entries()) {
    const own = nodes(axis, values[i]!);
    found = found.flatMap(({ index, weight }) =>
      own.map((node) => ({
        index: index * axis.length + node.index,
        weight: weight * node.weight,
      })),
    );
  }
  return found;
}

/** The values of an axis around `value`, with the weights of Lagrange's polynomial. */
function nodes(axis: readonly number[], value: number): Corner[] {
  const count = Math.min(NODES, axis.length);
  const below = interval(axis, value) - Math.floor((count - 1) / 2);
  const first = Math.max(0, Math.min(axis.length - count, below));
  const around = axis.slice(first, first + count);
  return around
    .map((own, i) => ({
      index: first + i,
      weight: around.reduce(
        (product, other) => (other === own ? product : (product * (value - other)) / (own - other)),
        1,
      ),
    }))
    .filter(({ weight }) => weight !== 0);
}

function interval(axis: readonly number[], value: number): number {
  const above = axis.findIndex((end) => end > value);
  return Math.max(0, (above < 0 ? axis.length - 1 : above) - 1);
}
