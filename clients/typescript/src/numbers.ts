/** Arrays as they travel in MessagePack, as typed arrays. */

import { Unexpected } from "./errors.ts";
import type { CrowdPoses, Motion, Poses, Trust } from "./types.ts";

export type Packed = Record<string, unknown>;

interface PackedArray {
  readonly dtype: string;
  readonly shape: readonly number[];
  readonly data: Uint8Array;
}

export function poses(found: Packed): Poses {
  return {
    trust: found["trust"] as Trust,
    times: Float64Array.from(numbers(found, "times")),
    rotations: single(found, "rotations"),
    rootPosition: single(found, "root_position"),
    boneOffsets: single(found, "bone_offsets"),
  };
}

export function motion(found: Packed): Motion {
  return {
    ...poses(found),
    names: found["names"] as string[],
    parents: [...numbers(found, "parents")],
    rate: found["rate"] as number,
    frames: found["frames"] as number,
  };
}

export function crowd(found: Packed): CrowdPoses {
  return {
    model: found["model"] as string,
    names: found["names"] as string[],
    parents: [...numbers(found, "parents")],
    warnings: found["warnings"] as string[],
    rotations: single(found, "rotations"),
    rootPosition: single(found, "root_position"),
    boneOffsets: single(found, "bone_offsets"),
    duration: single(found, "duration"),
    sigma: single(found, "sigma"),
    levels: Int32Array.from(numbers(found, "levels")),
    errorPx: "error_px" in found ? single(found, "error_px") : null,
  };
}

function single(found: Packed, name: string): Float32Array {
  return Float32Array.from(numbers(found, name));
}

function numbers(found: Packed, name: string): ArrayLike<number> & Iterable<number> {
  const value = found[name];
  if (Array.isArray(value)) return value as number[];
  const packed = value as PackedArray | undefined;
  const kind = packed && KINDS[packed.dtype];
  if (!kind) throw new Unexpected(`${name}: found ${packed?.dtype ?? "nothing"}, expected numbers`);
  // Copied to where numbers of their size may begin.
  return new kind(packed.data.slice().buffer);
}

const KINDS: Record<
  string,
  new (
    buffer: ArrayBuffer,
  ) => Float32Array | Float64Array | Int32Array | BigInt64Array extends infer A
    ? A extends ArrayLike<number>
      ? A & Iterable<number>
      : never
    : never
> = {
  "<f4": Float32Array as never,
  "<f8": Float64Array as never,
  "<i4": Int32Array as never,
  "|u1": Uint8Array as never,
};
