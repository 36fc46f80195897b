/** Whether anything like some controls was captured, as the service tells it: by a box and by the
 * variance of a plain field over the controls of the captured clips. */

import type { ModelCard } from "@posefield/client";

/** Share of a control's range by which a question may lie beyond it. */
const BEYOND = 0.1;
/** Of the captured clips, each left out: so many lie within the limit of the variance. */
const QUANTILE = 0.95;
const NUGGET = 0.05;

export class Support {
  readonly #box: readonly (readonly [low: number, high: number])[];
  readonly #scaled: (values: readonly number[]) => number[];
  readonly #samples: readonly number[][];
  readonly #inverse: readonly Float64Array[];
  readonly #limit: number;

  constructor(card: ModelCard) {
    const columns = card.controls.map((_, i) => card.examples.map((example) => example[i]!));
    const low = columns.map((column) => Math.min(...column));
    const high = columns.map((column) => Math.max(...column));
    const room = columns.map((_, i) => BEYOND * (high[i]! - low[i]!));
    this.#box = room.map((wide, i) => [low[i]! - wide, high[i]! + wide]);
    this.#scaled = (values) =>
      values.map((value, i) => (2 * value - low[i]! - high[i]!) / (high[i]! - low[i]!));
    this.#samples = card.examples.map((example) => this.#scaled(example));
    const system = this.#samples.map((a, i) =>
      this.#samples.map((b, j) => covariance(a, b) + (i === j ? NUGGET : 0)),
    );
    this.#inverse = inverted(system).map((row) => Float64Array.from(row));
    const leftOut = this.#inverse.map((row, i) => 1 / row[i]! - NUGGET);
    this.#limit = quantile(leftOut, QUANTILE);
  }

  holds(values: readonly number[]): boolean {
    const near = this.#box.every(([low, high], i) => values[i]! >= low && values[i]! <= high);
    return near && this.#variance(this.#scaled(values)) <= this.#limit;
  }

  #variance(point: readonly number[]): number {
    const near = Float64Array.from(this.#samples, (sample) => covariance(sample, point));
    return (
      1 -
      dot(
        near,
        Float64Array.from(this.#inverse, (row) => dot(row, near)),
      )
    );
  }
}

const known = new WeakMap<ModelCard, Support>();

/** Of a model, prepared once. */
export function of(card: ModelCard): Support {
  const found = known.get(card) ?? new Support(card);
  known.set(card, found);
  return found;
}

function covariance(a: readonly number[], b: readonly number[]): number {
  return Math.exp(-0.5 * a.reduce((sum, value, i) => sum + (value - b[i]!) ** 2, 0));
}

// A map asks for it a hundred thousand times: in a loop, ten times as fast.
function dot(a: Float64Array, b: Float64Array): number {
  let sum = 0;
  for (let i = 0; i < a.length; i++) sum += a[i]! * b[i]!;
  return sum;
}

function quantile(values: readonly number[], share: number): number {
  const sorted = [...values].sort((a, b) => a - b);
  const at = share * (sorted.length - 1);
  const [low, high] = [sorted[Math.floor(at)]!, sorted[Math.ceil(at)]!];
  return low + (at - Math.floor(at)) * (high - low);
}

/** Gauss and Jordan without pivots, which a positive definite matrix does not need. */
function inverted(matrix: readonly (readonly number[])[]): number[][] {
  const size = matrix.length;
  const rows = matrix.map((row, i) => [...row, ...row.map((_, j) => (i === j ? 1 : 0))]);
  for (let at = 0; at < size; at++) {
    const pivot = rows[at]![at]!;
    const own = rows[at]!.map((value) => value / pivot);
    rows[at] = own;
    for (let other = 0; other < size; other++) {
      const factor = other === at ? 0 : rows[other]![at]!;
      if (factor) rows[other] = rows[other]!.map((value, i) => value - factor * own[i]!);
    }
  }
  return rows.map((row) => row.slice(size));
}
