/** Bones of a skeleton that are long enough to be seen. */

import type { ModelCard } from "@posefield/client";

/** From the joint that turns it (by) to where it ends; tips end on no joint. */
export interface Bone {
  readonly by: number;
  /** -1 for a tip. */
  readonly to: number;
  /** Which tip, where it is one. */
  readonly tip: number;
  /** m. */
  readonly long: number;
}

const SHORTEST = 0.008;

export function bones({ skeleton }: ModelCard): readonly Bone[] {
  const { offsets, parents, tip_joints, tip_offsets } = skeleton;
  const inner = parents.map((by, to) => ({ by, to, tip: -1, long: Math.hypot(...offsets[to]!) }));
  const outer = tip_joints.map((by, tip) => {
    return { by, to: -1, tip, long: Math.hypot(...tip_offsets[tip]!) };
  });
  return [...inner, ...outer].filter(({ by, long }) => by >= 0 && long > SHORTEST);
}
