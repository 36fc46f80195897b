/**
 * Arrays as they travel in MessagePack, as typed arrays.
 *
 * They travel as maps of dtype, shape and little-endian bytes, which is how every engine that runs
 * this holds them too. They are views of the answer where their numbers begin at a multiple of
 * their size, else copies.
 */

import { decode } from "@msgpack/msgpack";

import { checked } from "./documents.ts";
import { Unexpected } from "./errors.ts";
import type { CrowdPoses, Motion, PerformanceMotion, Poses } from "./types.ts";

type Packed = Readonly<Record<string, unknown>>;
type Shape = readonly number[];

interface PackedArray {
  readonly dtype: string;
  readonly shape: Shape;
  readonly data: Uint8Array<ArrayBuffer>;
}

export function poses(content: Uint8Array<ArrayBuffer>): Poses {
  const found = unpacked(content);
  return { ...arraysOf(found), trust: checked("Trust", found["trust"]) };
}

export function motion(content: Uint8Array<ArrayBuffer>): Motion {
  const found = unpacked(content);
  return { ...motionOf(found), trust: checked("Trust", found["trust"]) };
}

export function performance(content: Uint8Array<ArrayBuffer>): PerformanceMotion {
  const found = unpacked(content);
  return { ...motionOf(found), trust: checked("PerformanceReport", found["trust"]) };
}

function motionOf(found: Packed): Omit<Motion, "trust"> {
  const arrays = arraysOf(found);
  const names = strings(found, "names");
  expectSame("names", names.length, arrays.boneOffsets.length / 3);
  return {
    ...arrays,
    names,
    parents: integers(found, "parents", names.length),
    curveNames: arrays.curves ? strings(found, "curve_names") : [],
    rate: field(found, "rate", isNumber, "a number"),
    frames: arrays.times.length,
    units: field(found, "units", isMap, "a map") as Record<string, string>,
  };
}

export function crowd(content: Uint8Array<ArrayBuffer>): CrowdPoses {
  const found = unpacked(content);
  const [count = 0, joints = 0] = arrayOf(found, "rotations").shape;
  return {
    model: field(found, "model", isText, "a text"),
    names: strings(found, "names"),
    parents: integers(found, "parents", joints),
    warnings: strings(found, "warnings"),
    rotations: float32(found, "rotations", [count, joints, 4]),
    rootPosition: float32(found, "root_position", [count, 3]),
    boneOffsets: float32(found, "bone_offsets", [count, joints, 3]),
    duration: float32(found, "duration", [count]),
    sigma: float32(found, "sigma", [count]),
    supported: "supported" in found ? truths(found, "supported", [count]) : null,
    levels: Int32Array.from(new Int8Array(bytes(found, "levels", "|i1", 1, [count]))),
    errorPx: "error_px" in found ? float32(found, "error_px", [count]) : null,
    curveNames: "curve_names" in found ? strings(found, "curve_names") : [],
    curves: "curves" in found ? curvesOf(found, count) : null,
  };
}

function arraysOf(found: Packed): Omit<Poses, "trust"> {
  const [frames = 0, joints = 0] = arrayOf(found, "rotations").shape;
  return {
    times: float64(found, "times", [frames]),
    rotations: float32(found, "rotations", [frames, joints, 4]),
    rootPosition: float32(found, "root_position", [frames, 3]),
    boneOffsets: float32(found, "bone_offsets", [joints, 3]),
    curves: "curves" in found ? curvesOf(found, frames) : null,
  };
}

function curvesOf(found: Packed, rows: number): Float32Array {
  const [, curves = 0] = arrayOf(found, "curves").shape;
  return float32(found, "curves", [rows, curves]);
}

function unpacked(content: Uint8Array<ArrayBuffer>): Packed {
  try {
    return field({ answer: decode(content) }, "answer", isMap, "a map");
  } catch (fault) {
    if (fault instanceof Unexpected) throw fault;
    throw new Unexpected(`the answer is no MessagePack: ${fault}`, { cause: fault });
  }
}

function float32(found: Packed, name: string, shape: Shape): Float32Array<ArrayBuffer> {
  const { buffer, byteOffset, byteLength } = bytes(found, name, "<f4", 4, shape);
  return new Float32Array(buffer, byteOffset, byteLength / 4);
}

function float64(found: Packed, name: string, shape: Shape): Float64Array<ArrayBuffer> {
  const { buffer, byteOffset, byteLength } = bytes(found, name, "<f8", 8, shape);
  return new Float64Array(buffer, byteOffset, byteLength / 8);
}

function truths(found: Packed, name: string, shape: Shape): boolean[] {
  return Array.from(bytes(found, name, "|b1", 1, shape), (byte) => byte !== 0);
}

/** Bytes of an array of a shape, at an offset where numbers of their size may begin. */
function bytes(
  found: Packed,
  name: string,
  dtype: string,
  size: number,
  shape: Shape,
): Uint8Array<ArrayBuffer> {
  const array = arrayOf(found, name);
  expectSame(name, `${array.dtype} (${array.shape})`, `${dtype} (${shape})`);
  expectSame(`bytes of ${name}`, array.data.length, size * shape.reduce((a, b) => a * b, 1));
  return array.data.byteOffset % size ? array.data.slice() : array.data;
}

function arrayOf(found: Packed, name: string): PackedArray {
  const { dtype, shape, data } = field(found, name, isMap, "an array");
  if (typeof dtype === "string" && isIntegers(shape) && data instanceof Uint8Array)
    return { dtype, shape, data: data as Uint8Array<ArrayBuffer> };
  throw new Unexpected(`${name}: found no array`);
}

function strings(found: Packed, name: string): readonly string[] {
  return field(found, name, isTexts, "a list of texts");
}

function integers(found: Packed, name: string, length: number): readonly number[] {
  const values = field(found, name, isIntegers, "a list of whole numbers");
  expectSame(name, values.length, length);
  return values;
}

function field<Kind>(
  found: Packed,
  name: string,
  is: (value: unknown) => value is Kind,
  expected: string,
): Kind {
  const value = found[name];
  if (is(value)) return value;
  const kind = value === undefined ? "nothing" : JSON.stringify(value).slice(0, 40);
  throw new Unexpected(`${name}: found ${kind}, expected ${expected}`);
}

const isText = (value: unknown): value is string => typeof value === "string";
const isNumber = (value: unknown): value is number => typeof value === "number";
const isMap = (value: unknown): value is Packed =>
  typeof value === "object" && value !== null && !Array.isArray(value);
const isTexts = (value: unknown): value is readonly string[] =>
  Array.isArray(value) && value.every(isText);
const isIntegers = (value: unknown): value is readonly number[] =>
  Array.isArray(value) && value.every(Number.isInteger);

function expectSame(name: string, found: string | number, expected: string | number): void {
  if (found !== expected) throw new Unexpected(`${name}: found ${found}, expected ${expected}`);
}
