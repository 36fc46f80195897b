/** Vectors, unit quaternions w x y z, and points on the floor as complex numbers z + i x. */

export type Vector = readonly [number, number, number];
export type Quaternion = readonly [number, number, number, number];
/** Real part forward, imaginary part to the left. */
export type Complex = readonly [number, number];

export const ZERO: Vector = [0, 0, 0];

export function add(a: Vector, b: Vector): Vector {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

export function subtract(a: Vector, b: Vector): Vector {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

export function scale(a: Vector, factor: number): Vector {
  return [a[0] * factor, a[1] * factor, a[2] * factor];
}

export function dot(a: Vector, b: Vector): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function cross(a: Vector, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function norm(a: Vector): number {
  return Math.sqrt(dot(a, a));
}

/** The vector divided by its length, or by `least` if that is more. */
export function unit(a: Vector, least = 1e-12): Vector {
  return scale(a, 1 / Math.max(norm(a), least));
}

export function multiply(a: Quaternion, b: Quaternion): Quaternion {
  const [aw, ax, ay, az] = a;
  const [bw, bx, by, bz] = b;
  return [
    aw * bw - ax * bx - ay * by - az * bz,
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
  ];
}

export function conjugate([w, x, y, z]: Quaternion): Quaternion {
  return [w, -x, -y, -z];
}

export function normalized(q: Quaternion): Quaternion {
  const size = Math.hypot(...q);
  return [q[0] / size, q[1] / size, q[2] / size, q[3] / size];
}

export function rotate(q: Quaternion, v: Vector): Vector {
  const axis: Vector = [q[1], q[2], q[3]];
  const t = scale(cross(axis, v), 2);
  return add(add(v, scale(t, q[0])), cross(axis, t));
}

/** The quaternion of a rotation by an angle, rad, about a unit axis. */
export function turn(axis: Vector, angle: number): Quaternion {
  const sine = Math.sin(angle / 2);
  return [Math.cos(angle / 2), axis[0] * sine, axis[1] * sine, axis[2] * sine];
}

/** The rotation by the smallest angle from one direction to another. */
export function shortestTurn(before: Vector, after: Vector): Quaternion {
  const real = Math.max(norm(before) * norm(after) + dot(before, after), 1e-12);
  return normalized([real, ...cross(before, after)]);
}

export function times(a: Complex, b: Complex): Complex {
  return [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]];
}

export function sum(a: Complex, b: Complex): Complex {
  return [a[0] + b[0], a[1] + b[1]];
}

export function difference(a: Complex, b: Complex): Complex {
  return [a[0] - b[0], a[1] - b[1]];
}

export function scaled(a: Complex, factor: number): Complex {
  return [a[0] * factor, a[1] * factor];
}

export function conj(a: Complex): Complex {
  return [a[0], -a[1]];
}

/** The unit vector of a heading, rad. */
export function direction(heading: number): Complex {
  return [Math.cos(heading), Math.sin(heading)];
}

/** The factor from a way to the displacement along its arc, for a change of heading, rad. */
export function arcFactor(turned: number): Complex {
  const half = turned / 2;
  const sinc = half === 0 ? 1 : Math.sin(half) / half;
  return [Math.cos(half) * sinc, Math.sin(half) * sinc];
}

export function clamp(value: number, low: number, high: number): number {
  return Math.min(Math.max(value, low), high);
}

/** The nearest whole number, the even one of two, as Python rounds. */
export function roundEven(value: number): number {
  const floor = Math.floor(value);
  if (value - floor !== 0.5) return Math.round(value);
  return floor % 2 === 0 ? floor : floor + 1;
}
