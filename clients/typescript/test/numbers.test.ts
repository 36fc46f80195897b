/** Arrays of answers: typed arrays of the shapes that fit each other, or no answer. */

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

const CLIP = {
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
const CROWD = {
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
const CURVES = { curve_names: ["jawOpen", "smile"], curves: packed("<f4", 3, 2) };

const content = (answer: object) => Uint8Array.from(encode(answer));

test("curves are an array, or null", () => {
  const values = Float32Array.of(0, 1, 2, 3, 4, 5);
  assert.deepEqual(poses(content({ ...CLIP, ...CURVES })).curves, values);
  for (const [read, plain] of [[motion, CLIP] as const, [crowd, CROWD] as const]) {
    const found = read(content({ ...plain, ...CURVES }));
    assert.deepEqual([found.curveNames, found.curves], [CURVES.curve_names, values]);
    const bare = read(content(plain));
    assert.deepEqual([bare.curveNames, bare.curves], [[], null]);
  }
});

test("arrays that do not fit are no answer", () => {
  const wrong: Record<string, object> = {
    "too few bytes": { rotations: { ...CLIP.rotations, data: new Uint8Array(92) } },
    "another shape": { root_position: packed("<f4", 3, 2) },
    "another kind": { times: packed("<f4", 3) },
    "no array": { bone_offsets: [1, 2, 3] },
    "other frames": { curves: packed("<f4", 2, 2) },
    nothing: { trust: null },
    "half of the trust": { trust: { model: "m" } },
    "a text for a list": { trust: { ...TRUST, warnings: "none" } },
  };
  for (const [what, part] of Object.entries(wrong))
    assert.throws(() => poses(content({ ...CLIP, ...part })), Unexpected, what);
  assert.throws(() => poses(Uint8Array.of(0xc1)), Unexpected);
});
