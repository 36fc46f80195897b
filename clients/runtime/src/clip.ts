/** Clips: frames at a rate, feet that stand, and loops that close. */

import * as limits from "./constants.ts";
import { InvalidField } from "./errors.ts";
import { type FeetPlan, placeFeet, planFeet } from "./feet.ts";
import { findLegs, LimbPoses, quaternionAt } from "./limbs.ts";
import { type Controls, type Model, type Options, type Poses, range } from "./model.ts";
import type { Point } from "./session.ts";
import type { Grid } from "./stances.ts";
import { cycleOf, lineOf, relativeRoot, type Stride } from "./strides.ts";
import {
  arcFactor,
  clamp,
  difference,
  direction,
  multiply,
  times as product,
  type Quaternion,
  roundEven,
  sum,
  turn,
} from "./vectors.ts";

export interface ClipOptions extends Options {
  /** Frames a second; 30 by default. */
  readonly fps?: number;
  /** One whole cycle, whose last frame equals its first but for the travel. */
  readonly loop?: boolean;
  readonly root?: "travelling" | "in_place";
  /** By default feet stand where they can: `model.stands`. */
  readonly feet?: "stand" | "as_predicted" | undefined;
}

/** A stance of a foot: its joint, when it is flat, s, and its place, m. */
export interface Stance {
  readonly joint: number;
  readonly begin: number;
  readonly end: number;
  readonly position: readonly [number, number, number];
}

export interface Clip extends Poses {
  readonly frames: number;
  readonly rate: number;
  /** Of the whole motion; empty for feet as predicted. */
  readonly stances: readonly Stance[];
}

export async function clip(model: Model, controls: Controls, options: ClipOptions): Promise<Clip> {
  const { card, session } = model;
  const point = model.point(controls, options);
  const rate = range("fps", options.fps ?? 30, ...limits.FPS_RANGE, "frames a second");
  if (options.loop && !card.cyclic)
    throw new InvalidField("loop", "true, but this model's last pose does not lead into its first");
  const stands = wantsStandingFeet(model, options);
  const names = [
    ...(["rotations", "root_position", "bone_offsets", "duration", "sigma", "travel"] as const),
    ...(stands ? (["contacts"] as const) : []),
    ...(card.curves.length ? (["curves"] as const) : []),
  ];
  // The same part of the graph as below: to open another one takes longer than to run it.
  const whole = (await session.run(point, [0], ...names)).duration[0]!;
  const { times, duration } = await frameTimes(model, point, whole, rate, !!options.loop);
  const inPlace = options.root === "in_place" && card.root === "travelling";
  const cyclic = card.cyclic;
  const steps = clamp(roundEven(whole * limits.PLAN_RATE), limits.FEWEST_STEPS, limits.MOST_STEPS);
  const count = stands ? steps + Number(!cyclic) : 0;
  const planTimes = Array.from({ length: count }, (_, step) => step * (whole / steps));
  const outputs = await session.run(point, [...times, ...planTimes, 0, limits.AFTER_END], ...names);
  const joints = card.skeleton.names.length;
  const frames = times.length;
  const rotations = Float64Array.from(outputs.rotations.subarray(0, 4 * joints * frames));
  const roots = Float64Array.from(outputs.root_position.subarray(0, 3 * frames));
  const stride = cyclic
    ? cycleOf(outputs, frames + count + 1, whole)
    : lineOf(outputs.root_position, frames + count, whole);
  let stances: Stance[] = [];
  if (stands) {
    const bones = outputs.bone_offsets;
    const grid = gridOf(stride, count, (count - Number(!cyclic)) / whole, cyclic);
    const legs = findLegs(card);
    const tips = legs.map(({ tip }) => tip);
    const { parents } = card.skeleton;
    const planPoses = {
      frames: count,
      rotations: outputs.rotations.subarray(4 * joints * frames),
      roots: outputs.root_position.subarray(3 * frames),
      bones,
    };
    const plan = planFeet(
      new LimbPoses(parents, tips, planPoses),
      legs.map((limb) => ({
        limb,
        contact: card.contacts[limb.contact]!,
        likely: planTimes.map(
          (_, step) => outputs.contacts![(frames + step) * card.contacts.length + limb.contact]!,
        ),
      })),
      grid,
    );
    const poses = new LimbPoses(parents, tips, { frames, rotations, roots, bones });
    placeFeet(plan, poses, times, rotations, roots);
    stances = stancesOf(plan);
  }
  if (inPlace) removeTravel(stride, times, rotations, roots);
  const closing = options.loop
    ? closingPose(inPlace || card.root !== "travelling" ? null : stride, rotations, roots, joints)
    : { rotations: [], roots: [] };
  const curves = outputs.curves?.subarray(0, card.curves.length * frames) ?? [];
  return {
    names: card.skeleton.names,
    parents: card.skeleton.parents,
    frames: frames + Number(!!options.loop),
    rate,
    times: Float64Array.from(options.loop ? [...times, duration] : times),
    rotations: Float32Array.from([...rotations, ...closing.rotations]),
    rootPosition: Float32Array.from([...roots, ...closing.roots]),
    boneOffsets: outputs.bone_offsets,
    curves: Float32Array.from([
      ...curves,
      ...(options.loop ? curves.slice(0, card.curves.length) : []),
    ]),
    duration,
    sigma: outputs.sigma[0]!,
    stances,
  };
}

function wantsStandingFeet({ stands }: Model, { feet }: ClipOptions): boolean {
  if (feet === "stand" && !stands)
    throw new InvalidField("feet", "'stand', but this model knows no legs that travel");
  return feet === undefined ? stands : feet === "stand";
}

function gridOf(
  { way, turned, start }: Stride,
  count: number,
  rate: number,
  cyclic: boolean,
): Grid {
  if (!cyclic) return { count, rate, cyclic, way: [0, 0], factor: [1, 0] };
  const factor = direction(turned);
  const end = sum(start, product(way, arcFactor(turned)));
  return { count, rate, cyclic, way: difference(end, product(factor, start)), factor };
}

function stancesOf({ feet, grid }: FeetPlan): Stance[] {
  return feet.flatMap(({ limb, stances, anchors, flats }) =>
    stances.map(({ end }, index) => ({
      joint: limb.tip,
      begin: Math.min(flats[index]!, end - 1) / grid.rate,
      end: (end - 1) / grid.rate,
      position: anchors[index]!,
    })),
  );
}

/** Times of the frames in the motion, s, and the duration as it is played. */
async function frameTimes(
  model: Model,
  point: Point,
  whole: number,
  rate: number,
  loop: boolean,
): Promise<{ times: number[]; duration: number }> {
  const { card } = model;
  if (loop) {
    const steps = Math.max(1, roundEven(whole * rate));
    const times = Array.from({ length: steps }, (_, step) => (step * whole) / steps);
    return { times, duration: whole };
  }
  const moments: number[] = [];
  if (!card.cyclic && card.event) {
    const { share } = card.event;
    if (share > 0 && share < 1)
      moments.push(await timeOfFrame(model, point, whole, share * (card.frames - 1)));
    if (whole * rate > 0.5) moments.push(whole);
  }
  const knots = playback(rate, whole, moments);
  const duration = moments.length ? knots.at(-1)![0] / rate : whole;
  const count = Math.floor(duration * rate + limits.FRAME_ROUNDING) + 1;
  const times = Array.from({ length: count }, (_, frame) => {
    const found = knots.findIndex(([knot]) => knot >= frame);
    const after = clamp(found < 0 ? knots.length : found, 1, knots.length - 1);
    const [[before, shift], [knot, next]] = [knots[after - 1]!, knots[after]!];
    const share = clamp((frame - before) / (knot - before), 0, 1);
    const gentle = share * share * (3 - 2 * share);
    const later = frame === knot ? next : shift + gentle * (next - shift);
    return Math.min(frame / rate + later, whole);
  });
  return { times, duration };
}

/** Frames from the start at which moments are played, and by how much later these are, s. */
function playback(
  rate: number,
  duration: number,
  moments: readonly number[],
): (readonly [number, number])[] {
  const shifts = new Map<number, number>();
  for (const moment of moments.toReversed()) {
    const frame = roundEven(moment * rate);
    shifts.set(frame, moment - frame / rate);
  }
  if (!shifts.has(0)) shifts.set(0, 0);
  // The end plays at its own time, unless it is a moment or one before it has the last frame.
  const end = duration * rate;
  const latest = Math.max(...shifts.keys());
  if (shifts.size === 1 || (!moments.includes(duration) && latest < end - limits.FRAME_ROUNDING))
    shifts.set(end, 0);
  return [...shifts].sort(([a], [b]) => a - b);
}

/** The time, s, of a canonical frame of a motion. */
async function timeOfFrame(model: Model, point: Point, whole: number, frame: number) {
  const times = Array.from(
    { length: limits.WARP_STEPS },
    (_, step) => (step * whole) / (limits.WARP_STEPS - 1),
  );
  const { frame: frames } = await model.session.run(point, times, "frame");
  const after = clamp(
    frames.findIndex((value) => value > frame),
    1,
    limits.WARP_STEPS - 1,
  );
  const [low, high] = [frames[after - 1]!, frames[after]!];
  return times[after - 1]! + ((frame - low) / (high - low)) * (times[after]! - times[after - 1]!);
}

/** Put poses into the frame that travels along the way, placed at the start of the clip. */
function removeTravel(
  stride: Stride,
  times: readonly number[],
  rotations: Float64Array,
  roots: Float64Array,
): void {
  const joints = rotations.length / (4 * times.length);
  for (const [frame, time] of times.entries()) {
    const { root, heading } = relativeRoot(stride, time / stride.duration, roots, frame);
    const [z, x] = stride.start;
    roots.set([x + root[0], root[1], z + root[2]], 3 * frame);
    rotations.set(multiply(heading, quaternionAt(rotations, frame * joints)), 4 * frame * joints);
  }
}

/** The first pose, moved by the travel of the cycle if any. */
function closingPose(
  stride: Stride | null,
  rotations: Float64Array,
  roots: Float64Array,
  joints: number,
): { rotations: number[]; roots: number[] } {
  const first = [...rotations.subarray(0, 4 * joints)];
  const root = [...roots.subarray(0, 3)];
  if (!stride) return { rotations: first, roots: root };
  const heading: Quaternion = multiply(turn([0, 1, 0], stride.turned), quaternionAt(first, 0));
  const [z, x] = product(stride.way, arcFactor(stride.turned));
  return {
    rotations: [...heading, ...first.slice(4)],
    roots: [root[0]! + x, root[1]!, root[2]! + z],
  };
}
