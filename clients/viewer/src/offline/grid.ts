/** Linear interpolation in a grid: the same for every quantity of a table. */

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
    const at = interval(axis, values[i]!);
    const share = (values[i]! - axis[at]!) / (axis[at + 1]! - axis[at]!);
    found = found.flatMap(({ index, weight }) => [
      { index: index * axis.length + at, weight: weight * (1 - share) },
      { index: index * axis.length + at + 1, weight: weight * share },
    ]);
  }
  return found.filter(({ weight }) => weight !== 0);
}

function interval(axis: readonly number[], value: number): number {
  const above = axis.findIndex((end) => end > value);
  return Math.max(0, (above < 0 ? axis.length - 1 : above) - 1);
}
