/** The course of a clip: at which times its frames are, and where its root goes meanwhile. */

import type { ClipQuestion } from "@posefield/client";

import { Refused, within } from "./door.ts";
import { arc, type Place, turned, turnRoot } from "./plane.ts";

const MOST_POSES = 10_000;

/** One cycle, or the way from the first pose to the last: service/posefield/locomotion/stride.py. */
export interface Way {
  readonly way: Place;
  readonly turn: number;
  readonly start: Place;
}

export interface Course {
  readonly times: Float64Array;
  readonly rotations: Float32Array;
  readonly rootPosition: Float32Array;
}

/** Times of the frames, s; those of a loop lack the last frame, which is the first again. */
export function times(asked: ClipQuestion, duration: number): Float64Array {
  const rate = within("fps", asked.fps ?? 30, 1, 1000);
  const last = within("end", asked.end ?? duration, 0, duration);
  const start = within("start", asked.start ?? 0, 0, last);
  if (asked.loop) {
    if (start > 0 || (asked.end ?? null) !== null)
      throw new Refused("loop: expected without start and end");
    const steps = counted(Math.max(1, Math.round(duration * rate)));
    return Float64Array.from({ length: steps }, (_, i) => (i * duration) / steps);
  }
  // A millionth of a frame forgives the rounding of duration times rate.
  const frames = counted(Math.floor((last - start) * rate + 1e-6) + 1);
  return Float64Array.from({ length: frames }, (_, i) => Math.min(start + i / rate, duration));
}

function counted(frames: number): number {
  if (frames > MOST_POSES)
    throw new Refused(`fps: ${frames} frames, expected at most ${MOST_POSES}`);
  return frames;
}

/** The poses in the frame that goes along the way, which stays where the clip begins. */
export function inPlace(poses: Course, way: Way, duration: number): Course {
  const [rotations, roots] = [poses.rotations.slice(), poses.rootPosition.slice()];
  const joints = rotations.length / 4 / poses.times.length;
  poses.times.forEach((time, frame) => {
    const phase = time / duration;
    const angle = phase * way.turn;
    const gone = arc({ x: phase * way.way.x, z: phase * way.way.z }, angle);
    const left = turned(
      {
        x: roots[3 * frame]! - way.start.x - gone.x,
        z: roots[3 * frame + 2]! - way.start.z - gone.z,
      },
      -angle,
    );
    roots[3 * frame] = way.start.x + left.x;
    roots[3 * frame + 2] = way.start.z + left.z;
    turnRoot(rotations, 4 * joints * frame, -angle);
  });
  return { times: poses.times, rotations, rootPosition: roots };
}

/** The poses and the first of them again, carried along the way if there is one. */
export function closed(poses: Course, way: Way | null, duration: number): Course {
  const width = poses.rotations.length / poses.times.length;
  const rotations = new Float32Array([...poses.rotations, ...poses.rotations.subarray(0, width)]);
  const rootPosition = new Float32Array([
    ...poses.rootPosition,
    ...poses.rootPosition.subarray(0, 3),
  ]);
  if (way) {
    const gone = arc(way.way, way.turn);
    turnRoot(rotations, poses.rotations.length, way.turn);
    rootPosition[poses.rootPosition.length]! += gone.x;
    rootPosition[poses.rootPosition.length + 2]! += gone.z;
  }
  return { times: new Float64Array([...poses.times, duration]), rotations, rootPosition };
}
