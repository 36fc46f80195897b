/** Curves of answers: an array where there are some, null where there are none. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { encode } from "@msgpack/msgpack";

import { Unexpected } from "../src/index.ts";
import { crowd, motion, poses } from "../src/numbers.ts";

const TRUST = {
  model: "face@0123456789abcdef",
  controls: { smile: 0.5 },
  performer: null,
  level: 0,
  duration: 1,
  sigma: 0.001,
  warnings: [],
};

function packed(dtype: "<f4" | "<f8", ...shape: number[]) {
  const count = shape.reduce((all, size) => all * size, 1);
  const values = Array.from({ length: count }, (_, i) => i);
  const { buffer } = dtype === "<f4" ? Float32Array.from(values) : Float64Array.from(values);
  return { dtype, shape, data: new Uint8Array(buffer) };
}

function answer(more: object): Uint8Array<ArrayBuffer> {
  const plain = {
    trust: TRUST,
    times: packed("<f8", 3),
    rotations: packed("<f4", 3, 2, 4),
    root_position: packed("<f4", 3, 3),
    bone_offsets: packed("<f4", 2, 3),
    names: ["a", "b"],
    parents: [-1, 0],
    rate: 30,
    units: {},
  };
  return Uint8Array.from(encode({ ...plain, ...more }));
}

const CURVES = { curve_names: ["jawOpen", "smile"], curves: packed("<f4", 3, 2) };

test("poses and motions have their curves", () => {
  assert.deepEqual(poses(answer(CURVES)).curves, Float32Array.of(0, 1, 2, 3, 4, 5));
  const found = motion(answer(CURVES));
  assert.deepEqual(found.curveNames, ["jawOpen", "smile"]);
  assert.deepEqual(found.curves, Float32Array.of(0, 1, 2, 3, 4, 5));
});

function characters(more: object): Uint8Array<ArrayBuffer> {
  const plain = {
    model: TRUST.model,
    warnings: [],
    names: ["a", "b"],
    parents: [-1, 0],
    rotations: packed("<f4", 3, 2, 4),
    root_position: packed("<f4", 3, 3),
    bone_offsets: packed("<f4", 3, 2, 3),
    duration: packed("<f4", 3),
    sigma: packed("<f4", 3),
    levels: { dtype: "|i1", shape: [3], data: new Uint8Array(3) },
  };
  return Uint8Array.from(encode({ ...plain, ...more }));
}

test("a crowd has the curves of each character, or none", () => {
  const found = crowd(characters(CURVES));
  assert.deepEqual(found.curveNames, ["jawOpen", "smile"]);
  assert.deepEqual(found.curves, Float32Array.of(0, 1, 2, 3, 4, 5));
  const { curves, curveNames } = crowd(characters({}));
  assert.deepEqual([curves, curveNames], [null, []]);
  assert.throws(() => crowd(characters({ ...CURVES, curves: packed("<f4", 2, 2) })), Unexpected);
});

test("answers without curves have none", () => {
  assert.equal(poses(answer({})).curves, null);
  assert.deepEqual([motion(answer({})).curves, motion(answer({})).curveNames], [null, []]);
});

test("curves of other frames are refused", () => {
  const wrong = { ...CURVES, curves: packed("<f4", 2, 2) };
  assert.throws(() => poses(answer(wrong)), Unexpected);
});
