/** Largest differences between answers of the run time and those of the service. */

import { type LoadOptions, load, type Options } from "../src/index.ts";

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

export interface ModelAnswers {
  readonly file: string;
  readonly poses: readonly PoseAnswer[];
}

export interface Differences {
  readonly pose: number;
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
  return { pose };
}

function largest(numbers: ArrayLike<number>, expected: ArrayLike<number>): number {
  if (numbers.length !== expected.length) return Number.POSITIVE_INFINITY;
  let most = 0;
  for (let index = 0; index < numbers.length; index++)
    most = Math.max(most, Math.abs(numbers[index]! - expected[index]!));
  return most;
}
