/** A body with a skin: made from the model's skeleton, and as long in each bone as the answer says. */

import type { ModelCard } from "@posefield/client";
import {
  BufferAttribute,
  BufferGeometry,
  Bone as Joint,
  type Material,
  Matrix4,
  Object3D,
  Skeleton,
  SkinnedMesh,
} from "three";

import * as build from "./build.ts";
import { type Skin, shaped, skin } from "./limbs.ts";
import type { Shown } from "./player.ts";

/** Lengths that differ by less are the same, m. */
const SAME = 0.0005;

export class Mannequin extends Object3D {
  readonly #card: ModelCard;
  readonly #bones: readonly build.Bone[];
  readonly #skin: Skin;
  readonly #side: readonly number[];
  readonly #joints: readonly Joint[];
  readonly #skeleton: Skeleton;
  readonly #geometry = new BufferGeometry();
  #offsets = new Float32Array();

  /** materials: the skin is drawn once with each, in this order. */
  constructor(card: ModelCard, materials: readonly Material[]) {
    super();
    const { names, parents } = card.skeleton;
    this.#card = card;
    this.#bones = build.bones(card);
    this.#skin = skin(this.#bones, parents);
    this.#side = sideways(card);
    this.#joints = names.map(() => new Joint());
    parents.forEach((parent, at) => {
      (parent < 0 ? this : this.#joints[parent]!).add(this.#joints[at]!);
    });
    this.#skeleton = new Skeleton(
      [...this.#joints],
      names.map(() => new Matrix4()),
    );
    this.#wrap();
    materials.forEach((material, order) => void this.add(this.#clothed(material, order)));
  }

  show({ rotations, root, offsets }: Shown): void {
    if (differ(offsets, this.#offsets)) this.#measure(offsets);
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

  #wrap(): void {
    const { bone, index, joints, weights } = this.#skin;
    const count = bone.length;
    this.#geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * count), 3));
    this.#geometry.setAttribute("skinIndex", new BufferAttribute(joints, 4));
    this.#geometry.setAttribute("skinWeight", new BufferAttribute(weights, 4));
    this.#geometry.setIndex([...index]);
    this.#measure(Float32Array.from(this.#card.skeleton.offsets.flat()));
  }

  /** The skin again, for bones of these lengths. */
  #measure(offsets: Float32Array): void {
    this.#offsets = offsets.slice();
    const rest = standing(this.#card, offsets);
    rest.forEach(([x, y, z], at) => {
      this.#skeleton.boneInverses[at]!.makeTranslation(-x, -y, -z);
    });
    const position = this.#geometry.getAttribute("position") as BufferAttribute;
    const { starts, ends } = this.#spans(rest);
    shaped(position.array as Float32Array, this.#skin, starts, ends, this.#side);
    position.needsUpdate = true;
    this.#geometry.computeVertexNormals();
  }

  #spans(rest: readonly Place[]): { starts: Float32Array; ends: Float32Array } {
    const { tip_offsets } = this.#card.skeleton;
    const starts = this.#bones.flatMap(({ by }) => [...rest[by]!]);
    const ends = this.#bones.flatMap(({ by, to, tip }) =>
      to >= 0 ? [...rest[to]!] : rest[by]!.map((x, i) => x + tip_offsets[tip]![i]!),
    );
    return { starts: Float32Array.from(starts), ends: Float32Array.from(ends) };
  }
}

type Place = readonly [number, number, number];

/** Where joints are when none is turned and the root is at the origin, m. */
function standing(card: ModelCard, offsets: Float32Array): readonly Place[] {
  const found: Place[] = [];
  card.skeleton.parents.forEach((parent, at) => {
    const [x, y, z] = parent < 0 ? [0, 0, 0] : found[parent]!;
    const [dx, dy, dz] = parent < 0 ? [0, 0, 0] : offsets.subarray(3 * at, 3 * at + 3);
    found.push([x + dx!, y + dy!, z + dz!]);
  });
  return found;
}

/** From right to left through the hips or shoulders; +X where nobody says what they are. */
function sideways(card: ModelCard): readonly number[] {
  const { names } = card.skeleton;
  const rest = standing(card, Float32Array.from(card.skeleton.offsets.flat()));
  for (const part of ["UpperLeg", "UpperArm"]) {
    const left = rest[names.indexOf(card.roles[`left${part}`] ?? "")];
    const right = rest[names.indexOf(card.roles[`right${part}`] ?? "")];
    if (!left || !right) continue;
    const way = left.map((x, i) => x - right[i]!);
    const size = Math.hypot(...way);
    if (size > 0.01) return way.map((x) => x / size);
  }
  return [1, 0, 0];
}

function differ(a: Float32Array, b: Float32Array): boolean {
  return a.length !== b.length || a.some((x, i) => Math.abs(x - b[i]!) > SAME);
}

function materialsThrow({ transparent, colorWrite }: Material): boolean {
  return !transparent && colorWrite;
}
