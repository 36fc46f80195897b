/** Plan of the feet of a motion: where they stand, and how low the pelvis must be for that. */

import { planPath } from "./ball-path.ts";
import type { FootContact } from "./card.ts";
import {
  MOST_LOWERED,
  PELVIS_SMOOTHING,
  PELVIS_SPREAD,
  REACH_ROUNDS,
  SUNK,
  UNEVEN,
} from "./constants.ts";
import type { Limb, LimbPoses } from "./limbs.ts";
import { flatPitch, heelTurn, roll, trimmed } from "./rolling.ts";
import {
  discipline,
  type Foot,
  framesOf,
  fromProbabilities,
  type Grid,
  mask,
  percentile,
  type Run,
  shortened,
} from "./stances.ts";
import { firmReach, legChord } from "./two-bone.ts";
import { add, clamp, norm, rotate, subtract, type Vector } from "./vectors.ts";

export interface Leg {
  readonly limb: Limb;
  readonly contact: FootContact;
  /** Probabilities of the contact at the frames of the grid. */
  readonly likely: readonly number[];
}

/** Stances of one foot, and what changes its path. */
export interface FootPlan {
  readonly limb: Limb;
  readonly stances: readonly Run[];
  /** Places of the ball of the flat foot, m, and the first frame of each in which it is flat. */
  readonly anchors: readonly Vector[];
  readonly flats: readonly number[];
  readonly changes: readonly Vector[];
  /** Least height of the end of the toes above the floor, m. */
  readonly toeHeight: number;
}

export interface FeetPlan {
  readonly grid: Grid;
  readonly feet: readonly FootPlan[];
  /** Lowering of the root in each frame, m. */
  readonly lowered: readonly number[];
}

/** The plan of a motion at equal steps of time. */
export function planFeet(poses: LimbPoses, legs: readonly Leg[], grid: Grid): FeetPlan {
  const rows = legs.map((leg) => footOf(poses, leg, grid));
  const mean = rows.reduce((sum, { above }) => sum + above, 0) / rows.length;
  // Characters stand as high as their feet do: the ground first.
  const grounded = mean - clamp(mean, -SUNK, UNEVEN);
  const feet = rows.map((row): Foot & { readonly stances: readonly Run[] } => {
    const height = row.contact.height + clamp(row.above - grounded, -SUNK, UNEVEN);
    const foot = {
      ...row,
      heights: row.heights.map((value) => value - grounded),
      contact: { ...row.contact, height },
    };
    return { ...foot, stances: trimmed(discipline(row.down, foot), foot) };
  });
  const followed = new Array<number>(grid.count).fill(grounded);
  const planned = feet.map((foot, index) => {
    const { limb } = legs[index]!;
    let [stances, path] = [foot.stances, planPath(foot, foot.stances)];
    let needs = path.map((ball, frame) => need(poses, limb, frame, ball, followed[frame]!));
    for (let round = 0; round < REACH_ROUNDS; round++) {
      const beyond = needs.map((lower) => lower > MOST_LOWERED + 1e-9);
      const shorter = shortened(stances, beyond, grid);
      const [before, after] = [mask(stances, grid), mask(shorter, grid)];
      if (!before.some((standing, frame) => standing && !after[frame])) break;
      path = planPath(foot, shorter);
      needs = path.map((ball, frame) => need(poses, limb, frame, ball, followed[frame]!));
      stances = shorter;
    }
    return { stances, path, needs };
  });
  const pelvis = lower(
    planned.map(({ needs }) => needs),
    grid,
  );
  return {
    grid,
    lowered: followed.map((level, frame) => level + pelvis[frame]!),
    feet: planned.map(({ stances, path }, index): FootPlan => {
      const foot = feet[index]!;
      const { limb } = legs[index]!;
      const { floor, heights, flats } = roll(foot, stances);
      const anchors = stances.map(({ begin }): Vector => {
        const [z, x] = floor[begin % grid.count]!;
        return subtract(path[begin % grid.count]!, [x, heights[begin % grid.count]!, z]);
      });
      const changes = path.map((ball, frame) => subtract(ball, poses.position(limb.tip, frame)));
      const toeHeight = foot.contact.height + toeDrop(poses, limb, rows[index]!.down, grid);
      return { limb, stances, anchors, flats, changes, toeHeight };
    }),
  };
}

/** A foot as predicted, its contacts, and how much higher it stands than captured ones, m. */
function footOf(poses: LimbPoses, { limb, contact, likely }: Leg, grid: Grid) {
  const frames = Array.from({ length: grid.count }, (_, frame) => frame);
  const points = frames.map((frame) => poses.position(limb.tip, frame));
  const arms = frames.map((frame) => poses.between(limb.lower, limb.tip, frame));
  const down = fromProbabilities(likely, grid);
  const standing = down.flatMap(framesOf).map((frame) => points[frame % grid.count]![1]);
  const above = percentile(
    standing.map((height) => height - contact.height),
    50,
  );
  const floor = points.map(([x, , z]) => [z, x] as const);
  const heights = points.map(([, y]) => y);
  return { grid, contact, floor, heights, arms, down, above, flatPitch: flatPitch(arms, down) };
}

/** Height of the end of the toes above the ball of a flat foot, m. */
function toeDrop(poses: LimbPoses, { tip, toe }: Limb, down: readonly Run[], grid: Grid): number {
  if (!toe) return Number.NEGATIVE_INFINITY;
  const toes = Array.from({ length: grid.count }, (_, frame) =>
    rotate(poses.orientation(tip, frame), toe),
  );
  return norm(toe) * Math.sin(flatPitch(toes, down));
}

/** Lowering of the pelvis that a leg needs, m, with its heel lifted; infinite out of reach. */
export function need(
  poses: LimbPoses,
  leg: Limb,
  frame: number,
  ball: Vector,
  sunk: number,
): number {
  let arm = poses.between(leg.lower, leg.tip, frame);
  const hip = subtract(poses.position(leg.upper, frame), [0, sunk, 0]);
  let reach: number;
  if (leg.tip === leg.lower) reach = firmReach(poses, leg, frame);
  else {
    const offset = subtract(hip, ball);
    // A micrometre of slack, so that rounding lifts no heel.
    reach = legChord(poses, leg, frame, norm(add(offset, arm))) + 1e-6;
    arm = rotate(heelTurn(offset, arm, reach), arm);
  }
  const [x, y, z] = subtract(hip, subtract(ball, arm));
  const room = reach ** 2 - (x ** 2 + z ** 2);
  return room < 0 ? Number.POSITIVE_INFINITY : Math.max(y - Math.sqrt(room), 0);
}

/** Lowering of the pelvis, m: smoothly, by MOST_LOWERED at most. */
function lower(needs: readonly (readonly number[])[], grid: Grid): number[] {
  const frames = Array.from({ length: grid.count }, (_, frame) => frame);
  const needed = frames.map((frame) =>
    Math.min(Math.max(0, ...needs.map((leg) => leg[frame]!)), MOST_LOWERED),
  );
  const smooth = cover(needed, grid);
  const excess = cover(
    smooth.map((value) => Math.max(value - MOST_LOWERED, 0)),
    grid,
  );
  return smooth.map((value, frame) => Math.max(value - excess[frame]!, 0));
}

/** A smooth path that is nowhere below the needed one, which is not negative. */
function cover(needed: readonly number[], grid: Grid): number[] {
  const half = Math.max(1, Math.round(PELVIS_SPREAD * grid.rate));
  const around = Array.from({ length: 2 * half + 1 }, (_, index) => index - half);
  const kernel = around.map((offset) =>
    Math.exp(-0.5 * (offset / (PELVIS_SMOOTHING * grid.rate)) ** 2),
  );
  const total = kernel.reduce((sum, weight) => sum + weight);
  const beside = (frame: number) =>
    grid.cyclic ? (frame + grid.count * half) % grid.count : clamp(frame, 0, grid.count - 1);
  const wide = needed.map((_, frame) =>
    Math.max(...around.map((offset) => needed[beside(frame + offset)]!)),
  );
  return needed.map((_, frame) =>
    around.reduce(
      (sum, offset, index) => sum + (kernel[index]! / total) * wide[beside(frame + offset)]!,
      0,
    ),
  );
}
