/** Controls that bring a joint to a point: damped Gauss-Newton within a box. */

export type Point = readonly [number, number, number];

/** One control that may be moved, in its unit. */
export interface Free {
  readonly minimum: number;
  readonly maximum: number;
}

/** Where the joint is at each of some settings of the free controls, m. */
export type Places = (settings: readonly (readonly number[])[]) => Promise<readonly Point[]>;

/** Share of a control's range by which it is moved to see what that does. */
const PROBE = 0.01;
/** What a whole range away from the start costs, as metres missed. */
const STAY = 0.02;
/** Of range a step, at most. */
const STRIDE = 0.35;

/** Resistance to steps at first, and what it is multiplied by after a good and a bad one. */
const RESIST = 1e-3;
const GOOD = 0.3;
const BAD = 6;

interface Seen {
  readonly values: readonly number[];
  readonly miss: readonly [number, number, number];
  /** Metres that the joint moves for a whole range of each control. */
  readonly jacobian: readonly (readonly number[])[];
  readonly cost: number;
}

/** Goes from where the controls are to where the joint is at the target, as near as they may. */
export class Descent {
  readonly #places: Places;
  readonly #free: readonly Free[];
  readonly #start: readonly number[];
  readonly #target: Point;
  #next: readonly number[];
  #best: Seen | null = null;
  #resist = RESIST;

  /** start: what the controls leave no farther than the point needs. */
  constructor(
    places: Places,
    free: readonly Free[],
    values: readonly number[],
    start: readonly number[],
    target: Point,
  ) {
    this.#places = places;
    this.#free = free;
    this.#next = values;
    this.#start = start;
    this.#target = target;
  }

  /** One question, with a setting for each control; the best so far, and how far it misses, m. */
  async step(): Promise<{ readonly values: readonly number[]; readonly miss: number }> {
    const seen = await this.#look(this.#next);
    const better = !this.#best || seen.cost < this.#best.cost;
    this.#best = better ? seen : this.#best!;
    this.#resist = Math.max(1e-7, this.#resist * (better ? GOOD : BAD));
    this.#next = this.#on(this.#best);
    return { values: this.#best.values, miss: Math.hypot(...this.#best.miss) };
  }

  async #look(values: readonly number[]): Promise<Seen> {
    // Towards the middle, so that probes stay within the range too.
    const probes = this.#free.map(({ minimum, maximum }, i) =>
      values[i]! > (minimum + maximum) / 2 ? -PROBE : PROBE,
    );
    const settings = this.#free.map((free, i) =>
      values.map((value, k) => (k === i ? value + probes[i]! * range(free) : value)),
    );
    const [here, ...there] = await this.#places([values, ...settings]);
    const miss = minus(this.#target, here!);
    const jacobian = there.map((point, i) => minus(point, here!).map((x) => x / probes[i]!));
    const away = this.#away(values);
    return { values, miss, jacobian, cost: dot(miss, miss) + STAY * STAY * dot(away, away) };
  }

  /** The next values to look at, from there. */
  #on({ jacobian, miss, values }: Seen): readonly number[] {
    const held = blocked(this.#free, values, jacobian, miss);
    const step = solved(jacobian, miss, this.#away(values), held, this.#resist);
    const longest = Math.max(STRIDE, ...step.map(Math.abs)) / STRIDE;
    return values.map((value, i) =>
      clamped(value + (step[i]! / longest) * range(this.#free[i]!), this.#free[i]!),
    );
  }

  /** In shares of ranges. */
  #away(values: readonly number[]): readonly number[] {
    return values.map((value, i) => (value - this.#start[i]!) / range(this.#free[i]!));
  }
}

function range({ minimum, maximum }: Free): number {
  return maximum - minimum || 1;
}

/** Controls at an end of their range that the point pulls beyond it. */
function blocked(
  free: readonly Free[],
  values: readonly number[],
  jacobian: readonly (readonly number[])[],
  miss: readonly number[],
): readonly boolean[] {
  return free.map(({ minimum, maximum }, i) => {
    const pull = dot(jacobian[i]!, miss);
    const reach = 1e-9 * (maximum - minimum);
    return (
      (values[i]! <= minimum + reach && pull < 0) || (values[i]! >= maximum - reach && pull > 0)
    );
  });
}

/** The step in shares of ranges: (JᵀJ + (s² + r) I) d = Jᵀm − s²a, held controls left out. */
function solved(
  jacobian: readonly (readonly number[])[],
  miss: readonly number[],
  away: readonly number[],
  held: readonly boolean[],
  resist: number,
): number[] {
  const stay = STAY * STAY;
  const rows = jacobian.map((column, i) => [
    ...jacobian.map((other, k) =>
      held[i] || held[k] ? Number(i === k) : dot(column, other) + (i === k ? stay + resist : 0),
    ),
    held[i] ? 0 : dot(column, miss) - stay * away[i]!,
  ]);
  return eliminated(rows);
}

/** Gauss with pivots; rows hold the right side last. */
function eliminated(rows: number[][]): number[] {
  const n = rows.length;
  for (let i = 0; i < n; i++) {
    const pivot = rows.reduce(
      (best, row, k) => (k >= i && Math.abs(row[i]!) > Math.abs(rows[best]![i]!) ? k : best),
      i,
    );
    [rows[i], rows[pivot]] = [rows[pivot]!, rows[i]!];
    for (let k = 0; k < n; k++) {
      if (k === i) continue;
      const share = rows[k]![i]! / rows[i]![i]!;
      for (let j = i; j <= n; j++) rows[k]![j]! -= share * rows[i]![j]!;
    }
  }
  return rows.map((row, i) => row[n]! / row[i]!);
}

function clamped(value: number, { minimum, maximum }: Free): number {
  return Math.min(maximum, Math.max(minimum, value));
}

function minus(a: Point, b: Point): [number, number, number] {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

function dot(a: readonly number[], b: readonly number[]): number {
  return a.reduce((sum, x, i) => sum + x * b[i]!, 0);
}
