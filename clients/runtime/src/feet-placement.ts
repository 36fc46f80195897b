/** Frames of a motion with the feet placed where its plan says. */

import type { FeetPlan, FootPlan } from "./feet-plan.ts";
import type { Limb, LimbPoses } from "./limbs.ts";
import { heelTurn, toeBend } from "./rolling.ts";
import type { Grid } from "./stances.ts";
import { legChord, meanBend, solve } from "./two-bone.ts";
import {
  add,
  type Complex,
  clamp,
  conj,
  conjugate,
  multiply,
  norm,
  type Quaternion,
  rotate,
  scale,
  subtract,
  times,
  type Vector,
} from "./vectors.ts";

const FLOOR_ONLY: Complex = [1, 0];

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
  const bends = plan.feet.map(({ limb }) => meanBend(poses, limb));
  for (const [frame, time] of seconds.entries()) {
    const at = time * grid.rate;
    const lowered = interpolated(grid, at, ([index]) => [plan.lowered[index]!, 0])[0];
    const shift: Vector = [0, -lowered, 0];
    for (const [index, foot] of plan.feet.entries()) {
      const path = add(poses.position(foot.limb.tip, frame), changeAt(grid, foot, at));
      const ball = anchored(grid, foot, at, path);
      const lowest = foot.toeHeight - ball[1];
      const place = (joint: number) => 4 * (frame * joints + joint);
      const bend = bends[index]!;
      const turns = placeLeg(poses, foot.limb, frame, shift, ball, { lowest, bend });
      for (const [joint, turn] of turns) rotations.set(turn, place(joint));
    }
    roots[3 * frame + 1]! -= lowered;
  }
}

/**
 * Local rotations of the joints of a leg, by joint, whose ball comes to a place.
 *
 * shift: of the root, m. lowest: of the end of the toes above the ball, m. bend: of `meanBend`.
 * spin: turn of the foot before it is placed.
 */
export function placeLeg(
  poses: LimbPoses,
  leg: Limb,
  frame: number,
  shift: Vector,
  ball: Vector,
  { lowest, bend, spin }: { lowest: number; bend: Vector; spin?: Quaternion },
): Map<number, Quaternion> {
  let arm = poses.between(leg.lower, leg.tip, frame);
  if (spin) arm = rotate(spin, arm);
  const offset = subtract(add(poses.position(leg.upper, frame), shift), ball);
  const chord = legChord(poses, leg, frame, norm(add(offset, arm)));
  // The heel is lifted where the leg would be stretched.
  const lift = leg.tip === leg.lower ? null : heelTurn(offset, arm, chord);
  const foot = lift && spin ? multiply(lift, spin) : (lift ?? spin);
  if (lift) arm = rotate(lift, arm);
  const chain = scale(add(offset, arm), -1);
  const end = scale(chain, chord / Math.max(norm(chain), 1e-9));
  const turns = solve(poses, leg, frame, end, bend);
  const orientation = poses.orientation(leg.lower, frame);
  const ankle = foot ? multiply(foot, orientation) : orientation;
  const lower = multiply(turns.lower, multiply(conjugate(orientation), ankle));
  const placed = new Map([
    [leg.upper, turns.upper],
    [leg.middle, turns.middle],
    [leg.lower, foot ? lower : turns.lower],
  ]);
  if (foot && leg.toe) {
    const tip = multiply(foot, poses.orientation(leg.tip, frame));
    const bent = multiply(toeBend(rotate(tip, leg.toe), lowest), tip);
    placed.set(leg.tip, multiply(conjugate(ankle), bent));
  }
  return placed;
}

/** The change of a foot's path at a fractional frame; over the floor it turns with the cycle. */
function changeAt(grid: Grid, foot: FootPlan, at: number): Vector {
  const change = (index: number) => foot.changes[index]!;
  const [z, x] = interpolated(grid, at, ([index, factor]) =>
    times(factor, [change(index)[2], change(index)[0]]),
  );
  const [y] = interpolated(grid, at, ([index]) => [change(index)[1], 0]);
  return [x, y, z];
}

/** A value at a fractional frame: cubic Hermite, slopes by central differences. */
function interpolated(
  grid: Grid,
  at: number,
  value: (sample: readonly [index: number, factor: Complex]) => Complex,
): Complex {
  const { count, cyclic, factor } = grid;
  const before = clamp(Math.floor(at + 1e-9), 0, count - 1);
  const share = clamp(at - before, 0, 1);
  const [a, b, c, d] = [-1, 0, 1, 2].map((offset) => {
    const frame = before + offset;
    const within = cyclic ? (frame + count) % count : clamp(frame, 0, count - 1);
    const turned = cyclic && frame !== within ? (frame < 0 ? conj(factor) : factor) : FLOOR_ONLY;
    return value([within, turned]);
  }) as [Complex, Complex, Complex, Complex];
  const part = (i: 0 | 1) =>
    b[i] +
    0.5 *
      share *
      (c[i] -
        a[i] +
        share *
          (2 * a[i] - 5 * b[i] + 4 * c[i] - d[i] + share * (3 * (b[i] - c[i]) + d[i] - a[i])));
  return [part(0), part(1)];
}

/** The path of a ball, over the floor exactly at the anchor of a flat foot. */
function anchored(grid: Grid, foot: FootPlan, at: number, path: Vector): Vector {
  let ball = path;
  const { count, cyclic, way, factor } = grid;
  const stand = (first: number, last: number, [z, x]: Complex) => {
    if (at >= first - 1e-9 && at <= last + 1e-9) ball = [x, path[1], z];
  };
  const places = foot.stances.map(({ end }, index) => {
    const [x, , z] = foot.anchors[index]!;
    return { first: foot.flats[index]!, last: end - 1, floor: [z, x] as const };
  });
  for (const { first, last, floor } of places) stand(first, last, floor);
  if (!cyclic) return ball;
  // Stances are there a cycle earlier and later, too.
  for (const { first, last, floor } of places)
    if (last >= count)
      stand(
        first - count,
        last - count,
        times(conj(factor), [floor[0] - way[0], floor[1] - way[1]]),
      );
  for (const { first, last, floor } of places) {
    const [z, x] = times(factor, floor);
    if (first === 0) stand(count, last + count, [way[0] + z, way[1] + x]);
  }
  return ball;
}
