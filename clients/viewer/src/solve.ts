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

/** One step towards the point from `values`: one question, with a setting for each control.
 *
 * start: where the controls were when it began; they leave it no farther than the point needs.
 */
export async function stepped(
  places: Places,
  free: readonly Free[],
  values: readonly number[],
  start: readonly number[],
  target: Point,
): Promise<{ readonly next: readonly number[]; readonly miss: number }> {
  const ranges = free.map(({ minimum, maximum }) => maximum - minimum || 1);
  // Towards the middle, so that probes stay within the range too.
  const probes = free.map(({ minimum, maximum }, i) =>
    values[i]! > (minimum + maximum) / 2 ? -PROBE : PROBE,
  );
  const settings = free.map((_, i) =>
    values.map((value, k) => (k === i ? value + probes[i]! * ranges[i]! : value)),
  );
  const [here, ...there] = await places([values, ...settings]);
  const miss = minus(target, here!);
  const jacobian = there.map((point, i) => minus(point, here!).map((x) => x / probes[i]!));
  const away = values.map((value, i) => (value - start[i]!) / ranges[i]!);
  const step = solved(jacobian, miss, away, blocked(free, values, jacobian, miss));
  const longest = Math.max(STRIDE, ...step.map(Math.abs)) / STRIDE;
  const next = values.map((value, i) =>
    clamped(value + (step[i]! / longest) * ranges[i]!, free[i]!),
  );
  return { next, miss: Math.hypot(...miss) };
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

/** The step in shares of ranges: (JᵀJ + s²I) d = Jᵀm − s²a, held controls left out. */
function solved(
  jacobian: readonly (readonly number[])[],
  miss: readonly number[],
  away: readonly number[],
  held: readonly boolean[],
): number[] {
  const stay = STAY * STAY;
  const rows = jacobian.map((column, i) => [
    ...jacobian.map((other, k) =>
      held[i] || held[k] ? Number(i === k) : dot(column, other) + (i === k ? stay : 0),
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
