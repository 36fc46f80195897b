/** Rolling feet: stances that begin on the heel, lifted heels, and toes that bend. */

import { FLAT_PERCENTILE, HEEL, MOST_HEEL_LIFT, STILL_SPEED, SUNK, UNEVEN } from "./constants.ts";
import { distance, type Foot, framesOf, percentile, type Run } from "./stances.ts";
import {
  type Complex,
  clamp,
  conj,
  cross,
  dot,
  norm,
  type Quaternion,
  times,
  turn,
  unit,
  type Vector,
} from "./vectors.ts";

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
    FLAT_PERCENTILE,
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
      const heel = HEEL * length * Math.cos(level);
      const angle = toesUp[index]!;
      const [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
      const ahead = length * Math.cos(level + angle) + heel * cosine - ankle * sine;
      const up = length * Math.sin(level + angle) + heel * sine + ankle * cosine;
      const above = foot.heights[frame % grid.count]! - height;
      // Toes are not lifted above the prediction: it may have been taken for flat on tiptoe.
      const rise = Math.min(up - height, Math.max(above, 0));
      const room = above < rise ? SUNK : UNEVEN;
      heights[frame % grid.count] = rise + room * Math.tanh((above - rise) / room);
      const way: Complex = [(ahead * arm[2]) / size, (ahead * arm[0]) / size];
      // Vectors of a later cycle are turned.
      return frame >= grid.count ? times(way, grid.factor) : way;
    });
    const last = places[Math.min(flat, stance.end - 1) - stance.begin]!;
    for (const [index, frame] of frames.entries()) {
      if (frame >= flat) continue;
      const offset: Complex = [places[index]![0] - last[0], places[index]![1] - last[1]];
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
      (frame) => Math.min(speed(foot, foot.floor, frame), speed(foot, ankles, frame)) < STILL_SPEED,
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
  return turn(unit(cross(offset, arm)), clamp(angle, -MOST_HEEL_LIFT, MOST_HEEL_LIFT));
}

/** The turn of toes with which their end is no lower than `lowest` above the ball, m. */
export function toeBend(toe: Vector, lowest: number): Quaternion {
  const size = Math.max(norm(toe), 1e-9);
  const [present, goal] = [toe[1], lowest].map((up) => Math.asin(clamp(up / size, -1, 1)));
  return turn(unit(cross(toe, [0, 1, 0]), 1e-9), Math.max(goal! - present!, 0));
}
