/** The character that the page draws, from a file made here: what is read, and how it is fitted. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { fitted, read, standing } from "../src/character.ts";
import { CARD } from "./card.ts";

const POINTS = Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1);

/** Binary glTF of two meshes on the same four points, as the service writes it. */
function file(): Uint8Array<ArrayBuffer> {
  const arrays = [
    [POINTS, "VEC3", 5126],
    [POINTS.map((x) => -x), "VEC3", 5126],
    [Uint8Array.of(0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0), "VEC4", 5121],
    [Uint8Array.of(200, 55, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0), "VEC4", 5121],
    [Uint16Array.of(0, 1, 1, 2, 2, 2, 0, 3), "VEC2", 5123],
    [Float32Array.of(0, 0.5, 0, 1), "SCALAR", 5126],
    [Uint16Array.of(0, 1, 2, 0, 2, 3), "SCALAR", 5123],
    [Uint16Array.of(0, 1, 3, 0), "SCALAR", 5123],
  ] as const;
  const widths = { VEC2: 2, VEC3: 3, VEC4: 4, SCALAR: 1 };
  let byteOffset = 0;
  const bufferViews = arrays.map(([own]) => {
    const view = { byteOffset };
    byteOffset += own.byteLength;
    return view;
  });
  const accessors = arrays.map(([own, type, componentType], bufferView) => {
    return { bufferView, componentType, type, count: own.length / widths[type] };
  });
  const names = ["POSITION", "NORMAL", "JOINTS_0", "WEIGHTS_0", "_ANCHORS", "_SHARE"];
  const attributes = Object.fromEntries(names.map((name, at) => [name, at]));
  const meshes = [6, 7].map((indices) => ({ primitives: [{ attributes, indices }] }));
  const said = JSON.stringify({ accessors, bufferViews, meshes });
  const text = new TextEncoder().encode(said.padEnd(Math.ceil(said.length / 4) * 4));
  const made = new Uint8Array(28 + text.length + byteOffset);
  new DataView(made.buffer).setUint32(12, text.length, true);
  made.set(text, 20);
  arrays.forEach(([own], at) => {
    const bytes = new Uint8Array(own.buffer, own.byteOffset, own.byteLength);
    made.set(bytes, 28 + text.length + bufferViews[at]!.byteOffset);
  });
  return made;
}

test("all arrays of the file are read", () => {
  const found = read(file());
  assert.deepEqual([...found.points], [...POINTS]);
  assert.deepEqual([...found.normals], [...POINTS.map((x) => -x)]);
  assert.deepEqual([...found.joints.subarray(0, 4)], [0, 1, 0, 0]);
  assert.deepEqual([...found.weights.subarray(0, 4)], [200, 55, 0, 0]);
  assert.deepEqual([...found.anchors], [0, 1, 1, 2, 2, 2, 0, 3]);
  assert.deepEqual([...found.shares], [0, 0.5, 0, 1]);
  assert.deepEqual([...found.fine], [0, 1, 2, 0, 2, 3]);
  assert.deepEqual([...found.coarse], [0, 1, 3, 0]);
});

test("a file within a larger buffer is read as well", () => {
  const own = file();
  const larger = new Uint8Array(own.length + 8);
  larger.set(own, 8);
  assert.deepEqual(read(larger.subarray(8)), read(own));
});

test("joints stand where offsets add up to, and the root where the card has it", () => {
  const offsets = Float32Array.from(CARD.skeleton.offsets.flat());
  offsets[0] = 9;
  const found = [...standing(CARD, offsets)].map((x) => Number(x.toFixed(5)));
  assert.deepEqual(found, [0, 0, 0, 0.1, -0.4, 0, 0.1, -0.8, 0.05, 0.2, 0.5, 0]);
});

test("points move with the place on the bone that they belong to", () => {
  const character = read(file());
  const rest = new Float32Array(12);
  const now = Float32Array.of(0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0, 8);
  const out = new Float32Array(12);
  fitted(out, character, rest, now);
  // The second lies half-way between joints 1 and 2, the last one at joint 3.
  assert.deepEqual([...out], [0, 0, 0, 2, 2, 0, 0, 5, 0, 0, 0, 9]);
  fitted(out, character, rest, rest);
  assert.deepEqual([...out], [...POINTS]);
});
