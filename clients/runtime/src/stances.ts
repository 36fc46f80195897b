/** Stances and swings of one foot: from contact probabilities, as captured feet step. */

import type { FootContact } from "./card.ts";
import {
  LIFTED,
  PROBABILITY_DECIMALS,
  SHORTEST_CONTACT,
  SHORTEST_GAP,
  SHORTEST_STEP,
  STANDING,
} from "./constants.ts";
import { type Complex, roundEven, times, type Vector } from "./vectors.ts";

/** Equal steps of time over a motion; way and factor are the displacement and turn of a cycle. */
export interface Grid {
  readonly count: number;
  readonly rate: number;
  readonly cyclic: boolean;
  readonly way: Complex;
  readonly factor: Complex;
}

/** Frames `begin` to `end`, exclusive; those of a cycle may go on over its end. */
export interface Run {
  readonly begin: number;
  readonly end: number;
}

/**
 * A foot as predicted, and how captured feet contact and swing.
 *
 * floor, heights: path of the joint that contacts. arms: from the ankle to it. flatPitch: of an arm
 * on a flat foot, rad.
 */
export interface Foot {
  readonly grid: Grid;
  readonly floor: readonly Complex[];
  readonly heights: readonly number[];
  readonly contact: FootContact;
  readonly arms: readonly Vector[];
  readonly flatPitch: number;
}

/** The floor point of a path at a frame, which may lie within later cycles. */
export function place(grid: Grid, floor: readonly Complex[], frame: number): Complex {
  let point = floor[frame % grid.count]!;
  const cycles = grid.cyclic ? Math.floor(frame / grid.count) : 0;
  for (let cycle = 0; cycle < cycles; cycle++) {
    const [z, x] = times(grid.factor, point);
    point = [grid.way[0] + z, grid.way[1] + x];
  }
  return point;
}

/** Runs of true frames, in order; one of a cycle may go over its end. */
export function runs(down: readonly boolean[], cyclic: boolean): Run[] {
  const found: Run[] = [];
  for (let frame = 0; frame < down.length; frame++) {
    if (!down[frame]) continue;
    const begin = frame;
    while (down[frame + 1]) frame++;
    found.push({ begin, end: frame + 1 });
  }
  const [first, last] = [found[0], found.at(-1)];
  if (!cyclic || !first || !last || first === last) return found;
  if (first.begin !== 0 || last.end !== down.length) return found;
  return [...found.slice(1, -1), { begin: last.begin, end: last.end + first.end }];
}

/** True for each frame of a grid in one of the runs. */
export function mask(found: readonly Run[], grid: Grid): boolean[] {
  const frames = new Array<boolean>(grid.count).fill(false);
  for (const run of found) for (const frame of framesOf(run)) frames[frame % grid.count] = true;
  return frames;
}

export function framesOf({ begin, end }: Run): number[] {
  return Array.from({ length: end - begin }, (_, index) => begin + index);
}

/** True for a run that touches no end of its motion; those of cycles do not. */
export function isInner({ begin, end }: Run, grid: Grid): boolean {
  return grid.cyclic || !(begin === 0 || end >= grid.count);
}

/** Least number of frames of a stance; one frame is none in a cycle. */
export function shortest(grid: Grid): number {
  return Math.max(SHORTEST_CONTACT * grid.rate, 1 + Number(grid.cyclic));
}

/** Contacts of a foot with probabilities at the frames. */
export function fromProbabilities(likely: readonly number[], grid: Grid): Run[] {
  const scale = 10 ** PROBABILITY_DECIMALS;
  return tidy(
    likely.map((value) => roundEven(value * scale) / scale > STANDING),
    grid,
  );
}

/** Runs of true frames; short gaps are closed, then short contacts dropped. */
function tidy(down: readonly boolean[], grid: Grid): Run[] {
  const gaps = runs(
    down.map((standing) => !standing),
    grid.cyclic,
  );
  const closed = mask(
    gaps.filter((run) => isInner(run, grid) && run.end - run.begin < SHORTEST_GAP * grid.rate),
    grid,
  );
  const contacts = runs(
    down.map((standing, frame) => standing || closed[frame]!),
    grid.cyclic,
  );
  return contacts.filter((run) => !isInner(run, grid) || run.end - run.begin >= shortest(grid));
}

/** Stances whose swings are as captured ones: they go somewhere, and do not last. */
export function discipline(stances: readonly Run[], foot: Foot): Run[] {
  const { grid, contact } = foot;
  const down = mask(stances, grid);
  const swings = runs(
    down.map((standing) => !standing),
    grid.cyclic,
  );
  const swinging = mask(
    swings.filter((run) => goes(run, foot)).map((run) => cut(run, foot)),
    grid,
  );
  return tidy(
    down.map(
      (standing, frame) =>
        standing || (!swinging[frame] && foot.heights[frame]! < contact.height + LIFTED),
    ),
    grid,
  );
}

function goes(run: Run, { grid, floor }: Foot): boolean {
  if (!isInner(run, grid)) return true;
  return distance(grid, floor, Math.max(run.begin - 1, 0), run.end) >= SHORTEST_STEP;
}

/** A swing that lasts longer than captured ones: its median duration, where the foot goes most. */
function cut(run: Run, { grid, floor, contact }: Foot): Run {
  if (run.end - run.begin <= contact.longest_swing * grid.rate) return run;
  const usual = Math.max(2, roundEven(contact.swing * grid.rate));
  const length = Math.min(usual, run.end - run.begin - 1);
  let first = run.begin;
  let most = -1;
  for (let begin = run.begin; begin + length < run.end; begin++) {
    const gone = roundEven(distance(grid, floor, begin, begin + length) * 1e6);
    if (gone > most) [first, most] = [begin, gone];
  }
  return { begin: first, end: first + length };
}

export function distance(
  grid: Grid,
  floor: readonly Complex[],
  before: number,
  after: number,
): number {
  const [a, b] = [place(grid, floor, before), place(grid, floor, after)];
  return Math.hypot(b[0] - a[0], b[1] - a[1]);
}

/** Stances without the frames beyond reach: of each the longest run that is left. */
export function shortened(stances: readonly Run[], beyond: readonly boolean[], grid: Grid): Run[] {
  const pieces = stances.flatMap((stance) => {
    const inReach = framesOf(stance).map((frame) => !beyond[frame % grid.count]);
    const lengths = runs(inReach, false).sort((a, b) => b.end - b.begin - (a.end - a.begin));
    const piece = lengths[0];
    if (!piece || piece.end - piece.begin < shortest(grid)) return [];
    const begin = stance.begin + piece.begin;
    // A stance of a cycle begins within it.
    const first = begin >= grid.count ? begin - grid.count : begin;
    return [{ begin: first, end: first + piece.end - piece.begin }];
  });
  return pieces.sort((a, b) => a.begin - b.begin);
}

/** A percentile of values, interpolated; zero without any. */
export function percentile(values: readonly number[], percent: number): number {
  if (!values.length) return 0;
  const ordered = values.toSorted((a, b) => a - b);
  const rank = 0.01 * percent * (ordered.length - 1);
  const before = Math.floor(rank);
  const [low, high] = [ordered[before]!, ordered[Math.min(before + 1, ordered.length - 1)]!];
  return low + (rank - before) * (high - low);
}
