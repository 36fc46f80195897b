/** Joints in space, as bones without a skin. */

import { applyPose } from "@posefield/client/three";
import { Bone, Vector3 } from "three";

export class Joints {
  readonly bones: readonly Bone[];

  constructor(parents: readonly number[]) {
    this.bones = parents.map(() => new Bone());
    for (const [joint, parent] of parents.entries()) this.bones[parent]?.add(this.bones[joint]!);
  }

  /** Put the joints in one of several poses. */
  place(poses: Parameters<typeof applyPose>[1], frame = 0): void {
    applyPose(this.bones, poses, frame);
    this.bones[0]!.updateMatrixWorld(true);
  }

  /** Position of a joint, m, written into `out`. */
  position(joint: number, out = new Vector3()): Vector3 {
    return out.setFromMatrixPosition(this.bones[joint]!.matrixWorld);
  }
}
