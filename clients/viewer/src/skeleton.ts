/** Joints in space from rotations local to their parents. */

/** World positions (J × 3, m) and rotations (J × 4, w x y z) of one frame, written into `out`. */
export interface Placed {
  readonly positions: Float32Array;
  readonly rotations: Float32Array;
}

export function placed(joints: number): Placed {
  return { positions: new Float32Array(3 * joints), rotations: new Float32Array(4 * joints) };
}

/** Forward kinematics; `frame` counts in `rotations` and `roots`. Parents come before children. */
export function place(
  out: Placed,
  parents: readonly number[],
  offsets: Float32Array,
  rotations: Float32Array,
  roots: Float32Array,
  frame: number,
): Placed {
  const { positions: p, rotations: r } = out;
  const first = 4 * parents.length * frame;
  for (let joint = 0; joint < parents.length; joint++) {
    const parent = parents[joint]!;
    const at = first + 4 * joint;
    if (parent < 0) {
      for (let i = 0; i < 4; i++) r[4 * joint + i] = rotations[at + i]!;
      for (let i = 0; i < 3; i++) p[3 * joint + i] = roots[3 * frame + i]!;
      continue;
    }
    const [a, b, c, d] = [
      r[4 * parent]!,
      r[4 * parent + 1]!,
      r[4 * parent + 2]!,
      r[4 * parent + 3]!,
    ];
    const [e, f, g, h] = [
      rotations[at]!,
      rotations[at + 1]!,
      rotations[at + 2]!,
      rotations[at + 3]!,
    ];
    r[4 * joint] = a * e - b * f - c * g - d * h;
    r[4 * joint + 1] = a * f + b * e + c * h - d * g;
    r[4 * joint + 2] = a * g - b * h + c * e + d * f;
    r[4 * joint + 3] = a * h + b * g - c * f + d * e;
    const [x, y, z] = [offsets[3 * joint]!, offsets[3 * joint + 1]!, offsets[3 * joint + 2]!];
    // v + 2 w (u × v) + 2 u × (u × v)
    const [i, j, k] = [c * z - d * y, d * x - b * z, b * y - c * x];
    p[3 * joint] = p[3 * parent]! + x + 2 * (a * i + c * k - d * j);
    p[3 * joint + 1] = p[3 * parent + 1]! + y + 2 * (a * j + d * i - b * k);
    p[3 * joint + 2] = p[3 * parent + 2]! + z + 2 * (a * k + b * j - c * i);
  }
  return out;
}
