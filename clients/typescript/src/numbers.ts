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
  const own = arraysOf(found);
  const names = strings(found, "names");
  expectLength("names", names.length, own.boneOffsets.length / 3);
  return {
    ...own,
    names,
    parents: integers(found, "parents", names.length),
    curveNames: own.curves ? strings(found, "curve_names") : [],
    rate: number(found, "rate"),
    frames: own.times.length,
    units: record<Record<string, string>>(found, "units"),
  };
}

export function crowd(content: Uint8Array<ArrayBuffer>): CrowdPoses {
  const found = unpacked(content);
  const [count = 0, joints = 0] = array(found, "rotations").shape;
  return {
    model: text(found, "model"),
    names: strings(found, "names"),
    parents: integers(found, "parents", joints),
    warnings: strings(found, "warnings"),
    rotations: float32(found, "rotations", [count, joints, 4]),
    rootPosition: float32(found, "root_position", [count, 3]),
    boneOffsets: float32(found, "bone_offsets", [count, joints, 3]),
    duration: float32(found, "duration", [count]),
    sigma: float32(found, "sigma", [count]),
    supported: "supported" in found ? truths(found, "supported", [count]) : null,
    levels: Int32Array.from(int8(found, "levels", [count])),
    errorPx: "error_px" in found ? float32(found, "error_px", [count]) : null,
    curveNames: "curve_names" in found ? strings(found, "curve_names") : [],
    curves: "curves" in found ? curvesOf(found, count) : null,
  };
}

function arraysOf(found: Packed): Omit<Poses, "trust"> {
  const [frames = 0, joints = 0] = array(found, "rotations").shape;
  return {
    times: float64(found, "times", [frames]),
    rotations: float32(found, "rotations", [frames, joints, 4]),
    rootPosition: float32(found, "root_position", [frames, 3]),
    boneOffsets: float32(found, "bone_offsets", [joints, 3]),
    curves: "curves" in found ? curvesOf(found, frames) : null,
  };
}

function curvesOf(found: Packed, rows: number): Float32Array {
  const [, curves = 0] = array(found, "curves").shape;
  return float32(found, "curves", [rows, curves]);
}

function unpacked(content: Uint8Array<ArrayBuffer>): Packed {
  try {
    return record({ answer: decode(content) }, "answer");
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

function int8(found: Packed, name: string, shape: Shape): Int8Array<ArrayBuffer> {
  const { buffer, byteOffset, byteLength } = bytes(found, name, "|i1", 1, shape);
  return new Int8Array(buffer, byteOffset, byteLength);
}

function truths(found: Packed, name: string, shape: Shape): boolean[] {
  return Array.from(bytes(found, name, "|b1", 1, shape), (byte) => byte !== 0);
}

/** The bytes of an array of a shape, where numbers of their size may begin. */
function bytes(
  found: Packed,
  name: string,
  dtype: string,
  size: number,
  shape: Shape,
): Uint8Array<ArrayBuffer> {
  const { data, ...own } = array(found, name);
  const [said, expected] = [`${own.dtype} (${own.shape})`, `${dtype} (${shape})`];
  if (said !== expected) throw new Unexpected(`${name}: found ${said}, expected ${expected}`);
  expectLength(`bytes of ${name}`, data.length, size * shape.reduce((a, b) => a * b, 1));
  return data.byteOffset % size ? data.slice() : data;
}

function array(found: Packed, name: string): PackedArray {
  const { dtype, shape, data } = record(found, name);
  if (typeof dtype === "string" && isIntegers(shape) && isBytes(data))
    return { dtype, shape, data };
  throw new Unexpected(`${name}: found no array`);
}

function record<Kind extends object = Packed>(found: Packed, name: string): Kind {
  const value = found[name];
  if (typeof value === "object" && value && !Array.isArray(value)) return value as Kind;
  throw unlike(name, value, "a map");
}

function text(found: Packed, name: string): string {
  const value = found[name];
  if (typeof value === "string") return value;
  throw unlike(name, value, "a text");
}

function number(found: Packed, name: string): number {
  const value = found[name];
  if (typeof value === "number") return value;
  throw unlike(name, value, "a number");
}

function strings(found: Packed, name: string): readonly string[] {
  const value = found[name];
  if (isList(value) && value.every((text) => typeof text === "string")) return value;
  throw unlike(name, value, "a list of texts");
}

function integers(found: Packed, name: string, length: number): readonly number[] {
  const value = found[name];
  if (!isIntegers(value)) throw unlike(name, value, "a list of whole numbers");
  expectLength(name, value.length, length);
  return value;
}

function isList(value: unknown): value is readonly unknown[] {
  return Array.isArray(value);
}

function isIntegers(value: unknown): value is readonly number[] {
  return isList(value) && value.every(Number.isInteger);
}

function isBytes(value: unknown): value is Uint8Array<ArrayBuffer> {
  return value instanceof Uint8Array;
}

function unlike(name: string, value: unknown, expected: string): Unexpected {
  const kind = value === undefined ? "nothing" : JSON.stringify(value).slice(0, 40);
  return new Unexpected(`${name}: found ${kind}, expected ${expected}`);
}

function expectLength(name: string, found: number, expected: number): void {
  if (found !== expected) throw new Unexpected(`${name}: found ${found}, expected ${expected}`);
}
