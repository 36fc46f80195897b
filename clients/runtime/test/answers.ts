/** Largest differences between answers of the run time and those of the service. */

import { type Clip, type ClipOptions, type LoadOptions, load, type Options } from "../src/index.ts";
import { LimbPoses } from "../src/limbs.ts";

export interface PoseAnswer {
  readonly controls: Record<string, number>;
  readonly options: Options;
  readonly times: readonly number[];
  readonly duration: number;
  readonly sigma: number;
  readonly rotations: readonly number[];
  readonly rootPosition: readonly number[];
  readonly boneOffsets: readonly number[];
}

export interface ClipAnswer {
  readonly controls: Record<string, number>;
  readonly options: ClipOptions;
  readonly duration: number;
  /** Of all joints in all frames, m. */
  readonly positions: readonly number[];
}

export interface ModelAnswers {
  readonly file: string;
  /** CPU time of the service for a pose, and for a clip of 100 frames at `fps`. */
  readonly seconds: { readonly pose: number; readonly clip: number; readonly fps: number };
  readonly poses: readonly PoseAnswer[];
  readonly clips: readonly ClipAnswer[];
}

export interface Differences {
  readonly pose: number;
  /** Of joints in the world, m. */
  readonly clip: number;
}

export async function differences(
  content: Uint8Array,
  answers: ModelAnswers,
  options?: LoadOptions,
): Promise<Differences> {
  const model = await load(content, options);
  let pose = 0;
  for (const answer of answers.poses) {
    const poses = await model.pose(answer.controls, answer.times, answer.options);
    const pairs = [
      [poses.rotations, answer.rotations],
      [poses.rootPosition, answer.rootPosition],
      [poses.boneOffsets, answer.boneOffsets],
      [
        [poses.duration, poses.sigma],
        [answer.duration, answer.sigma],
      ],
    ] as const;
    pose = Math.max(pose, ...pairs.map(([numbers, expected]) => largest(numbers, expected)));
  }
  let clip = 0;
  for (const answer of answers.clips) {
    const motion = await model.clip(answer.controls, answer.options);
    clip = Math.max(clip, largest(positions(motion), answer.positions));
    clip = Math.max(clip, Math.abs(motion.duration - answer.duration));
  }
  return { pose, clip };
}

/** Positions of all joints of a clip, m. */
function positions({ frames, rotations, rootPosition, boneOffsets, parents }: Clip): number[] {
  const joints = parents.map((_, joint) => joint);
  const local = { frames, rotations, roots: rootPosition, bones: boneOffsets };
  const poses = new LimbPoses(parents, joints, local);
  return Array.from({ length: frames }, (_, frame) =>
    joints.flatMap((joint) => [...poses.position(joint, frame)]),
  ).flat();
}

function largest(numbers: ArrayLike<number>, expected: ArrayLike<number>): number {
  if (numbers.length !== expected.length) return Number.POSITIVE_INFINITY;
  let most = 0;
  for (let index = 0; index < numbers.length; index++)
    most = Math.max(most, Math.abs(numbers[index]! - expected[index]!));
  return most;
}
