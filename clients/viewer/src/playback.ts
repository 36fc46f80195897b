/** Time of a clip that plays, and its pose and curves between two frames. */

import type { Motion } from "@posefield/client";
import { Quaternion } from "three";

export interface Moment {
  readonly time: number;
  readonly playing: boolean;
  /** Number of times that the end was passed. */
  readonly laps: number;
}

/** The moment `seconds` later. At the end a clip begins again, or stops there. */
export function advanced(time: number, seconds: number, duration: number, loop: boolean): Moment {
  const next = time + seconds;
  if (next < duration) return { time: Math.max(0, next), playing: true, laps: 0 };
  if (!loop || duration <= 0) return { time: duration, playing: false, laps: 0 };
  return { time: next % duration, playing: true, laps: Math.floor(next / duration) };
}

/** Joints' rotations local to their parents (J × 4) and the root (3, m), at one time. */
export interface Pose {
  readonly rotations: Float32Array;
  readonly root: Float32Array;
}

export function pose(joints: number): Pose {
  return { rotations: new Float32Array(4 * joints), root: new Float32Array(3) };
}

/** Frames of a motion, from which poses are interpolated. */
export type Track = Pick<Motion, "rate" | "times" | "rotations" | "rootPosition">;

/** The pose at `time` between the two frames around it, written into `out`. */
export function sample(out: Pose, clip: Track, time: number): Pose {
  const joints = out.rotations.length / 4;
  const [first, second, share] = around(clip, time);
  // Its types know no typed arrays.
  const [to, from] = [out.rotations, clip.rotations] as unknown as [number[], number[]];
  for (let i = 0; i < 3; i++)
    out.root[i] = mixed(
      clip.rootPosition[3 * first + i]!,
      clip.rootPosition[3 * second + i]!,
      share,
    );
  for (let joint = 0; joint < joints; joint++)
    Quaternion.slerpFlat(
      ...[to, 4 * joint, from, 4 * (joints * first + joint)],
      ...[from, 4 * (joints * second + joint), share],
    );
  return out;
}

/** Curves at `time` between the two frames around it; null for a clip without curves. */
export function curvesAt(clip: Motion, time: number): Float32Array | null {
  const { curves, times } = clip;
  if (!curves) return null;
  const width = curves.length / times.length;
  const [first, second, share] = around(clip, time);
  return Float32Array.from({ length: width }, (_, i) =>
    mixed(curves[width * first + i]!, curves[width * second + i]!, share),
  );
}

/** The frames around a time, and the share of the way from the first to the second. */
function around(clip: Pick<Track, "rate" | "times">, time: number): [number, number, number] {
  const last = clip.times.length - 1;
  const at = Math.min(last, Math.max(0, (time - clip.times[0]!) / step(clip)));
  const first = Math.min(Math.floor(at), Math.max(0, last - 1));
  return [first, Math.min(last, first + 1), at - first];
}

/** Seconds from a frame to the next. */
export function step(clip: Pick<Track, "rate" | "times">): number {
  const { times } = clip;
  return times.length > 1 ? (times.at(-1)! - times[0]!) / (times.length - 1) : 1 / clip.rate;
}

/** Displacement by a lap of a cycle: a turn about +Y, then a translation. */
export interface Carried {
  readonly turn: number;
  readonly x: number;
  readonly z: number;
}

export const NOWHERE: Carried = { turn: 0, x: 0, z: 0 };

/** Displacement from the first frame of a cycle to its last. */
export function carried(clip: Motion, joints: number): Carried {
  const last = clip.times.length - 1;
  const turn = heading(clip.rotations, 4 * joints * last) - heading(clip.rotations, 0);
  const [x0, z0] = turned(clip.rootPosition[0]!, clip.rootPosition[2]!, turn);
  return {
    turn,
    x: clip.rootPosition[3 * last]! - x0,
    z: clip.rootPosition[3 * last + 2]! - z0,
  };
}

/** Two displacements after each other. */
export function after(first: Carried, then: Carried): Carried {
  const [x, z] = turned(then.x, then.z, first.turn);
  return { turn: first.turn + then.turn, x: first.x + x, z: first.z + z };
}

/** Turn a point of the ground about the origin, positive from +Z to +X. */
export function turned(x: number, z: number, turn: number): readonly [number, number] {
  const [c, s] = [Math.cos(turn), Math.sin(turn)];
  return [c * x + s * z, c * z - s * x];
}

/** Angle of a rotation about +Y. */
function heading(q: Float32Array, at: number): number {
  return 2 * Math.atan2(q[at + 2]!, q[at]!);
}

function mixed(a: number, b: number, share: number): number {
  return a + share * (b - a);
}
