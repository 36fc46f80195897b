/** Legs with known knees, found in a skeleton, and the positions of their joints in poses. */

import type { ModelCard } from "./card.ts";
import { HingeLimits } from "./two-bone.ts";
import { add, multiply, norm, type Quaternion, rotate, subtract, type Vector } from "./vectors.ts";

/** Joints by index: hip, knee, ankle, and the ball, which is placed. */
export interface Limb {
  /** Place of the ball in the card's contacts. */
  readonly contact: number;
  readonly upper: number;
  readonly middle: number;
  readonly lower: number;
  readonly tip: number;
  /** Limits of the middle joint. */
  readonly hinge: HingeLimits;
  /** From the tip to the end of the toes, m; null where that is unknown. */
  readonly toe: Vector | null;
}

/** Local rotations and roots of F poses with one set of bones; numbers one after another. */
export interface LocalPoses {
  readonly frames: number;
  readonly rotations: ArrayLike<number>;
  readonly roots: ArrayLike<number>;
  readonly bones: ArrayLike<number>;
}

/** Positions, m, and orientations of some joints and those above them in F poses. */
export class LimbPoses {
  readonly frames: number;
  readonly #parents: readonly number[];
  readonly #bones: ArrayLike<number>;
  readonly #slots: ReadonlyMap<number, number>;
  readonly #positions: Float64Array;
  readonly #orientations: Float64Array;

  constructor(parents: readonly number[], tips: readonly number[], poses: LocalPoses) {
    const needed = [...new Set([0, ...tips.flatMap((tip) => chain(parents, tip))])].sort(
      (a, b) => a - b,
    );
    const joints = parents.length;
    this.frames = poses.frames;
    this.#parents = parents;
    this.#bones = poses.bones;
    this.#slots = new Map(needed.map((joint, slot) => [joint, slot]));
    this.#positions = new Float64Array(3 * needed.length * poses.frames);
    this.#orientations = new Float64Array(4 * needed.length * poses.frames);
    for (let frame = 0; frame < poses.frames; frame++) {
      for (const joint of needed) {
        const local = quaternionAt(poses.rotations, frame * joints + joint);
        const parent = parents[joint]!;
        if (parent < 0) this.#set(joint, frame, vectorAt(poses.roots, frame), local);
        else {
          const above = this.orientation(parent, frame);
          const offset = rotate(above, vectorAt(poses.bones, joint));
          const position = add(offset, this.position(parent, frame));
          this.#set(joint, frame, position, multiply(above, local));
        }
      }
    }
  }

  position(joint: number, frame: number): Vector {
    return vectorAt(this.#positions, this.#index(joint, frame));
  }

  orientation(joint: number, frame: number): Quaternion {
    return quaternionAt(this.#orientations, this.#index(joint, frame));
  }

  parentOrientation(joint: number, frame: number): Quaternion {
    return this.orientation(this.#parents[joint]!, frame);
  }

  /** From one joint to another in a frame, m. */
  between(from: number, to: number, frame: number): Vector {
    return subtract(this.position(to, frame), this.position(from, frame));
  }

  /** Length of the bone that ends at a joint, m. */
  length(joint: number): number {
    return norm(vectorAt(this.#bones, joint));
  }

  #index(joint: number, frame: number): number {
    return this.#slots.get(joint)! * this.frames + frame;
  }

  #set(joint: number, frame: number, position: Vector, orientation: Quaternion): void {
    const index = this.#index(joint, frame);
    this.#positions.set(position, 3 * index);
    this.#orientations.set(orientation, 4 * index);
  }
}

export function vectorAt(numbers: ArrayLike<number>, index: number): Vector {
  const at = 3 * index;
  return [numbers[at]!, numbers[at + 1]!, numbers[at + 2]!];
}

export function quaternionAt(numbers: ArrayLike<number>, index: number): Quaternion {
  const at = 4 * index;
  return [numbers[at]!, numbers[at + 1]!, numbers[at + 2]!, numbers[at + 3]!];
}

/**
 * Legs of the feet whose contacts and knees the model knows; one that moves another leg is none.
 */
export function findLegs(card: ModelCard): Limb[] {
  const legs: Limb[] = [];
  const used = new Set<number>();
  for (const [contact, { joint }] of card.contacts.entries()) {
    if (!card.feet.includes(joint)) continue;
    const leg = findLimb(card, contact);
    const joints = leg ? [leg.upper, leg.middle, leg.lower] : [];
    if (leg && !joints.some((one) => used.has(one))) legs.push(leg);
    for (const one of joints) used.add(one);
  }
  return legs;
}

/** The limb that ends at the joint of a contact; null without a known knee above it. */
function findLimb({ contacts, hinges, skeleton }: ModelCard, contact: number): Limb | null {
  const tip = contacts[contact]!.joint;
  const joints = chain(skeleton.parents, tip).toReversed();
  // The ankle is the tip's parent, or the tip itself. The joint above the hip exists in both.
  for (const first of [1, 0]) {
    const [lower, middle, upper] = joints.slice(first) as [number, number, number];
    const known = hinges.find(({ joint }) => joint === middle);
    if (!known || joints.length <= first + 3) continue;
    const end = skeleton.tip_joints.lastIndexOf(tip);
    const toe = first === 1 && end >= 0 ? vectorAt(skeleton.tip_offsets[end]!, 0) : null;
    return { contact, upper, middle, lower, tip, hinge: new HingeLimits(known), toe };
  }
  return null;
}

/** Joints from the root to a joint. */
function chain(parents: readonly number[], joint: number): number[] {
  const parent = parents[joint]!;
  return parent < 0 ? [joint] : [...chain(parents, parent), joint];
}
