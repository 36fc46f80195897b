/** Clips and poses as three.js has them: bones, a skeleton, an AnimationClip. */

import {
  AnimationClip,
  Bone,
  type KeyframeTrack,
  PropertyBinding,
  QuaternionKeyframeTrack,
  Skeleton,
  VectorKeyframeTrack,
} from "three";

import type { ModelCard, Motion, Poses } from "./types.ts";

/** Bones in the order of the joints, under the first, which is to be added to a scene. */
export interface Rig {
  readonly root: Bone;
  readonly bones: readonly Bone[];
  readonly skeleton: Skeleton;
}

/** Joints of a clip, or of the poses of a crowd. */
type Jointed = Pick<Motion, "names" | "parents" | "boneOffsets">;
type Posed = Pick<Poses, "rotations" | "rootPosition" | "boneOffsets">;
type Timed = Partial<Pick<Motion, "trust">> & { readonly times: ArrayLike<number> };
type Played = Jointed & Posed & Pick<Motion, "frames" | "rate"> & Timed;

/** The skeleton of a model at rest, or with the bones that a clip has; every rotation is none. */
export function skeletonOf(found: ModelCard | Jointed): Rig {
  const { names, parents, boneOffsets } = "skeleton" in found ? atRest(found) : found;
  const bones = nodeNames(names).map((name) => Object.assign(new Bone(), { name }));
  for (const [joint, bone] of bones.entries()) {
    bone.position.fromArray(boneOffsets, 3 * joint);
    bone.userData = { joint: names[joint] };
    bones[parents[joint]!]?.add(bone);
  }
  const root = bones[0]!;
  // The skeleton takes the pose that its bones have now for the one that a mesh is bound in.
  root.updateMatrixWorld(true);
  return { root, bones, skeleton: new Skeleton(bones) };
}

/**
 * A clip for an AnimationMixer whose root is, or holds, the bones of `skeletonOf` or any whose
 * names agree. Bones take the clip's lengths. A clip asked for with `loop` repeats without a seam.
 */
export function animationClip(motion: Played, name = motion.trust?.model ?? "clip"): AnimationClip {
  const duration = (motion.frames - 1) / motion.rate;
  const tracks = nodeNames(motion.names).flatMap((node, joint) => tracksOf(motion, node, joint));
  return new AnimationClip(name, duration, tracks);
}

/** Puts bones in one of several poses, or in that of one character of a crowd. */
export function applyPose(bones: readonly Bone[], poses: Posed, frame: number): void {
  const joints = bones.length;
  // Each character of a crowd has bones of its own, one performer has the same in all poses.
  const own = poses.boneOffsets.length > 3 * joints ? 3 * joints * frame : 0;
  for (const [joint, bone] of bones.entries()) {
    const [w, x, y, z] = quaternion(poses, joints * frame + joint);
    bone.quaternion.set(x, y, z, w);
    bone.position.fromArray(poses.boneOffsets, own + 3 * joint);
  }
  bones[0]?.position.fromArray(poses.rootPosition, 3 * frame);
}

/** Names that three.js finds nodes by, which may hold none of `[ ] . : /` and no blanks. */
export function nodeNames(names: readonly string[]): string[] {
  const found = new Set<string>();
  for (const name of names)
    found.add(free(PropertyBinding.sanitizeNodeName(name) || "joint", found));
  return [...found];
}

function free(name: string, taken: ReadonlySet<string>): string {
  for (let number = 1; ; number++) {
    const tried = number === 1 ? name : `${name}_${number}`;
    if (!taken.has(tried)) return tried;
  }
}

function atRest({ skeleton }: ModelCard): Jointed {
  return { ...skeleton, boneOffsets: Float32Array.from(skeleton.offsets.flat()) };
}

function tracksOf(motion: Played, node: string, joint: number): KeyframeTrack[] {
  const local = turns(motion, joint);
  const turning = new QuaternionKeyframeTrack(`${node}.quaternion`, motion.times, local);
  return [turning, moving(motion, `${node}.position`, joint)];
}

/** The root moves; other joints have one place for all times. */
function moving(motion: Played, track: string, joint: number): VectorKeyframeTrack {
  if (joint === 0) return new VectorKeyframeTrack(track, motion.times, motion.rootPosition);
  return new VectorKeyframeTrack(track, [0], motion.boneOffsets.subarray(3 * joint, 3 * joint + 3));
}

/** Rotations of one joint over time, in the order x y z w. */
function turns(motion: Played, joint: number): Float32Array {
  const found = new Float32Array(4 * motion.frames);
  for (let frame = 0; frame < motion.frames; frame++) {
    const [w, x, y, z] = quaternion(motion, motion.names.length * frame + joint);
    found.set([x, y, z, w], 4 * frame);
  }
  return found;
}

function quaternion(
  { rotations }: Pick<Poses, "rotations">,
  index: number,
): [number, number, number, number] {
  const at = 4 * index;
  return [rotations[at]!, rotations[at + 1]!, rotations[at + 2]!, rotations[at + 3]!];
}
