/** Paths of the joints that contact: the smoothest changes of predicted paths, with lifted swings. */

import * as limits from "./constants.ts";
import {
  distance,
  type Foot,
  framesOf,
  type Grid,
  inCycle,
  isInner,
  mask,
  type Run,
  roll,
  runs,
} from "./stances.ts";
import {
  type Complex,
  conj,
  difference,
  roundEven,
  scaled,
  sum,
  times,
  type Vector,
} from "./vectors.ts";

/** The path of a foot that stands in stances, and rolls there. */
export function planPath(foot: Foot, stances: readonly Run[]): Vector[] {
  const { grid, contact } = foot;
  const rolled = roll(foot, stances);
  // A foot that rolls keeps its place but for the offset of its ball.
  const flat = foot.floor.map((point, frame) => difference(point, rolled.floor[frame]!));
  const floor = smoothPath(grid, flat, stances).map((point, frame) =>
    sum(point, rolled.floor[frame]!),
  );
  const level = foot.heights.map((height, frame): Complex => [height - rolled.heights[frame]!, 0]);
  const still = { ...grid, way: ORIGIN, factor: UNTURNED };
  const heights = smoothPath(still, level, stances, [contact.height, 0]).map(
    ([height], frame) => rolled.heights[frame]! + height,
  );
  const { added, lowest } = lifts(foot, floor, heights, stances);
  return floor.map(([z, x], frame): Vector => {
    const least = contact.height + lowest[frame]! + Math.min(rolled.heights[frame]!, 0);
    return [x, Math.max(heights[frame]! + added[frame]!, least), z];
  });
}

/** Lift of a swinging foot, m, and its least heights in swings. */
function lifts(
  foot: Foot,
  floor: readonly Complex[],
  heights: readonly number[],
  stances: readonly Run[],
): { added: number[]; lowest: number[] } {
  const { grid, contact } = foot;
  const [added, lowest] = [0, 1].map(() => new Array<number>(grid.count).fill(0));
  const swinging = mask(stances, grid).map((standing) => !standing);
  for (const swing of runs(swinging, grid.cyclic)) {
    const length = swing.end - swing.begin;
    // Those with a stance before or after them.
    if (length >= grid.count) continue;
    const inner = isInner(swing, grid);
    const step = distance(grid, floor, ...stancesBeside(swing, foot));
    let smallest = limits.LIFT_SHARE * contact.clearance * Math.min(step / limits.FULL_STEP, 1);
    // A parabola: how high a foot is lifted at most in the duration of its swing.
    if (inner)
      smallest = Math.min(smallest, (limits.LIFT_ACCELERATION * (length / grid.rate) ** 2) / 8);
    // A swing at an end of a clip goes on outside it, for the usual duration.
    const usual = inner ? length : Math.max(length, roundEven(contact.swing * grid.rate));
    const lead = swing.begin === 0 && !inner ? usual - length : 0;
    const frames = framesOf(swing);
    const rises = frames.map((_, index) =>
      liftShare((index + 1 + lead) / (usual + 1), (usual + 1) / grid.rate),
    );
    const most = frames.reduce((top, at) => Math.max(top, heights[at % grid.count]!), -Infinity);
    const lifted = Math.max(most - contact.height, 0);
    const extra = Math.max(smallest * Math.max(...rises) - lifted, 0);
    for (const [index, frame] of frames.entries()) {
      added![frame % grid.count] = extra * rises[index]!;
      lowest![frame % grid.count] = Math.min(smallest, limits.LEAST_LIFT) * rises[index]!;
    }
  }
  return { added: added!, lowest: lowest! };
}

/** Frames in which a foot stands before and after a swing, or the ends of the clip. */
function stancesBeside({ begin, end }: Run, { grid }: Foot): [number, number] {
  const after = grid.cyclic && begin === 0 ? grid.count : 0;
  if (grid.cyclic) return [begin - 1 + after, end + after];
  return [Math.max(begin - 1, 0), Math.min(end, grid.count - 1)];
}

/** The share of a lift at a share of a swing, which begins and ends at rest. */
function liftShare(share: number, seconds: number): number {
  const quickest = Math.max(seconds / limits.RISE, 2);
  const soon = Math.min(Math.min(share, 1 - share) * quickest, 1);
  return Math.sin(Math.PI * share) ** limits.LIFT_EXPONENT * soon ** 2 * (3 - 2 * soon);
}

const ORIGIN: Complex = [0, 0];
const UNTURNED: Complex = [1, 0];

/** A frame of a path: a factor of an unknown place, if any, and an offset. */
interface Term {
  readonly unknown: number | null;
  readonly factor: Complex;
  readonly offset: Complex;
}

/**
 * The path of smoothest change that stays in one place in each stance: at `fixed`, or where it fits.
 *
 * A path y minimises the sum of |y - f|² + (tau r)⁴ |D² (y - f)|². f is the predicted path, r the
 * rate and D² the second difference, which goes on into the next cycle.
 */
function smoothPath(
  grid: Grid,
  path: readonly Complex[],
  stances: readonly Run[],
  fixed?: Complex,
): readonly Complex[] {
  if (!stances.length) return path;
  const { count, cyclic } = grid;
  const terms = termsOf(grid, stances, fixed);
  const changes = terms.map((term, frame): Term => {
    return { ...term, offset: difference(term.offset, path[frame]!) };
  });
  const squares = new LeastSquares(count);
  for (const change of changes) squares.add(1, [change]);
  const stiffness = (limits.PATH_SPREAD * grid.rate) ** 4;
  for (let middle = 1; middle < count + (cyclic ? 1 : -1); middle++) {
    const bend = [1, -2, 1].map((share, index): Term => {
      const frame = middle - 1 + index;
      const { unknown, factor, offset } = changes[frame % count]!;
      const turned = scaled(frame < count ? UNTURNED : grid.factor, share);
      return { unknown, factor: times(turned, factor), offset: times(turned, offset) };
    });
    squares.add(stiffness, bend);
  }
  const places = squares.solve();
  return terms.map(({ unknown, factor, offset }) =>
    unknown === null ? offset : sum(times(factor, places[unknown]!), offset),
  );
}

/** Terms of the frames of a grid; those of a stance share an unknown, or are fixed. */
function termsOf(grid: Grid, stances: readonly Run[], fixed?: Complex): Term[] {
  const back = { factor: conj(grid.factor), offset: inCycle(grid, ORIGIN, -1) };
  const terms = Array.from({ length: grid.count }, (_, unknown): Term => {
    return { unknown, factor: UNTURNED, offset: ORIGIN };
  });
  for (const stance of stances)
    for (const frame of framesOf(stance)) {
      const earlier = frame >= grid.count;
      const unknown = fixed ? null : stance.begin;
      const free = earlier ? back : { factor: UNTURNED, offset: ORIGIN };
      terms[frame % grid.count] = { unknown, ...free, ...(fixed ? { offset: fixed } : {}) };
    }
  return terms;
}

/** The least total of squares of sums of few terms, by the normal equations. */
class LeastSquares {
  readonly #rows: readonly Map<number, Complex>[];
  readonly #right: Complex[];

  constructor(size: number) {
    this.#rows = Array.from({ length: size }, () => new Map());
    this.#right = this.#rows.map(() => ORIGIN);
  }

  /** Add the square of a sum of terms, times a weight. */
  add(weight: number, terms: readonly Term[]): void {
    const rest = scaled(terms.map(({ offset }) => offset).reduce(sum), -1);
    for (const { unknown: row, factor } of terms) {
      if (row === null) continue;
      const share = scaled(conj(factor), weight);
      this.#right[row] = sum(this.#right[row]!, times(share, rest));
      for (const { unknown: column, factor: other } of terms)
        if (column !== null) this.#increase(row, column, times(share, other));
    }
  }

  /** Values of all unknowns; zero for those in no term. */
  solve(): readonly Complex[] {
    const right = this.#right;
    for (const [pivot, row] of this.#rows.entries()) {
      const later = [...row].filter(([column]) => column > pivot);
      for (const [below] of later) {
        const share = scaled(this.#rows[below]!.get(pivot)!, -1 / row.get(pivot)![0]);
        right[below] = sum(right[below]!, times(share, right[pivot]!));
        for (const [column, value] of later) this.#increase(below, column, times(share, value));
      }
    }
    for (const [pivot, row] of [...this.#rows.entries()].toReversed()) {
      for (const [column, value] of row)
        if (column > pivot) right[pivot] = difference(right[pivot]!, times(value, right[column]!));
      if (row.size) right[pivot] = scaled(right[pivot]!, 1 / row.get(pivot)![0]);
    }
    return right;
  }

  #increase(row: number, column: number, value: Complex): void {
    const cells = this.#rows[row]!;
    cells.set(column, sum(cells.get(column) ?? ORIGIN, value));
  }
}
