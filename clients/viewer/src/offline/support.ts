/** Whether anything like some controls was captured: an evaluation of tables that the service has made. */

/** As service/posefield/kriging/support.py writes them (`Support.table`). */
export interface SupportTable {
  /** Of each control: the least and the greatest value that is supported. */
  readonly bounds: readonly (readonly [number, number])[];
  /** Of each captured clip: slopes and offset of the log covariance. */
  readonly slopes: readonly (readonly number[])[];
  readonly offsets: readonly number[];
  /** Of each control: factor and offset. */
  readonly scale: readonly (readonly [number, number])[];
  readonly rate: number;
  readonly inverse: readonly (readonly number[])[];
  readonly limit: number;
}

export class Support {
  readonly #table: SupportTable;
  readonly #inverse: readonly Float64Array[];

  constructor(table: SupportTable) {
    this.#table = table;
    this.#inverse = table.inverse.map((row) => Float64Array.from(row));
  }

  holds(values: ArrayLike<number>): boolean {
    const { bounds, limit, offsets, rate, scale, slopes } = this.#table;
    if (!bounds.every(([low, high], i) => values[i]! >= low && values[i]! <= high)) return false;
    const near = Float64Array.from(slopes, (row, i) => Math.exp(dot(row, values) + offsets[i]!));
    const squared = scale.reduce((sum, [by, less], i) => sum + (values[i]! * by - less) ** 2, 0);
    const held = Float64Array.from(this.#inverse, (row) => dot(row, near));
    return 1 - Math.exp(-2 * rate * squared) * dot(near, held) <= limit;
  }
}

// A map asks for it a hundred thousand times: in a loop, ten times as fast.
function dot(a: ArrayLike<number>, b: ArrayLike<number>): number {
  let sum = 0;
  for (let i = 0; i < a.length; i++) sum += a[i]! * b[i]!;
  return sum;
}
