/** A body of sticks and balls: exactly the joints, and nothing that hides them. */

import type { ModelCard } from "@posefield/client";
import {
  CylinderGeometry,
  InstancedMesh,
  type Material,
  Matrix4,
  Object3D,
  Quaternion,
  SphereGeometry,
  Vector3,
} from "three";

import { type Bone, bones } from "./bones.ts";
import type { Shown } from "./player.ts";
import { type Placed, place, placed } from "./skeleton.ts";

const UP = new Vector3(0, 1, 0);
const BALL = 0.017;
const STICK = 0.0095;
/** Thickest stick, as a share of its length. */
const SLENDER = 0.15;

export class Stick extends Object3D {
  readonly #card: ModelCard;
  readonly #placed: Placed;
  readonly #bones: readonly Bone[];
  readonly #sticks: InstancedMesh;
  readonly #balls: InstancedMesh;

  constructor(card: ModelCard, bone: Material, joint: Material) {
    super();
    this.#card = card;
    this.#bones = bones(card);
    this.#placed = placed(card.skeleton.names.length);
    const cone = new CylinderGeometry(0.55, 1, 1, 8).translate(0, 0.5, 0);
    this.#sticks = new InstancedMesh(cone, bone, this.#bones.length);
    this.#balls = new InstancedMesh(new SphereGeometry(1, 12, 8), joint, this.#bones.length + 1);
    for (const mesh of [this.#sticks, this.#balls]) {
      mesh.frustumCulled = false;
      mesh.castShadow = !bone.transparent;
      this.add(mesh);
    }
  }

  show({ rotations, root, offsets }: Shown): void {
    place(this.#placed, this.#card.skeleton.parents, offsets, rotations, root, 0);
    const { positions } = this.#placed;
    this.#ball(0, at.fromArray(positions), 0);
    this.#bones.forEach((bone, i) => {
      at.fromArray(positions, 3 * bone.by);
      this.#end(bone, to);
      this.#stick(i, bone);
      this.#ball(i + 1, to, bone.to);
    });
    this.#sticks.instanceMatrix.needsUpdate = this.#balls.instanceMatrix.needsUpdate = true;
  }

  override dispose(): void {
    for (const mesh of [this.#sticks, this.#balls]) {
      mesh.geometry.dispose();
      mesh.dispose();
    }
  }

  #end(bone: Bone, out: Vector3): void {
    const { positions, rotations } = this.#placed;
    if (bone.to >= 0) {
      out.fromArray(positions, 3 * bone.to);
      return;
    }
    const [w, x, y, z] = rotations.subarray(4 * bone.by, 4 * bone.by + 4);
    out.fromArray(this.#card.skeleton.tip_offsets[bone.tip]!);
    out.applyQuaternion(turn.set(x!, y!, z!, w!)).add(at);
  }

  #stick(i: number, bone: Bone): void {
    way.subVectors(to, at);
    const long = way.length();
    turn.setFromUnitVectors(UP, way.divideScalar(long || 1));
    const thick = Math.min(STICK, SLENDER * bone.long);
    this.#sticks.setMatrixAt(i, matrix.compose(at, turn, size.set(thick, long, thick)));
  }

  #ball(i: number, centre: Vector3, joint: number): void {
    const radius = joint < 0 ? 0.5 * STICK : Math.min(BALL, 2 * SLENDER * this.#length(i));
    this.#balls.setMatrixAt(i, matrix.makeScale(radius, radius, radius).setPosition(centre));
  }

  #length(i: number): number {
    return i ? this.#bones[i - 1]!.long : 1;
  }
}

const [at, to, way, size] = [new Vector3(), new Vector3(), new Vector3(), new Vector3()];
const turn = new Quaternion();
const matrix = new Matrix4();
