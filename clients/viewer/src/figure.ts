/** A body on the stage, as sticks or as a mannequin, solid or as a ghost. */

import type { ModelCard } from "@posefield/client";
import { applyPose } from "@posefield/client/three";
import {
  type BufferAttribute,
  type BufferGeometry,
  CylinderGeometry,
  Group,
  IcosahedronGeometry,
  InstancedMesh,
  type Material,
  Matrix4,
  MeshLambertMaterial,
  Object3D,
  Quaternion,
  Skeleton,
  SkinnedMesh,
  Vector3,
} from "three";

import type { Character } from "./character.ts";
import * as characters from "./character.ts";
import type { Shown } from "./player.ts";
import { Joints } from "./skeleton.ts";
import type { State } from "./state.ts";
import * as theme from "./theme.ts";

type BodyPose = Pick<Shown, "rotations" | "root" | "offsets">;

/** Custom properties with the colours of skin, sticks and joints. */
const SOLID = { skin: "--body", stick: "--ink", joint: "--accent" } as const;
const GHOST = { skin: "--ghost", stick: "--ghost", joint: "--ghost" } as const;
/** Draws ghosts behind a body that they coincide with. */
const BEHIND = { polygonOffset: true, polygonOffsetFactor: 6, polygonOffsetUnits: 6 };

export class Figure {
  readonly group = new Group();
  readonly #card: ModelCard;
  readonly #character: Character;
  readonly #materials: Readonly<Record<keyof typeof SOLID, MeshLambertMaterial>>;
  readonly #colours: typeof SOLID | typeof GHOST;
  readonly #before: readonly Material[];
  #body: Stick | SkinnedBody | null = null;
  #kind: State["body"] | null = null;
  #shown: Shown | null = null;

  /** opacity: of a ghost. */
  constructor(card: ModelCard, character: Character, ghost: boolean, opacity = 0.32) {
    this.#card = card;
    this.#character = character;
    this.#colours = ghost ? GHOST : SOLID;
    const material = () =>
      new MeshLambertMaterial(ghost ? { transparent: true, opacity, ...BEHIND } : {});
    this.#materials = { skin: material(), stick: material(), joint: material() };
    // Fills the depth alone, so that a ghost shows its outside once and not its inside.
    this.#before = ghost ? [new MeshLambertMaterial({ colorWrite: false, ...BEHIND })] : [];
    this.tint();
  }

  wear(kind: State["body"]): void {
    if (kind === this.#kind) return;
    this.#kind = kind;
    this.#removeBody();
    const { skin, stick, joint } = this.#materials;
    this.#body =
      kind === "stick"
        ? new Stick(this.#card, stick, joint)
        : new SkinnedBody(this.#card, this.#character, [...this.#before, skin]);
    this.group.add(this.#body);
    if (this.#shown) this.show(this.#shown);
  }

  show(shown: Shown): void {
    this.#shown = shown;
    this.#body?.show(shown);
    this.group.position.set(shown.carried.x, 0, shown.carried.z);
    this.group.rotation.y = shown.carried.turn;
  }

  tint(): void {
    for (const part of ["skin", "stick", "joint"] as const)
      this.#materials[part].color.set(theme.colour(this.#colours[part]));
  }

  dispose(): void {
    this.#removeBody();
    this.group.removeFromParent();
    for (const material of [...Object.values(this.#materials), ...this.#before]) material.dispose();
  }

  #removeBody(): void {
    if (!this.#body) return;
    this.group.remove(this.#body);
    this.#body.dispose();
    this.#body = null;
  }
}

/** Lengths of bones that differ by less are the same, m. */
const SAME = 0.0005;

/** The skin of the model's files, fitted to the bones of each answer. */
export class SkinnedBody extends Object3D {
  readonly skeleton: Skeleton;
  readonly #card: ModelCard;
  readonly #character: Character;
  readonly #rest: Float32Array;
  readonly #geometry: BufferGeometry;
  #offsets: Float32Array;

  /** materials: the skin is drawn once with each, in this order. */
  constructor(card: ModelCard, character: Character, materials: readonly Material[]) {
    super();
    const { offsets, parents } = card.skeleton;
    this.#card = card;
    this.#character = character;
    this.#offsets = Float32Array.from(offsets.flat());
    this.#rest = characters.standing(card, this.#offsets);
    const { bones } = new Joints(parents);
    this.add(bones[0]!);
    this.skeleton = new Skeleton(
      [...bones],
      bones.map(() => new Matrix4()),
    );
    this.#geometry = characters.geometry(character, character.fine);
    this.#bind(this.#rest);
    materials.forEach((material, order) => {
      const mesh = new SkinnedMesh(this.#geometry, material);
      mesh.bind(this.skeleton, new Matrix4());
      mesh.frustumCulled = false;
      mesh.renderOrder = order;
      mesh.castShadow = !material.transparent && material.colorWrite;
      this.add(mesh);
    });
  }

  show({ rotations, root, offsets }: BodyPose): void {
    // The root's own offset moves no bone.
    if (offsets.some((x, i) => i > 2 && Math.abs(x - this.#offsets[i]!) > SAME)) this.#fit(offsets);
    applyPose(this.skeleton.bones, { rotations, rootPosition: root, boneOffsets: offsets }, 0);
  }

  override dispose(): void {
    this.#geometry.dispose();
    this.skeleton.dispose();
  }

  #fit(offsets: Float32Array): void {
    this.#offsets = offsets.slice();
    const now = characters.standing(this.#card, offsets);
    const position = this.#geometry.getAttribute("position") as BufferAttribute;
    characters.fitted(position.array as Float32Array, this.#character, this.#rest, now);
    position.needsUpdate = true;
    this.#bind(now);
  }

  #bind(rest: Float32Array): void {
    this.skeleton.boneInverses.forEach((inverse, at) => {
      inverse.makeTranslation(-rest[3 * at]!, -rest[3 * at + 1]!, -rest[3 * at + 2]!);
    });
  }
}

const UP = new Vector3(0, 1, 0);
/** Radii of joints and bones, and of the thickest bone as a share of its length; shortest bone, m. */
const [BALL, STICK, SLENDER, SHORTEST] = [0.017, 0.0095, 0.15, 0.008];

/** A bone from a joint to another, or to a tip (m) that is no joint. */
interface Stretch {
  readonly from: number;
  readonly to: number | null;
  readonly tip: readonly number[];
  readonly length: number;
}

/** Sticks and balls of one body or of several: exactly the joints, and nothing that hides them. */
export class Stick extends Object3D {
  readonly #joints: Joints;
  readonly #bones: readonly Stretch[];
  readonly #sticks: InstancedMesh;
  readonly #balls: InstancedMesh;

  constructor({ skeleton }: ModelCard, bone: Material, joint: Material, count = 1) {
    super();
    this.#bones = stretches(skeleton);
    this.#joints = new Joints(skeleton.parents);
    const one = count === 1;
    const cone = new CylinderGeometry(0.55, 1, 1, one ? 8 : 5, 1, !one).translate(0, 0.5, 0);
    const ball = new IcosahedronGeometry(1, one ? 3 : 0);
    this.#sticks = new InstancedMesh(cone, bone, count * this.#bones.length);
    this.#balls = new InstancedMesh(ball, joint, count * (this.#bones.length + 1));
    for (const mesh of [this.#sticks, this.#balls]) {
      mesh.frustumCulled = false;
      mesh.castShadow = one && !bone.transparent;
      this.add(mesh);
    }
  }

  /** body: number of the body that takes the pose. */
  show({ rotations, root, offsets }: BodyPose, body = 0): void {
    const joints = this.#joints;
    joints.place({ rotations, rootPosition: root, boneOffsets: offsets });
    const [stick, ball] = [body * this.#bones.length, body * (this.#bones.length + 1)];
    this.#setBall(ball, joints.position(0, start), BALL);
    this.#bones.forEach(({ from, to, tip, length }, i) => {
      joints.position(from, start);
      if (to === null) end.fromArray(tip).applyMatrix4(joints.bones[from]!.matrixWorld);
      else joints.position(to, end);
      const long = along.subVectors(end, start).length();
      turn.setFromUnitVectors(UP, along.divideScalar(long || 1));
      const thick = Math.min(STICK, SLENDER * length);
      this.#sticks.setMatrixAt(
        stick + i,
        matrix.compose(start, turn, size.set(thick, long, thick)),
      );
      const radius = to === null ? 0.5 * STICK : Math.min(BALL, 2 * SLENDER * length);
      this.#setBall(ball + i + 1, end, radius);
    });
    this.#sticks.instanceMatrix.needsUpdate = this.#balls.instanceMatrix.needsUpdate = true;
  }

  override dispose(): void {
    for (const mesh of [this.#sticks, this.#balls]) {
      mesh.geometry.dispose();
      mesh.dispose();
    }
  }

  #setBall(i: number, centre: Vector3, radius: number): void {
    this.#balls.setMatrixAt(i, matrix.makeScale(radius, radius, radius).setPosition(centre));
  }
}

function stretches({
  offsets,
  parents,
  tip_joints,
  tip_offsets,
}: ModelCard["skeleton"]): Stretch[] {
  const inner = parents.map((from, to) => ({ from, to, tip: offsets[to]! }));
  const outer = tip_joints.map((from, i) => ({ from, to: null, tip: tip_offsets[i]! }));
  return [...inner, ...outer]
    .map((bone) => ({ ...bone, length: Math.hypot(...bone.tip) }))
    .filter(({ from, length }) => from >= 0 && length > SHORTEST);
}

const [start, end, along, size] = [new Vector3(), new Vector3(), new Vector3(), new Vector3()];
const turn = new Quaternion();
const matrix = new Matrix4();
