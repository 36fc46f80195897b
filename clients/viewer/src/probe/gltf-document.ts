/** glTF: the JSON of a file and the numbers of its buffers, of which only those asked for are read. */

import { Refusal } from "./motion.ts";

export interface GltfNode {
  readonly name?: string;
  readonly children?: readonly number[];
  readonly matrix?: readonly number[];
  readonly translation?: readonly number[];
  readonly rotation?: readonly number[];
  readonly scale?: readonly number[];
  readonly mesh?: number;
  readonly skin?: number;
  readonly camera?: number;
}

export interface GltfAnimation {
  readonly name?: string;
  readonly channels: readonly {
    readonly sampler: number;
    readonly target: { readonly node?: number; readonly path: string };
  }[];
  readonly samplers: readonly {
    readonly input: number;
    readonly output: number;
    readonly interpolation?: string;
  }[];
}

interface Accessor {
  readonly bufferView?: number;
  readonly byteOffset?: number;
  readonly componentType: number;
  readonly count: number;
  readonly type: string;
  readonly normalized?: boolean;
  readonly sparse?: unknown;
}

interface View {
  readonly buffer: number;
  readonly byteOffset?: number;
  readonly byteLength: number;
  readonly byteStride?: number;
}

export interface GltfParts {
  readonly asset?: { readonly version?: string };
  readonly nodes?: readonly GltfNode[];
  readonly skins?: readonly { readonly joints: readonly number[] }[];
  readonly animations?: readonly GltfAnimation[];
  readonly accessors?: readonly Accessor[];
  readonly bufferViews?: readonly View[];
  readonly buffers?: readonly { readonly uri?: string; readonly byteLength: number }[];
  readonly extensionsRequired?: readonly string[];
}

/** Finds a file that was dropped together with this one. */
export type Beside = (name: string) => Blob | null;

const MAGIC = 0x46546c67;
const [JSON_CHUNK, BINARY_CHUNK] = [0x4e4f534a, 0x004e4942];
const JSON_BYTES = 64_000_000;
const MOST_NUMBERS = 20_000_000;
const HARMLESS =
  /^(KHR_mesh_quantization$|KHR_texture|KHR_materials|KHR_lights|KHR_xmp|EXT_texture)/;
const WIDTHS: Readonly<Record<string, number>> = { SCALAR: 1, VEC3: 3, VEC4: 4 };
/** Bytes of a number, how it is read, and what it is divided by where it is a share. */
const COMPONENTS: Readonly<Record<number, readonly [number, keyof DataView, number]>> = {
  5120: [1, "getInt8", 127],
  5121: [1, "getUint8", 255],
  5122: [2, "getInt16", 32767],
  5123: [2, "getUint16", 65535],
  5125: [4, "getUint32", 4294967295],
  5126: [4, "getFloat32", 1],
};

export class GltfDocument {
  readonly parts: GltfParts;
  readonly #binary: Blob;
  readonly #beside: Beside;

  private constructor(parts: GltfParts, binary: Blob, beside: Beside) {
    this.parts = parts;
    this.#binary = binary;
    this.#beside = beside;
  }

  static async open(file: Blob, beside: Beside): Promise<GltfDocument> {
    const head = new DataView(await file.slice(0, 12).arrayBuffer());
    const packed = head.byteLength === 12 && head.getUint32(0, true) === MAGIC;
    const [text, binary] = packed ? await chunks(file, head) : [file, new Blob()];
    if (text.size > JSON_BYTES)
      throw new Refusal(`found ${text.size} bytes of JSON, expected at most ${JSON_BYTES}`);
    return new GltfDocument(checked(await text.text()), binary, beside);
  }

  /** The numbers of an accessor, `width` of them a value; normalized integers as shares. */
  async numbers(index: number, kind: string): Promise<Float64Array> {
    const accessor = item(this.parts.accessors, index, "accessor");
    const component = COMPONENTS[accessor.componentType];
    const width = WIDTHS[kind]!;
    const { count } = accessor;
    if (accessor.type !== kind || !component)
      throw new Refusal(`accessor ${index} has type ${accessor.type}, expected ${kind}`);
    if (!(count > 0 && count * width <= MOST_NUMBERS))
      throw new Refusal(`accessor ${index} has ${count} values, expected at least 1`);
    if (accessor.sparse || accessor.bufferView === undefined)
      throw new Refusal(
        `accessor ${index} is sparse: posefield probe reads it, this page does not`,
      );
    const [size, read, most] = component;
    const view = item(this.parts.bufferViews, accessor.bufferView, "buffer view");
    const stride = view.byteStride ?? size * width;
    const begin = accessor.byteOffset ?? 0;
    const end = begin + (count - 1) * stride + size * width;
    if (begin < 0 || end > view.byteLength)
      throw new Refusal(
        `buffer view ${accessor.bufferView} has ${view.byteLength} bytes, expected ${end}`,
      );
    const start = (view.byteOffset ?? 0) + begin;
    const content = new DataView(await this.#slice(view.buffer, start, start + end - begin));
    const share = accessor.normalized ? most : 1;
    return Float64Array.from({ length: count * width }, (_, at) => {
      const place = Math.floor(at / width) * stride + (at % width) * size;
      const value = (content[read] as (place: number, little: boolean) => number)(place, true);
      if (!Number.isFinite(value))
        throw new Refusal(`accessor ${index} has numbers that are not finite`);
      return Math.max(value / share, accessor.normalized ? -1 : value);
    });
  }

  async #slice(index: number, from: number, to: number): Promise<ArrayBuffer> {
    const { uri, byteLength } = item(this.parts.buffers, index, "buffer");
    const whole = uri === undefined ? this.#binary : this.#resource(uri);
    if (whole.size < byteLength || to > whole.size)
      throw new Refusal(
        `buffer ${index} has ${whole.size} bytes, expected ${byteLength}: the file is not whole`,
      );
    return whole.slice(from, to).arrayBuffer();
  }

  #resource(uri: string): Blob {
    if (!uri.startsWith("data:")) {
      const found = this.#beside(decodeURIComponent(uri));
      if (found) return found;
      throw new Refusal(`refers to ${uri} beside it: drop both files together, or export GLB`);
    }
    const [head, text] = uri.split(",", 2) as [string, string?];
    if (!head.endsWith(";base64") || text === undefined)
      throw new Refusal("found a data URI without base64, expected base64");
    return new Blob([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))]);
  }
}

export function item<Item>(all: readonly Item[] | undefined, index: number, what: string): Item {
  const found = all?.[index];
  if (found === undefined) throw new Refusal(`names ${what} ${index}, but has ${all?.length ?? 0}`);
  return found;
}

/** JSON and binary chunk of a GLB file. */
async function chunks(file: Blob, head: DataView): Promise<[Blob, Blob]> {
  const [version, length] = [head.getUint32(4, true), head.getUint32(8, true)];
  if (version !== 2 || length > file.size)
    throw new Refusal(
      `found version ${version} and ${file.size} of ${length} bytes, expected a whole file of version 2`,
    );
  const found = new Map<number, Blob>();
  for (let place = 12; place + 8 <= length; ) {
    const chunk = new DataView(await file.slice(place, place + 8).arrayBuffer());
    const begin = place + 8;
    place = begin + chunk.getUint32(0, true);
    const kind = chunk.getUint32(4, true);
    if (!found.has(kind)) found.set(kind, file.slice(begin, place));
  }
  const text = found.get(JSON_CHUNK);
  if (!text) throw new Refusal("found no JSON chunk, expected one");
  return [text, found.get(BINARY_CHUNK) ?? new Blob()];
}

function checked(text: string): GltfParts {
  let parts: GltfParts;
  try {
    parts = JSON.parse(text) as GltfParts;
  } catch (fault) {
    throw new Refusal(`not glTF: ${(fault as Error).message}`);
  }
  const version = parts?.asset?.version;
  if (typeof version !== "string" || version.split(".")[0] !== "2")
    throw new Refusal(`found version ${version ?? "none"} of glTF, expected 2.0`);
  const unread = (parts.extensionsRequired ?? []).filter((name) => !HARMLESS.test(name));
  if (unread.length)
    throw new Refusal(
      `requires the extensions ${unread.join(", ")}, expected none that compress or replace animations: export it without`,
    );
  return parts;
}
