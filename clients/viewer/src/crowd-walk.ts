/** Characters of a crowd: where each is, what it does, and its joints; typed arrays, filled in place. */

import type { Vector3 } from "three";

import { FRAMES, type Library, type Motions } from "./crowd-library.ts";
import { SIZE } from "./crowd-mesh.ts";
import { choose, type Ladder, type Lens, pixels } from "./detail.ts";

/** Square metres to a character. */
const ROOM = 9;
/** Radius, m, about which a character is looked for in the view: a body with arms out. */
export const REACH = 1.3;

interface Writable {
  [at: number]: number;
}

export class Crowd {
  readonly count: number;
  /** Half of the field's side, m. */
  readonly half: number;
  readonly x: Float32Array;
  readonly z: Float32Array;
  readonly heading: Float32Array;
  readonly level: Int8Array;
  readonly counts: Int32Array;
  readonly #phase: Float32Array;
  readonly #motion: Uint16Array;
  readonly #motions: Motions;

  constructor(motions: Motions, count: number) {
    this.#motions = motions;
    this.count = count;
    this.half = half(count);
    [this.x, this.z] = [new Float32Array(count), new Float32Array(count)];
    [this.heading, this.#phase] = [new Float32Array(count), new Float32Array(count)];
    this.#motion = new Uint16Array(count);
    this.level = new Int8Array(count).fill(-1);
    this.counts = new Int32Array(motions.levels);
    this.#scatter();
  }

  /** One to a cell of a grid, somewhere in it; the same every time. */
  #scatter(): void {
    const random = numbers(1);
    const side = Math.ceil(Math.sqrt(this.count));
    const cell = (2 * this.half) / side;
    for (let i = 0; i < this.count; i++) {
      this.x[i] = (Math.floor(i / side) + 0.2 + 0.6 * random()) * cell - this.half;
      this.z[i] = ((i % side) + 0.2 + 0.6 * random()) * cell - this.half;
      this.heading[i] = 2 * Math.PI * random();
      this.#phase[i] = random();
      this.#motion[i] = Math.floor(random() * this.#motions.count);
    }
  }

  /** Everybody goes on for so many seconds; who leaves the field comes back at its other side. */
  step(seconds: number): void {
    const { seconds: lasting, speeds, drifts, turning, walks } = this.#motions;
    const [half, side] = [this.half, 2 * this.half];
    for (let i = 0; i < this.count; i++) {
      const motion = this.#motion[i]!;
      const phase = this.#phase[i]! + seconds / lasting[motion]!;
      // There and back takes two.
      this.#phase[i] = phase % (walks ? 1 : 2);
      if (!walks) continue;
      const heading = this.heading[i]! + turning[motion]! * seconds;
      const way = heading + drifts[motion]!;
      const far = speeds[motion]! * seconds;
      this.heading[i] = heading;
      const x = this.x[i]! + far * Math.sin(way);
      const z = this.z[i]! + far * Math.cos(way);
      this.x[i] = x > half ? x - side : x < -half ? x + side : x;
      this.z[i] = z > half ? z - side : z < -half ? z + side : z;
    }
  }

  /** Levels by what shows; who has the camera inside is at the finest. */
  detail(ladder: Ladder, lens: Lens, camera: Vector3, limit: number): void {
    const wide = pixels(lens);
    const [mx, my, mz] = [ladder.middle[0]!, ladder.middle[1]!, ladder.middle[2]!];
    this.counts.fill(0);
    for (let i = 0; i < this.count; i++) {
      const [x, z] = [this.x[i]! + mx - camera.x, this.z[i]! + mz - camera.z];
      const y = my - camera.y;
      const far = Math.sqrt(x * x + y * y + z * z) - ladder.radius;
      const level = far > 0 ? choose(ladder.errors, wide / far, limit, this.level[i]!) : 0;
      this.level[i] = level;
      this.counts[level]!++;
    }
  }

  /** Where the motions end, they go back. */
  #folded(i: number): number {
    return this.#phase[i]! > 1 ? 2 - this.#phase[i]! : this.#phase[i]!;
  }

  /** Character `i` as four numbers (x, z, heading, phase) and two (motion at its level, level). */
  stand(standing: Writable, motion: Writable, at: number, i: number): void {
    const level = this.level[i]!;
    standing[4 * at] = this.x[i]!;
    standing[4 * at + 1] = this.z[i]!;
    standing[4 * at + 2] = this.heading[i]!;
    standing[4 * at + 3] = this.#folded(i);
    motion[2 * at] = level * this.#motions.count + this.#motion[i]!;
    motion[2 * at + 1] = level;
  }

  /** Character `i` as the graphics card computes it (webgpu/kernel.wgsl), eight numbers. */
  embody(out: Float32Array, at: number, i: number): void {
    const [motion, phase] = [this.#motion[i]!, this.#folded(i)];
    const { walks, seconds, turning, starts } = this.#motions;
    const gone = walks ? seconds[motion]! * phase : 0;
    const heading = this.heading[i]! - turning[motion]! * gone;
    const [half, across] = [Math.cos(heading / 2), Math.sin(heading / 2)];
    out[at] = half;
    out[at + 1] = across;
    out[at + 2] = this.x[i]!;
    out[at + 3] = this.z[i]!;
    out[at + 4] = phase;
    out[at + 5] = this.level[i]!;
    out[at + 6] = motion;
    out[at + 7] = 1;
    if (!walks) return;
    // A clip leads from its beginning along an arc: it begins where that arc ends here.
    const [cos, sin] = [1 - 2 * across * across, 2 * half * across];
    const [ahead, left] = this.#gone(motion, gone);
    const [dx, dz] = [left + starts[2 * motion]!, ahead + starts[2 * motion + 1]!];
    out[at + 2]! -= cos * dx + sin * dz;
    out[at + 3]! -= cos * dz - sin * dx;
  }

  /** Where a motion has led after some seconds: metres ahead and to the left of its beginning. */
  #gone(motion: number, seconds: number): [ahead: number, left: number] {
    const { speeds, drifts, turning } = this.#motions;
    const [speed, drift, rate] = [speeds[motion]!, drifts[motion]!, turning[motion]!];
    const half = (rate * seconds) / 2;
    // The chord of an arc.
    const way = speed * seconds * (Math.abs(half) < 1e-6 ? 1 : Math.sin(half) / half);
    return [way * Math.cos(drift + half), way * Math.sin(drift + half)];
  }

  /** The matrices of character `i`'s joints in the world, SIZE numbers each, written into `out`. */
  lay(out: Float32Array, { poses, count }: Library, i: number): void {
    const [cos, sin] = [Math.cos(this.heading[i]!), Math.sin(this.heading[i]!)];
    const phase = this.#folded(i);
    const frame = Math.min(FRAMES - 1, Math.floor(phase * FRAMES));
    const share = phase * FRAMES - frame;
    const size = out.length;
    const at = ((this.level[i]! * count + this.#motion[i]!) * (FRAMES + 1) + frame) * size;
    for (let joint = 0; joint < size; joint += SIZE) {
      for (let column = 0; column < 4; column++) {
        const to = joint + column;
        const from = at + to;
        const x = poses[from]! + share * (poses[from + size]! - poses[from]!);
        const y = poses[from + 4]! + share * (poses[from + 4 + size]! - poses[from + 4]!);
        const z = poses[from + 8]! + share * (poses[from + 8 + size]! - poses[from + 8]!);
        // The fourth column is where the joint is.
        out[to] = cos * x + sin * z + (column === 3 ? this.x[i]! : 0);
        out[to + 4] = y;
        out[to + 8] = cos * z - sin * x + (column === 3 ? this.z[i]! : 0);
      }
    }
  }
}

/** Half of the side, m, of the field of so many. */
export function half(count: number): number {
  return Math.sqrt(count * ROOM) / 2;
}

/** Even numbers from 0 to 1 of a seed (mulberry32). */
function numbers(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}
