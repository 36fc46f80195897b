/** Inverse kinematics of a leg of two bones, in closed form. */

import type { Hinge } from "./card.ts";
import * as limits from "./constants.ts";
import type { Limb, LimbPoses } from "./limbs.ts";
import {
  add,
  clamp,
  conjugate,
  cross,
  dot,
  multiply,
  norm,
  normalized,
  type Quaternion,
  rotate,
  scale,
  shortestTurn,
  subtract,
  unit,
  type Vector,
} from "./vectors.ts";

/** Smallest and largest distance of a limb's ends, m, within the range of its hinge. */
export function distances(poses: LimbPoses, limb: Limb): [number, number] {
  const [above, below] = [poses.length(limb.middle), poses.length(limb.lower)];
  const [squares, products] = [above ** 2 + below ** 2, 2 * above * below];
  const bends = [limb.hinge.high[0] + limits.HINGE_FREE, limb.hinge.low[0] - limits.HINGE_FREE];
  const [shortest, longest] = bends.map((bend) =>
    Math.sqrt(squares + Math.cos(clamp(bend, 0, Math.PI)) * products),
  );
  return [shortest!, longest!];
}

/** Distance, m, up to which the end of a limb follows its target exactly. */
export function firmReach(poses: LimbPoses, limb: Limb, frame: number): number {
  const length = distances(poses, limb)[1];
  return Math.max(
    norm(poses.between(limb.upper, limb.lower, frame)),
    limits.REACH * length - limits.SOFTNESS,
  );
}

/** Distance, m, that a leg spans where it is wanted to span some. */
export function legChord(poses: LimbPoses, leg: Limb, frame: number, distance: number): number {
  const [shortest, longest] = distances(poses, leg);
  let chord: number;
  if (leg.tip === leg.lower) {
    const firm = firmReach(poses, leg, frame);
    const soft = Math.max(Math.max(limits.REACH * longest, firm) - firm, 1e-9);
    const beyond = Math.max(distance - firm, 0);
    chord = Math.min(distance, firm - soft * Math.expm1(-beyond / soft));
  } else {
    const source = norm(poses.between(leg.upper, leg.lower, frame));
    const more = distance - source;
    const room = Math.max(limits.STRAIGHT * longest - source, 1e-4);
    chord = source + more / Math.sqrt(1 + (Math.max(more, 0) / room) ** 2);
    const press = limits.PRESS / (1 + (room / limits.PRESS) ** 2);
    chord += press * Math.tanh(Math.max(-more, 0) / press);
  }
  return Math.max(chord, 1.001 * shortest + 1e-6);
}

/**
 * Orientations of both bones with which the end of a limb comes where it is wanted.
 *
 * The middle joint bends to the distance, and the limb turns by the smallest rotation. end: from
 * the limb's upper joint, m.
 */
export function solve(
  poses: LimbPoses,
  { upper, middle, lower, hinge }: Limb,
  frame: number,
  end: Vector,
): [Quaternion, Quaternion] {
  const outer = poses.orientation(upper, frame);
  const inner = poses.orientation(middle, frame);
  const above = rotate(conjugate(outer), poses.between(upper, middle, frame));
  const below = rotate(conjugate(inner), poses.between(middle, lower, frame));
  const bent = hinge.bend(multiply(conjugate(outer), inner), above, below, dot(end, end));
  const towards = rotate(outer, add(above, rotate(bent, below)));
  const thigh = multiply(shortestTurn(towards, end), outer);
  return [thigh, multiply(thigh, bent)];
}

type Angles = [number, number, number];
const WHOLE_TURN = 2 * Math.PI;

/** Limits of a knee or an elbow: it turns about one axis, within the range of its captures. */
export class HingeLimits {
  readonly low: Vector;
  readonly high: Vector;
  readonly #axis: Vector;
  /** The reference turned by nothing, and about axis, bone and their vector product. */
  readonly #frames: readonly Quaternion[];

  constructor(hinge: Hinge) {
    this.low = hinge.low;
    this.high = hinge.high;
    this.#axis = unit(hinge.axis);
    // Numbers of a card are rounded.
    const bone = unit(subtract(hinge.bone, scale(this.#axis, dot(hinge.bone, this.#axis))));
    const reference = normalized(hinge.reference);
    const axes = [this.#axis, bone, cross(this.#axis, bone)];
    const turns: Quaternion[] = axes.map(([x, y, z]) => [0, x, y, z]);
    this.#frames = [[1, 0, 0, 0] as const, ...turns].map((frame) => multiply(reference, frame));
  }

  /**
   * The local rotation with which the ends of a limb are apart by the root of `square`, m².
   *
   * above, below: bones, m, in the frames of the parent and of the joint. Turns off the hinge stay,
   * within the limits.
   */
  bend(local: Quaternion, above: Vector, below: Vector, square: number): Quaternion {
    const angles = this.#limit(this.#anglesOf(local));
    const straight = this.#rotation([0, angles[1], angles[2]], local);
    const back = conjugate(this.#frames[0]!);
    const lower = rotate(back, rotate(straight, below));
    const upper = rotate(back, above);
    // upper . exp(axis t) lower = constant + cosine cos t + sine sin t
    const constant = dot(upper, this.#axis) * dot(lower, this.#axis);
    const cosine = dot(upper, lower) - constant;
    const sine = dot(upper, cross(this.#axis, lower));
    const sizes = dot(above, above) + dot(below, below);
    const share = (0.5 * (square - sizes) - constant) / Math.hypot(cosine, sine);
    angles[0] = Math.atan2(sine, cosine) + Math.acos(clamp(share, -1, 1));
    return this.#rotation(this.#limit(angles), local);
  }

  #anglesOf(local: Quaternion): Angles {
    const [real, flexed, twisted, aside] = this.#frames.map(
      ([w, x, y, z]) => w * local[0] + x * local[1] + y * local[2] + z * local[3],
    ) as [number, number, number, number];
    const middle = 0.5 * (this.low[0] + this.high[0]);
    let flexion = 2 * Math.atan2(flexed, real);
    flexion -= WHOLE_TURN * Math.round((flexion - middle) / WHOLE_TURN);
    const size = Math.hypot(real, flexed);
    const cosine = real / Math.max(size, 1e-12);
    const sine = flexed / Math.max(size, 1e-12);
    const twist = 2 * Math.atan2(cosine * twisted + sine * aside, size);
    return [flexion, twist, 2 * Math.atan2(cosine * aside - sine * twisted, size)];
  }

  /** Angles that are at most HINGE_MOST beyond the captured range. */
  #limit(angles: Angles): Angles {
    return angles.map((angle, index) => {
      const [low, high] = [this.low[index]!, this.high[index]!];
      const near = clamp(angle, low, high);
      let away = angle - near;
      if (index === 0) away -= WHOLE_TURN * Math.round(away / WHOLE_TURN);
      const room = limits.HINGE_MOST + (away > 0 ? high - near : near - low);
      const excess = (Math.abs(away) - limits.HINGE_FREE) / (room - limits.HINGE_FREE);
      if (excess <= 0) return angle;
      return (
        near +
        Math.sign(away) * (limits.HINGE_FREE + (room - limits.HINGE_FREE) * Math.tanh(excess))
      );
    }) as Angles;
  }

  /** The rotation of angles, with the sign of the rotation `near`. */
  #rotation(angles: Vector | Angles, near: Quaternion): Quaternion {
    const [cosine, sine] = [Math.cos(angles[0] / 2), Math.sin(angles[0] / 2)];
    const [twist, sideways] = [Math.tan(angles[1] / 2), Math.tan(angles[2] / 2)];
    const shares = [
      cosine,
      sine,
      cosine * twist - sine * sideways,
      cosine * sideways + sine * twist,
    ];
    const sum: [number, number, number, number] = [0, 0, 0, 0];
    for (const [row, share] of shares.entries())
      for (const axis of [0, 1, 2, 3] as const) sum[axis] += share * this.#frames[row]![axis];
    const same = sum[0] * near[0] + sum[1] * near[1] + sum[2] * near[2] + sum[3] * near[3];
    return normalized(same >= 0 ? sum : [-sum[0], -sum[1], -sum[2], -sum[3]]);
  }
}
