/** Bones of a skeleton as rigid shapes: which there are, and where they lie in a pose. */

import type { ModelCard } from "@posefield/client";
import { LatheGeometry, Vector2 } from "three";

import type { Placed } from "./skeleton.ts";

/** Numbers of a bone's place: what its x, y and z become, and its origin. */
export const SIZE = 12;
/** Bones shorter than this, m, are nobody's to see. */
const SHORTEST = 0.03;
const [TORSO, MINOR] = [1.0, 0.1];

interface Bone {
  /** The joint that turns it. */
  readonly joint: number;
  /** The joint it leads to; -1 for a tip. */
  readonly child: number;
  readonly offset: readonly number[];
  readonly radius: number;
  /** How wide it ends, as a share of how wide it begins. */
  readonly taper: number;
  /** Nobody's to see from afar: a finger, a toe. */
  readonly minor: boolean;
}

export class Rig {
  readonly bones: readonly Bone[];

  constructor(card: ModelCard) {
    const { parents, offsets, tip_joints, tip_offsets } = card.skeleton;
    const below = lengthsBelow(parents, offsets);
    const inner = offsets.map((offset, child) => ({ joint: parents[child]!, child, offset }));
    const tips = tip_offsets.map((offset, i) => ({ joint: tip_joints[i]!, child: -1, offset }));
    const top = highest(card);
    this.bones = [...inner, ...tips]
      .filter(({ joint, offset }) => joint >= 0 && Math.hypot(...offset) >= SHORTEST)
      .map((bone) => ({
        ...bone,
        ...thickness(bone, bone.child < 0 ? 0 : below[bone.child]!, top),
      }));
  }

  /** Axes of the bones in their joints' own frames (B × 9), for bones of these offsets (J × 3). */
  shape(offsets: Float32Array): Float32Array {
    const out = new Float32Array(9 * this.bones.length);
    this.bones.forEach((bone, i) => {
      const own =
        bone.child < 0 ? bone.offset : offsets.subarray(3 * bone.child, 3 * bone.child + 3);
      axes(out, 9 * i, own, bone.radius);
    });
    return out;
  }

  /** Where the bones lie, SIZE numbers each, written into `out` from a place on. */
  lay(out: Float32Array, at: number, shape: Float32Array, { positions, rotations }: Placed): void {
    for (let bone = 0; bone < this.bones.length; bone++) {
      const { joint } = this.bones[bone]!;
      const to = at + SIZE * bone;
      for (let axis = 0; axis < 3; axis++) {
        turn(out, to + 3 * axis, shape, 9 * bone + 3 * axis, rotations, 4 * joint);
      }
      for (let i = 0; i < 3; i++) out[to + 9 + i] = positions[3 * joint + i]!;
    }
  }
}

/** A bone from the origin to (0, 1, 0), thickest at a third of it. */
export function boneShape(sides: number): LatheGeometry {
  const outline = [
    [0, -0.06],
    [0.6, -0.04],
    [0.95, 0.1],
    [1, 0.3],
    [0.82, 0.85],
    [0.6, 1],
    [0, 1.04],
  ].map(([x, y]) => new Vector2(x, y));
  return new LatheGeometry(outline, sides);
}

/** Metres of bones that hang on each joint, its own included. */
function lengthsBelow(
  parents: readonly number[],
  offsets: readonly (readonly number[])[],
): number[] {
  const found = offsets.map((offset) => Math.hypot(...offset));
  for (let joint = parents.length - 1; joint > 0; joint--) {
    const parent = parents[joint]!;
    if (parent > 0) found[parent]! += found[joint]!;
  }
  return found;
}

/** The joint whose tip is the highest at rest: the head. */
function highest({ skeleton }: ModelCard): number {
  const heights: number[] = [];
  skeleton.parents.forEach((parent, joint) => {
    heights.push(skeleton.offsets[joint]![1]! + (parent < 0 ? 0 : heights[parent]!));
  });
  let [found, most] = [-1, Number.NEGATIVE_INFINITY];
  skeleton.tip_joints.forEach((joint, i) => {
    const height = heights[joint]! + skeleton.tip_offsets[i]![1]!;
    if (height > most) [found, most] = [joint, height];
  });
  return found;
}

function thickness(
  bone: Pick<Bone, "joint" | "child" | "offset">,
  below: number,
  top: number,
): Pick<Bone, "radius" | "taper" | "minor"> {
  if (bone.child < 0 && bone.joint === top) return { radius: 0.09, taper: 0.85, minor: false };
  if (below > TORSO) return { radius: 0.12, taper: 1, minor: false };
  const length = Math.hypot(...bone.offset);
  return {
    radius: Math.min(0.07, Math.max(0.025, 0.19 * length)),
    taper: 0.7,
    minor: length < MINOR,
  };
}

function axes(out: Float32Array, at: number, along: ArrayLike<number>, radius: number): void {
  const [x, y, z] = [along[0]!, along[1]!, along[2]!];
  const length = Math.hypot(x, y, z) || 1;
  // Across: along × whichever axis is farther from it.
  const [a, b, c] = Math.abs(x) < Math.abs(z) ? [0, z, -y] : [y, -x, 0];
  const wide = radius / (Math.hypot(a, b, c) || 1);
  out.set([a * wide, b * wide, c * wide, x, y, z], at);
  const [i, j, k] = [out[at]!, out[at + 1]!, out[at + 2]!];
  out.set(
    [(y * k - z * j) / -length, (z * i - x * k) / -length, (x * j - y * i) / -length],
    at + 6,
  );
}

function turn(
  out: Float32Array,
  to: number,
  from: Float32Array,
  at: number,
  rotations: Float32Array,
  joint: number,
): void {
  const w = rotations[joint]!;
  const x = rotations[joint + 1]!;
  const y = rotations[joint + 2]!;
  const z = rotations[joint + 3]!;
  const i = from[at]!;
  const j = from[at + 1]!;
  const k = from[at + 2]!;
  const a = y * k - z * j;
  const b = z * i - x * k;
  const c = x * j - y * i;
  out[to] = i + 2 * (w * a + y * c - z * b);
  out[to + 1] = j + 2 * (w * b + z * a - x * c);
  out[to + 2] = k + 2 * (w * c + x * b - y * a);
}
