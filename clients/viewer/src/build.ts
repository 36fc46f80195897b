/** How thick a body is around each of its bones, by the part that a joint plays. */

import type { ModelCard } from "@posefield/client";

/** From the joint that turns it (by) to where it ends; tips end on no joint. */
export interface Bone {
  readonly by: number;
  /** -1 for a tip. */
  readonly to: number;
  /** Which tip, where it is one. */
  readonly tip: number;
  readonly shape: Shape;
}

/** Radii at the start, the middle and the end of a bone, m; wide: to the sides, times that. */
export interface Shape {
  readonly radii: readonly [number, number, number];
  readonly wide: number;
  readonly deep: number;
  /** How far the round ends go beyond the joints, times the radius. */
  readonly caps: readonly [number, number];
}

/** Bones are drawn from this length on, m. */
const SHORTEST = 0.008;

const shape = (radii: Shape["radii"], wide = 1, deep = 1, caps: Shape["caps"] = [1, 1]): Shape => ({
  radii,
  wide,
  deep,
  caps,
});

/** Of somebody 1.75 m tall, by role of the joint that turns the bone. */
const SHAPES: Readonly<Record<string, Shape>> = {
  hips: shape([0.105, 0.105, 0.098], 1.32, 0.98, [0.7, 0.5]),
  spine: shape([0.1, 0.1, 0.104], 1.28, 0.95, [0.7, 0.6]),
  chest: shape([0.104, 0.112, 0.116], 1.32, 0.98, [0.6, 0.6]),
  upperChest: shape([0.114, 0.1, 0.052], 1.34, 0.96, [0.6, 0.6]),
  neck: shape([0.055, 0.05, 0.05], 1, 1, [0.6, 0.6]),
  head: shape([0.074, 0.104, 0.086], 0.86, 1.02, [0.7, 0.75]),
  Shoulder: shape([0.05, 0.056, 0.056], 1, 1, [0.6, 0.9]),
  UpperArm: shape([0.053, 0.047, 0.038], 1, 1, [1, 1]),
  LowerArm: shape([0.038, 0.037, 0.026], 1, 1, [1, 0.8]),
  Hand: shape([0.026, 0.032, 0.024], 1.15, 0.62, [0.8, 0.6]),
  UpperLeg: shape([0.086, 0.076, 0.054], 1, 1, [0.6, 1]),
  LowerLeg: shape([0.054, 0.054, 0.036], 1, 1, [1, 0.9]),
  Foot: shape([0.038, 0.036, 0.032], 1.15, 0.85, [1, 0.8]),
  Toes: shape([0.032, 0.03, 0.024], 1.3, 0.65, [0.9, 0.9]),
};
const HIP = shape([0.095, 0.092, 0.086], 1, 1, [0.7, 0.7]);
const FINGER = shape([0.012, 0.011, 0.009], 1, 1, [1, 1]);
const PLAIN = shape([0.04, 0.036, 0.03]);

/** All bones that are long enough to be seen, thick as their parts are. */
export function bones(card: ModelCard): readonly Bone[] {
  const { offsets, parents, tip_joints, tip_offsets } = card.skeleton;
  const scale = stature(card) / 1.75;
  const roles = parts(card);
  const inner = parents.flatMap((by, to) =>
    by >= 0 && length(offsets[to]!) > SHORTEST
      ? [{ by, to, tip: -1, shape: sized(formed(roles, by, to, length(offsets[to]!)), scale) }]
      : [],
  );
  const outer = tip_joints.flatMap((by, tip) =>
    length(tip_offsets[tip]!) > SHORTEST
      ? [{ by, to: -1, tip, shape: sized(formed(roles, by, -1, length(tip_offsets[tip]!)), scale) }]
      : [],
  );
  return [...inner, ...outer];
}

/** From the lowest joint or tip to the highest, m. */
export function stature({ skeleton }: ModelCard): number {
  const heights: number[] = [];
  skeleton.parents.forEach((parent, joint) => {
    heights.push(parent < 0 ? 0 : heights[parent]! + skeleton.offsets[joint]![1]!);
  });
  const tips = skeleton.tip_joints.map(
    (joint, tip) => heights[joint]! + skeleton.tip_offsets[tip]![1]!,
  );
  const all = [...heights, ...tips];
  return Math.max(0.3, Math.max(...all) - Math.min(...all));
}

/** Of each joint its part, or that of the nearest joint above it that has one; "" for none. */
function parts({ roles, skeleton }: ModelCard): readonly string[] {
  const own = new Map(Object.entries(roles).map(([part, name]) => [name, part]));
  const found: string[] = [];
  skeleton.parents.forEach((parent, joint) => {
    const part = own.get(skeleton.names[joint]!);
    found.push(part ?? (parent < 0 ? "" : below(found[parent]!)));
  });
  return found;
}

/** What hangs below a part without one of its own. */
function below(part: string): string {
  if (/Hand$/.test(part)) return "finger";
  return part;
}

function formed(roles: readonly string[], by: number, to: number, long: number): Shape {
  const part = roles[by]!;
  const next = to < 0 ? "" : roles[to]!;
  if (part === "hips" && /UpperLeg$/.test(next)) return HIP;
  if (part === "finger" || next === "finger")
    return next && part !== "finger" ? hand(long) : FINGER;
  if (/hest$|spine/.test(part) && /Shoulder$|UpperArm$/.test(next)) return SHAPES["Shoulder"]!;
  const found = SHAPES[part] ?? SHAPES[part.replace(/^left|^right/, "")];
  return found ?? slender(long);
}

function hand(long: number): Shape {
  return long > 0.05 ? SHAPES["Hand"]! : FINGER;
}

/** Where nobody says what a bone is: a fifth as thick as long. */
function slender(long: number): Shape {
  const thick = Math.min(2.2, (0.2 * long) / PLAIN.radii[0]);
  return sized(PLAIN, Math.max(0.2, thick));
}

function sized({ radii: [a, b, c], ...rest }: Shape, scale: number): Shape {
  return { ...rest, radii: [scale * a, scale * b, scale * c] };
}

function length(offset: readonly number[]): number {
  return Math.hypot(...offset);
}
