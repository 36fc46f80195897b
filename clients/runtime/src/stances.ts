/** Stances and swings of one foot: from contact probabilities, as captured feet step and roll. */

import type { FootContact } from "./card.ts";
import * as limits from "./constants.ts";
import {
  type Complex,
  clamp,
  conj,
  cross,
  difference,
  dot,
  norm,
  type Quaternion,
  roundEven,
  sum,
  times,
  turn,
  unit,
  type Vector,
} from "./vectors.ts";

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
function place(grid: Grid, floor: readonly Complex[], frame: number): Complex {
  const cycle = grid.cyclic ? Math.floor(frame / grid.count) : 0;
  return inCycle(grid, floor[frame % grid.count]!, cycle);
}

/** A floor point some cycles later, or one earlier. */
export function inCycle({ way, factor }: Grid, point: Complex, cycle: number): Complex {
  if (cycle < 0) return times(conj(factor), difference(point, way));
  let later = point;
  for (let number = 0; number < cycle; number++) later = sum(way, times(factor, later));
  return later;
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
  return Math.max(limits.SHORTEST_CONTACT * grid.rate, 1 + Number(grid.cyclic));
}

/** Contacts of a foot with probabilities at the frames. */
export function fromProbabilities(likely: readonly number[], grid: Grid): Run[] {
  const scale = 10 ** limits.PROBABILITY_DECIMALS;
  return tidy(
    likely.map((value) => roundEven(value * scale) / scale > limits.STANDING),
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
    gaps.filter(
      (run) => isInner(run, grid) && run.end - run.begin < limits.SHORTEST_GAP * grid.rate,
    ),
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
        standing || (!swinging[frame] && foot.heights[frame]! < contact.height + limits.LIFTED),
    ),
    grid,
  );
}

function goes(run: Run, { grid, floor }: Foot): boolean {
  if (!isInner(run, grid)) return true;
  return distance(grid, floor, Math.max(run.begin - 1, 0), run.end) >= limits.SHORTEST_STEP;
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
  return Math.hypot(...difference(place(grid, floor, after), place(grid, floor, before)));
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

/** Offsets of the ball of a foot in stances from where it stands flat; zero in swings. */
export interface Roll {
  readonly floor: readonly Complex[];
  readonly heights: readonly number[];
  /** First frame of each stance in which the foot is flat; the end of one in which it is not. */
  readonly flats: readonly number[];
}

/** Pitch of vectors of a foot while it is flat, rad, toes up; zero without contacts. */
export function flatPitch(vectors: readonly Vector[], contacts: readonly Run[]): number {
  const frames = contacts.flatMap(framesOf);
  return percentile(
    frames.map((frame) => pitch(vectors[frame % vectors.length]!)),
    limits.FLAT_PERCENTILE,
  );
}

function pitch([x, y, z]: Vector): number {
  return Math.atan2(y, Math.hypot(z, x));
}

/** The roll of a foot in stances; heights follow softly, SUNK below to UNEVEN above. */
export function roll(foot: Foot, stances: readonly Run[]): Roll {
  const { grid, contact, flatPitch: level } = foot;
  const floor: Complex[] = Array.from({ length: grid.count }, () => [0, 0]);
  const heights = new Array<number>(grid.count).fill(0);
  const flats: number[] = [];
  for (const stance of stances) {
    const frames = framesOf(stance);
    const pitches = frames.map((frame) => pitch(foot.arms[frame % grid.count]!));
    const toesUp = pitches.map((angle) => Math.max(angle - level, 0));
    const firstFlat = toesUp.indexOf(0);
    const flat = firstFlat < 0 ? stance.end : stance.begin + firstFlat;
    flats.push(flat);
    const places = frames.map((frame, index): Complex => {
      const arm = foot.arms[frame % grid.count]!;
      const { height } = contact;
      const length = norm(arm);
      const size = Math.max(Math.hypot(arm[2], arm[0]), 1e-9);
      // The ball from the heel, ahead and up, of a foot whose heel is on the floor.
      const ankle = height - length * Math.sin(level);
      const heel = limits.HEEL * length * Math.cos(level);
      const angle = toesUp[index]!;
      const [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
      const ahead = length * Math.cos(level + angle) + heel * cosine - ankle * sine;
      const up = length * Math.sin(level + angle) + heel * sine + ankle * cosine;
      const above = foot.heights[frame % grid.count]! - height;
      // Toes are not lifted above the prediction: it may have been taken for flat on tiptoe.
      const rise = Math.min(up - height, Math.max(above, 0));
      const room = above < rise ? limits.SUNK : limits.UNEVEN;
      heights[frame % grid.count] = rise + room * Math.tanh((above - rise) / room);
      const way: Complex = [(ahead * arm[2]) / size, (ahead * arm[0]) / size];
      // Vectors of a later cycle are turned.
      return frame >= grid.count ? times(way, grid.factor) : way;
    });
    const last = places[Math.min(flat, stance.end - 1) - stance.begin]!;
    for (const [index, frame] of frames.entries()) {
      if (frame >= flat) continue;
      const offset = difference(places[index]!, last);
      floor[frame % grid.count] = frame >= grid.count ? times(offset, conj(grid.factor)) : offset;
    }
  }
  return { floor, heights, flats };
}

/** Stances without the frames at their ends in which ankle and ball move. */
export function trimmed(stances: readonly Run[], foot: Foot): Run[] {
  const { grid } = foot;
  const ankles = foot.floor.map(
    ([z, x], frame): Complex => [z - foot.arms[frame]![2], x - foot.arms[frame]![0]],
  );
  const runs = stances.map((stance) => {
    const still = framesOf(stance).filter(
      (frame) =>
        Math.min(speed(foot, foot.floor, frame), speed(foot, ankles, frame)) < limits.STILL_SPEED,
    );
    let [begin, end] = [still[0] ?? stance.begin, (still.at(-1) ?? stance.end - 1) + 1];
    // A stance at an end of a motion goes on outside it.
    if (!grid.cyclic && stance.begin === 0) begin = 0;
    if (!grid.cyclic && stance.end === grid.count) end = grid.count;
    const later = begin >= grid.count ? grid.count : 0;
    return { begin: begin - later, end: end - later };
  });
  return runs.sort((a, b) => a.begin - b.begin);
}

function speed({ grid }: Foot, path: readonly Complex[], frame: number): number {
  const [before, after] = [frame - 1, frame + 1].map((beside) =>
    grid.cyclic ? beside + grid.count : clamp(beside, 0, grid.count - 1),
  );
  const gone = distance(grid, path, before!, after!);
  return (gone * grid.rate) / Math.max(after! - before!, 1);
}

/**
 * The turn of a foot about its ball with which its leg reaches.
 *
 * offset: from the ball to the hip. arm: from the ankle to the ball. chord: that the leg spans, m.
 */
export function heelTurn(offset: Vector, arm: Vector, chord: number): Quaternion {
  const [foot, away] = [norm(arm), norm(offset)];
  const size = Math.max(2 * foot * away, 1e-12);
  const goal = (away ** 2 + foot ** 2 - chord ** 2) / size;
  const present = (-2 * dot(arm, offset)) / size;
  const angle = Math.acos(clamp(present, -1, 1)) - Math.acos(clamp(goal, -1, 1));
  return turn(
    unit(cross(offset, arm)),
    clamp(angle, -limits.MOST_HEEL_LIFT, limits.MOST_HEEL_LIFT),
  );
}

/** The turn of toes with which their end is no lower than `lowest` above the ball, m. */
export function toeBend(toe: Vector, lowest: number): Quaternion {
  const size = Math.max(norm(toe), 1e-9);
  const [present, goal] = [toe[1], lowest].map((up) => Math.asin(clamp(up / size, -1, 1)));
  return turn(unit(cross(toe, [0, 1, 0]), 1e-9), Math.max(goal! - present!, 0));
}
