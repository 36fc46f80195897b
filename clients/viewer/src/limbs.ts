/** The skin of a mannequin: a round-ended tube for each bone, and which joints move it. */

import type { Bone, Shape } from "./build.ts";

/** Points around a ring, and rings along a bone, ends included. */
const AROUND = 12;
const CAP = 3;
const BODY = 6;
/** Shares of a bone from its ends in which its neighbours move the skin too. */
const SOFT = 0.28;

/** Where each point of the skin is about its bone; the bone may become longer or shorter. */
export interface Skin {
  /** Along the bone: share of its length; then beyond its end, across and deep, m. V × 4. */
  readonly local: Float32Array;
  readonly bone: Uint16Array;
  readonly index: readonly number[];
  readonly joints: Uint16Array;
  readonly weights: Float32Array;
}

export function skin(bones: readonly Bone[], parents: readonly number[]): Skin {
  const rings = BODY + 2 * CAP;
  const points = bones.length * rings * AROUND;
  const made = {
    local: new Float32Array(4 * points),
    bone: new Uint16Array(points),
    joints: new Uint16Array(4 * points),
    weights: new Float32Array(4 * points),
    index: [] as number[],
  };
  bones.forEach((bone, at) => {
    for (let ring = 0; ring < rings; ring++) {
      const [along, beyond, radius] = profile(bone.shape, ring);
      for (let i = 0; i < AROUND; i++) {
        const point = (at * rings + ring) * AROUND + i;
        const angle = (2 * Math.PI * i) / AROUND;
        const across = Math.cos(angle) * radius * bone.shape.wide;
        const deep = Math.sin(angle) * radius * bone.shape.deep;
        made.local.set([along, beyond, across, deep], 4 * point);
        made.bone[point] = at;
        bind(made, point, bone, parents, along);
        if (ring + 1 < rings) quad(made.index, (at * rings + ring) * AROUND, i);
      }
    }
  });
  return made;
}

/** Positions (V × 3, m) in the frame of the body at rest, written into `out`.
 *
 * starts, ends: of each bone, m; side: unit vector that lies to a body's left.
 */
export function shaped(
  out: Float32Array,
  { local, bone }: Skin,
  starts: Float32Array,
  ends: Float32Array,
  side: readonly number[],
): void {
  const frames = axes(starts, ends, side);
  for (let point = 0; point < bone.length; point++) {
    const at = bone[point]!;
    const along = local[4 * point]!;
    for (let i = 0; i < 3; i++) {
      const start = starts[3 * at + i]!;
      out[3 * point + i] =
        start +
        along * (ends[3 * at + i]! - start) +
        local[4 * point + 1]! * frames[9 * at + i]! +
        local[4 * point + 2]! * frames[9 * at + 3 + i]! +
        local[4 * point + 3]! * frames[9 * at + 6 + i]!;
    }
  }
}

/** Along, across and deep of each bone (B × 9): across is as near to `side` as may be. */
function axes(starts: Float32Array, ends: Float32Array, side: readonly number[]): Float32Array {
  const found = new Float32Array(3 * starts.length);
  for (let at = 0; at < starts.length / 3; at++) {
    const along = unit([0, 1, 2].map((i) => ends[3 * at + i]! - starts[3 * at + i]!));
    // Bones that lie sideways themselves, as arms held out do, take what lies before the body.
    const sideways = Math.abs(dot(along, side)) > 0.8;
    const wanted = sideways ? cross(side, [0, 1, 0]) : side;
    const deep = unit(cross(wanted, along));
    found.set([...along, ...cross(along, deep), ...deep], 9 * at);
  }
  return found;
}

/** A ring: share of the bone's length, metres beyond its end, and radius. */
function profile(shape: Shape, ring: number): readonly [number, number, number] {
  const [start, , end] = shape.radii;
  if (ring < CAP) {
    const angle = (0.5 * Math.PI * (ring + 0.03)) / (CAP + 0.03);
    return [0, -shape.caps[0] * start * Math.cos(angle), start * Math.sin(angle)];
  }
  if (ring >= CAP + BODY) {
    const angle = (0.5 * Math.PI * (ring - CAP - BODY + 1)) / (CAP + 0.03);
    return [1, shape.caps[1] * end * Math.sin(angle), end * Math.cos(angle)];
  }
  const along = (ring - CAP) / (BODY - 1);
  return [along, 0, through(shape.radii, along)];
}

/** A parabola through the three radii. */
function through([a, b, c]: Shape["radii"], at: number): number {
  return a * (1 - at) * (1 - 2 * at) + 4 * b * at * (1 - at) + c * at * (2 * at - 1);
}

function bind(
  made: { readonly joints: Uint16Array; readonly weights: Float32Array },
  point: number,
  { by, to }: Bone,
  parents: readonly number[],
  along: number,
): void {
  const above = parents[by]!;
  const near = above < 0 ? 0 : 0.5 * soft(along);
  const far = to < 0 ? 0 : 0.5 * soft(1 - along);
  made.joints.set([by, Math.max(0, above), Math.max(0, to), 0], 4 * point);
  made.weights.set([1 - near - far, near, far, 0], 4 * point);
}

/** From one at a joint to none within the bone. */
function soft(along: number): number {
  const x = Math.min(1, along / SOFT);
  return 1 - x * x * (3 - 2 * x);
}

function quad(index: number[], ring: number, i: number): void {
  const next = (i + 1) % AROUND;
  const [a, b, c, d] = [ring + i, ring + next, ring + AROUND + i, ring + AROUND + next];
  index.push(a, c, b, b, c, d);
}

function cross(a: readonly number[], b: readonly number[]): number[] {
  return [
    a[1]! * b[2]! - a[2]! * b[1]!,
    a[2]! * b[0]! - a[0]! * b[2]!,
    a[0]! * b[1]! - a[1]! * b[0]!,
  ];
}

function unit(a: readonly number[]): number[] {
  const size = Math.hypot(...a) || 1;
  return a.map((x) => x / size);
}

function dot(a: readonly number[], b: readonly number[]): number {
  return a.reduce((sum, x, i) => sum + x * b[i]!, 0);
}
