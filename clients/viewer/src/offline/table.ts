/** Answers between those of a table, by interpolation. */

import { type Corner, corners } from "./grid.ts";
import type { LevelHead, Numbers, RowPart, Tables } from "./read.ts";

/** Arrays of quaternions. */
const TURNS: ReadonlySet<string> = new Set(["rotations", "placed_turns"]);

/** Of one character: F frames of J joints; rotations as unit quaternions. */
export interface Answer extends Readonly<Record<RowPart, Float32Array>> {
  readonly duration: number;
  readonly sigma: number;
}

interface Level {
  readonly coefficients: Float32Array;
  readonly rank: number;
  readonly basis: Float32Array;
  readonly mean: Float32Array;
  readonly trust: Float32Array;
}

export class Table {
  readonly #tables: Tables;
  readonly #numbers: Numbers;
  readonly #size: number;
  readonly #support: Float32Array;
  readonly #levels: Level[] = [];
  #last: { readonly key: string; readonly answer: Answer } | null = null;

  constructor(tables: Tables, numbers: Numbers) {
    this.#tables = tables;
    this.#numbers = numbers;
    this.#size = tables.answers.axes.reduce((product, axis) => product * axis.length, 1);
    this.#support = numbers(tables.answers.support);
  }

  /** who: place of the name in the named label set, -1 where it is left open. */
  answer(values: ArrayLike<number>, who: number, level: number): Answer {
    // A crowd asks for the frames of a motion one after the other.
    const key = `${Array.from(values)} ${who} ${level}`;
    if (this.#last?.key !== key) this.#last = { key, answer: this.#answer(values, who, level) };
    return this.#last.answer;
  }

  /** Duration, s, and sigma, m, alone. */
  trust(values: ArrayLike<number>, who: number, level: number): readonly [number, number] {
    const [duration, sigma] = mixed(this.#level(level).trust, 2, this.#rows(values, who));
    return [duration!, sigma!];
  }

  /** Whether anything like it was captured. */
  supported(values: ArrayLike<number>): boolean {
    const around = corners(this.#tables.answers.support_axes, values);
    return mixed(this.#support, 1, around)[0]! >= 0.5;
  }

  #answer(values: ArrayLike<number>, who: number, level: number): Answer {
    const own = this.#level(level);
    const coefficients = mixed(own.coefficients, own.rank, this.#rows(values, who));
    const [duration, sigma] = this.trust(values, who, level);
    let first = 0;
    const parts = Object.entries(this.#tables.answers.layout).map(([name, shape]) => {
      const size = shape.reduce((product, each) => product * each, 1);
      const part = expanded(own, coefficients, first, size);
      first += size;
      return [name, TURNS.has(name) ? unit(part) : part] as const;
    });
    return { ...(Object.fromEntries(parts) as Record<RowPart, Float32Array>), duration, sigma };
  }

  #rows(values: ArrayLike<number>, who: number): readonly Corner[] {
    const first = (who + 1) * this.#size;
    const around = corners(this.#tables.answers.axes, values);
    return around.map(({ index, weight }) => ({ index: first + index, weight }));
  }

  #level(level: number): Level {
    this.#levels[level] ??= opened(this.#tables.answers.levels[level]!, this.#numbers);
    return this.#levels[level];
  }
}

function opened(head: LevelHead, numbers: Numbers): Level {
  return {
    coefficients: numbers(head.coefficients),
    rank: head.coefficients.columns,
    basis: numbers(head.basis),
    mean: numbers(head.mean),
    trust: numbers(head.trust),
  };
}

function mixed(rows: Float32Array, width: number, around: readonly Corner[]): Float64Array {
  const out = new Float64Array(width);
  for (const { index, weight } of around) {
    for (let i = 0; i < width; i++) out[i]! += weight * rows[index * width + i]!;
  }
  return out;
}

/** Numbers of a row, from its coefficients. */
function expanded(own: Level, coefficients: Float64Array, first: number, size: number) {
  const out = new Float32Array(size);
  for (let i = 0; i < size; i++) {
    let sum = own.mean[first + i]!;
    const row = (first + i) * own.rank;
    for (let k = 0; k < own.rank; k++) sum += coefficients[k]! * own.basis[row + k]!;
    out[i] = sum;
  }
  return out;
}

/** The quaternions at unit length, in place. */
function unit(rotations: Float32Array): Float32Array {
  for (let i = 0; i < rotations.length; i += 4) {
    const length = Math.hypot(...rotations.subarray(i, i + 4));
    for (let k = 0; k < 4; k++) rotations[i + k]! /= length;
  }
  return rotations;
}
