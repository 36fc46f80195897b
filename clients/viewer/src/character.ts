/** The character that all files of a model have: its skin, read from binary glTF. */

import type { ModelCard } from "@posefield/client";
import { BufferAttribute, BufferGeometry } from "three";

/** V points in the rest pose, and which joints move them. */
export interface Character {
  /** V × 3, m. */
  readonly points: Float32Array;
  readonly normals: Float32Array;
  /** V × 4, the heaviest first; the weights of a point sum to 255. */
  readonly joints: Uint8Array | Uint16Array;
  readonly weights: Uint8Array;
  /** V × 2 joints, and V shares: a point moves with them where bones have other lengths. */
  readonly anchors: Uint16Array;
  readonly shares: Float32Array;
  /** Corners of triangles: all, and few for who is far away. */
  readonly fine: Uint8Array | Uint16Array | Uint32Array;
  readonly coarse: Uint8Array | Uint16Array | Uint32Array;
}

interface Primitive {
  readonly attributes: Readonly<Record<string, number>>;
  readonly indices: number;
}

interface Document {
  readonly accessors: readonly {
    readonly bufferView: number;
    readonly componentType: number;
    readonly count: number;
    readonly type: string;
  }[];
  readonly bufferViews: readonly { readonly byteOffset: number }[];
  readonly meshes: readonly { readonly primitives: readonly [Primitive] }[];
}

const WIDTHS: Readonly<Record<string, number>> = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };
const KINDS = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };

/** Read `character.glb` (service/posefield/encode/glb.py). */
export function read(content: Uint8Array<ArrayBuffer>): Character {
  const view = new DataView(content.buffer, content.byteOffset);
  const size = view.getUint32(12, true);
  const text = new TextDecoder().decode(content.subarray(20, 20 + size));
  const { accessors, bufferViews, meshes } = JSON.parse(text) as Document;
  const numbers = (accessor: number) => {
    const { bufferView, componentType, count, type } = accessors[accessor]!;
    const Kind = KINDS[componentType as keyof typeof KINDS];
    const start = content.byteOffset + 28 + size + bufferViews[bufferView]!.byteOffset;
    const length = count * WIDTHS[type]!;
    const bytes = content.buffer.slice(start, start + length * Kind.BYTES_PER_ELEMENT);
    return new Kind(bytes);
  };
  const [{ attributes, indices }, coarse] = meshes.map(({ primitives }) => primitives[0]) as [
    Primitive,
    Primitive,
  ];
  const character = {
    points: numbers(attributes["POSITION"]!),
    normals: numbers(attributes["NORMAL"]!),
    joints: numbers(attributes["JOINTS_0"]!),
    weights: numbers(attributes["WEIGHTS_0"]!),
    anchors: numbers(attributes["_ANCHORS"]!),
    shares: numbers(attributes["_SHARE"]!),
    fine: numbers(indices),
    coarse: numbers(coarse.indices),
  };
  return character as unknown as Character;
}

/** The skin with these corners; the code that draws it may write its positions. */
export function geometry(character: Character, corners: Character["fine"]): BufferGeometry {
  return new BufferGeometry()
    .setAttribute("position", new BufferAttribute(character.points.slice(), 3))
    .setAttribute("normal", new BufferAttribute(character.normals, 3))
    .setAttribute("skinIndex", new BufferAttribute(character.joints, 4))
    .setAttribute("skinWeight", new BufferAttribute(character.weights, 4, true))
    .setIndex(new BufferAttribute(corners, 1));
}

/** The points (V × 3, m) for bones of other lengths, joints from `rest` to `now` (J × 3, m). */
export function fitted(
  out: Float32Array,
  { points, anchors, shares }: Character,
  rest: Float32Array,
  now: Float32Array,
): void {
  for (let point = 0; point < shares.length; point++) {
    const [start, end] = [3 * anchors[2 * point]!, 3 * anchors[2 * point + 1]!];
    const share = shares[point]!;
    for (let i = 0; i < 3; i++) {
      const first = now[start + i]! - rest[start + i]!;
      const second = now[end + i]! - rest[end + i]!;
      out[3 * point + i] = points[3 * point + i]! + first + share * (second - first);
    }
  }
}

/** Return the joints at rest (J × 3, m); the root is where the card has it. */
export function standing({ skeleton }: ModelCard, offsets: Float32Array): Float32Array {
  const joints = Float32Array.from(offsets);
  joints.set(skeleton.offsets[0]!);
  skeleton.parents.forEach((parent, joint) => {
    if (parent >= 0) for (let i = 0; i < 3; i++) joints[3 * joint + i]! += joints[3 * parent + i]!;
  });
  return joints;
}
