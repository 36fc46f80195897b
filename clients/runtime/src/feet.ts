/** Feet that stand: their plan for a motion, and frames with the feet placed where it says. */

import { planPath } from "./ball-path.ts";
import type { FootContact } from "./card.ts";
import * as limits from "./constants.ts";
import type { Limb, LimbPoses } from "./limbs.ts";
import {
  discipline,
  type Foot,
  flatPitch,
  framesOf,
  fromProbabilities,
  type Grid,
  heelTurn,
  inCycle,
  mask,
  percentile,
  type Run,
  roll,
  shortened,
  toeBend,
  trimmed,
} from "./stances.ts";
import { firmReach, legChord, solve } from "./two-bone.ts";
import {
  add,
  type Complex,
  clamp,
  conjugate,
  multiply,
  norm,
  type Quaternion,
  rotate,
  scale,
  subtract,
  type Vector,
  ZERO,
} from "./vectors.ts";

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
  const grounded = mean - clamp(mean, -limits.SUNK, limits.UNEVEN);
  const feet = rows.map((row): Foot & { readonly stances: readonly Run[] } => {
    const height = row.contact.height + clamp(row.above - grounded, -limits.SUNK, limits.UNEVEN);
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
    let stances = foot.stances;
    for (let round = 0; ; round++) {
      const path = planPath(foot, stances);
      const needs = path.map((ball, frame) => need(poses, limb, frame, ball, followed[frame]!));
      const beyond = needs.map((lower) => lower > limits.MOST_LOWERED + 1e-9);
      const shorter = shortened(stances, beyond, grid);
      const [before, after] = [mask(stances, grid), mask(shorter, grid)];
      const same = before.every((standing, frame) => !standing || after[frame]);
      if (same || round === limits.REACH_ROUNDS) return { stances, path, needs };
      stances = shorter;
    }
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
    Math.min(Math.max(0, ...needs.map((leg) => leg[frame]!)), limits.MOST_LOWERED),
  );
  const smooth = cover(needed, grid);
  const excess = cover(
    smooth.map((value) => Math.max(value - limits.MOST_LOWERED, 0)),
    grid,
  );
  return smooth.map((value, frame) => Math.max(value - excess[frame]!, 0));
}

/** A smooth path that is nowhere below the needed one, which is not negative. */
function cover(needed: readonly number[], grid: Grid): number[] {
  const half = Math.max(1, Math.round(limits.PELVIS_SPREAD * grid.rate));
  const around = Array.from({ length: 2 * half + 1 }, (_, index) => index - half);
  const kernel = around.map((offset) =>
    Math.exp(-0.5 * (offset / (limits.PELVIS_SMOOTHING * grid.rate)) ** 2),
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

/** Place the feet of poses at times, s: rotations and roots are changed. */
export function placeFeet(
  plan: FeetPlan,
  poses: LimbPoses,
  seconds: readonly number[],
  rotations: Float64Array,
  roots: Float64Array,
): void {
  const { grid } = plan;
  const joints = rotations.length / (4 * seconds.length);
  for (const [frame, time] of seconds.entries()) {
    const at = time * grid.rate;
    const lowered = framesAround(grid, at).reduce(
      (sum, { frame: index, weight }) => sum + weight * plan.lowered[index]!,
      0,
    );
    const shift: Vector = [0, -lowered, 0];
    for (const foot of plan.feet) {
      const path = add(poses.position(foot.limb.tip, frame), changeAt(grid, foot, at));
      const ball = anchored(grid, foot, at, path);
      const lowest = foot.toeHeight - ball[1];
      const turns = placeLeg(poses, foot.limb, frame, shift, ball, lowest);
      for (const [joint, turn] of turns) rotations.set(turn, 4 * (frame * joints + joint));
    }
    roots[3 * frame + 1]! -= lowered;
  }
}

/**
 * Local rotations of the joints of a leg, by joint, whose ball comes to a place.
 *
 * shift: of the root, m. lowest: of the end of the toes above the ball, m. spin: turn of the foot
 * before it is placed.
 */
export function placeLeg(
  poses: LimbPoses,
  leg: Limb,
  frame: number,
  shift: Vector,
  ball: Vector,
  lowest: number,
  spin: Quaternion = [1, 0, 0, 0],
): Map<number, Quaternion> {
  let arm = rotate(spin, poses.between(leg.lower, leg.tip, frame));
  const offset = subtract(add(poses.position(leg.upper, frame), shift), ball);
  const chord = legChord(poses, leg, frame, norm(add(offset, arm)));
  let foot = spin;
  if (leg.tip !== leg.lower) {
    // The heel is lifted where the leg would be stretched.
    const lift = heelTurn(offset, arm, chord);
    foot = multiply(lift, spin);
    arm = rotate(lift, arm);
  }
  const chain = scale(add(offset, arm), -1);
  const end = scale(chain, chord / Math.max(norm(chain), 1e-9));
  const [thigh, shin] = solve(poses, leg, frame, end);
  const ankle = multiply(foot, poses.orientation(leg.lower, frame));
  const placed = new Map([
    [leg.upper, multiply(conjugate(poses.parentOrientation(leg.upper, frame)), thigh)],
    [leg.middle, multiply(conjugate(thigh), shin)],
    [leg.lower, multiply(conjugate(shin), ankle)],
  ]);
  if (leg.toe) {
    const tip = multiply(foot, poses.orientation(leg.tip, frame));
    const bent = multiply(toeBend(rotate(tip, leg.toe), lowest), tip);
    placed.set(leg.tip, multiply(conjugate(ankle), bent));
  }
  return placed;
}

/** The change of a foot's path at a fractional frame; over the floor it turns with the cycle. */
function changeAt(grid: Grid, foot: FootPlan, at: number): Vector {
  const turns = { ...grid, way: [0, 0] as const };
  return framesAround(grid, at).reduce((total, { frame, cycle, weight }) => {
    const [x, y, z] = foot.changes[frame]!;
    const floor = inCycle(turns, [z, x], cycle);
    return add(total, scale([floor[1], y, floor[0]], weight));
  }, ZERO);
}

/** Weights of the frames around a fractional one: cubic Hermite, slopes by central differences. */
function framesAround({ count, cyclic }: Grid, at: number) {
  const before = clamp(Math.floor(at + 1e-9), 0, count - 1);
  const s = clamp(at - before, 0, 1);
  const weights = [
    s * (s - 0.5 - 0.5 * s ** 2),
    1 + s ** 2 * (1.5 * s - 2.5),
    s * (0.5 + 2 * s - 1.5 * s ** 2),
    0.5 * s ** 2 * (s - 1),
  ];
  return weights.map((weight, index) => {
    const frame = before - 1 + index;
    const cycle = cyclic ? Math.floor(frame / count) : 0;
    return { frame: clamp(frame - cycle * count, 0, count - 1), cycle, weight };
  });
}

/** The path of a ball, over the floor exactly at the anchor of a flat foot. */
function anchored(grid: Grid, foot: FootPlan, at: number, [x, y, z]: Vector): Vector {
  let floor: Complex = [z, x];
  // Stances are there a cycle earlier and later, too.
  for (const cycle of grid.cyclic ? [0, -1, 1] : [0])
    for (const [index, { end }] of foot.stances.entries()) {
      const frame = at - cycle * grid.count;
      const [anchorX, , anchorZ] = foot.anchors[index]!;
      if (frame >= foot.flats[index]! - 1e-9 && frame <= end - 1 + 1e-9)
        floor = inCycle(grid, [anchorZ, anchorX], cycle);
    }
  return [floor[1], y, floor[0]];
}
