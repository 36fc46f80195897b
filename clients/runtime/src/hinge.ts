/** Limits of a knee or an elbow: it turns about one axis, within the range of its captures. */

import type { Hinge } from "./card.ts";
import { HINGE_FREE, HINGE_MOST } from "./constants.ts";
import {
  clamp,
  conjugate,
  cross,
  dot,
  multiply,
  normalized,
  type Quaternion,
  rotate,
  scale,
  subtract,
  unit,
  type Vector,
} from "./vectors.ts";

type Angles = [number, number, number];
const WHOLE_TURN = 2 * Math.PI;

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
      const room = HINGE_MOST + (away > 0 ? high - near : near - low);
      const excess = (Math.abs(away) - HINGE_FREE) / (room - HINGE_FREE);
      if (excess <= 0) return angle;
      return near + Math.sign(away) * (HINGE_FREE + (room - HINGE_FREE) * Math.tanh(excess));
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
