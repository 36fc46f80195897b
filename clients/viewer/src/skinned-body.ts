/** A body with the skin of the files, as long in each bone as the answer says. */

import type { ModelCard } from "@posefield/client";
import {
  type BufferAttribute,
  type BufferGeometry,
  Bone as Joint,
  type Material,
  Matrix4,
  Object3D,
  Skeleton,
  SkinnedMesh,
} from "three";
import type { Character } from "./character.ts";
import * as characters from "./character.ts";
import type { Shown } from "./player.ts";

/** Lengths that differ by less are the same, m. */
const SAME = 0.0005;

export class SkinnedBody extends Object3D {
  readonly #card: ModelCard;
  readonly #character: Character;
  readonly #rest: Float32Array;
  readonly #joints: readonly Joint[];
  readonly #skeleton: Skeleton;
  readonly #geometry: BufferGeometry;
  #offsets: Float32Array;

  /** materials: the skin is drawn once with each, in this order. */
  constructor(card: ModelCard, character: Character, materials: readonly Material[]) {
    super();
    const { names, offsets, parents } = card.skeleton;
    this.#card = card;
    this.#character = character;
    this.#offsets = Float32Array.from(offsets.flat());
    this.#rest = characters.standing(card, this.#offsets);
    this.#joints = names.map(() => new Joint());
    parents.forEach((parent, at) => {
      (parent < 0 ? this : this.#joints[parent]!).add(this.#joints[at]!);
    });
    this.#skeleton = new Skeleton(
      [...this.#joints],
      names.map(() => new Matrix4()),
    );
    this.#geometry = characters.geometry(character, character.fine);
    this.#bind(this.#rest);
    materials.forEach((material, order) => void this.add(this.#clothed(material, order)));
  }

  show({ rotations, root, offsets }: Pick<Shown, "rotations" | "root" | "offsets">): void {
    if (differ(offsets, this.#offsets)) this.#fit(offsets);
    this.#joints.forEach((joint, at) => {
      const [w, x, y, z] = rotations.subarray(4 * at, 4 * at + 4);
      joint.quaternion.set(x!, y!, z!, w!);
      const parent = this.#card.skeleton.parents[at]!;
      if (parent < 0) joint.position.fromArray(root);
      else joint.position.fromArray(offsets, 3 * at);
    });
  }

  override dispose(): void {
    this.#geometry.dispose();
    this.#skeleton.dispose();
  }

  #clothed(material: Material, order: number): SkinnedMesh {
    const mesh = new SkinnedMesh(this.#geometry, material);
    mesh.bind(this.#skeleton, new Matrix4());
    mesh.frustumCulled = false;
    mesh.renderOrder = order;
    mesh.castShadow = materialsThrow(material);
    return mesh;
  }

  /** The skin for bones of these lengths. */
  #fit(offsets: Float32Array): void {
    this.#offsets = offsets.slice();
    const now = characters.standing(this.#card, offsets);
    const position = this.#geometry.getAttribute("position") as BufferAttribute;
    characters.fitted(position.array as Float32Array, this.#character, this.#rest, now);
    position.needsUpdate = true;
    this.#bind(now);
  }

  #bind(rest: Float32Array): void {
    this.#skeleton.boneInverses.forEach((inverse, at) => {
      inverse.makeTranslation(-rest[3 * at]!, -rest[3 * at + 1]!, -rest[3 * at + 2]!);
    });
  }
}

/** The root's own offset moves no bone. */
function differ(a: Float32Array, b: Float32Array): boolean {
  return a.some((x, i) => i > 2 && Math.abs(x - b[i]!) > SAME);
}

function materialsThrow({ transparent, colorWrite }: Material): boolean {
  return !transparent && colorWrite;
}
