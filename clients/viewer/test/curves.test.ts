/** Curves between frames. */

import assert from "node:assert/strict";
import { test } from "node:test";

import type { Motion } from "@posefield/client";

import { curvesAt } from "../src/playback.ts";

/** Three frames of two curves, at 10 a second. */
const CLIP = {
  times: Float64Array.of(0, 0.1, 0.2),
  rate: 10,
  curves: Float32Array.of(0, 1, 0.5, 0.5, 1, 0),
} as Pick<Motion, "times" | "rate" | "curves"> as Motion;

function near(found: Float32Array | null, expected: readonly number[]): boolean {
  return expected.every((value, index) => Math.abs(found![index]! - value) < 1e-6);
}

test("curves lie on the line between the frames around them", () => {
  assert.ok(near(curvesAt(CLIP, 0.1), [0.5, 0.5]));
  assert.ok(near(curvesAt(CLIP, 0.05), [0.25, 0.75]));
  assert.ok(!near(curvesAt(CLIP, 0.05), [0.75, 0.25]));
  assert.equal(curvesAt(CLIP, 0.05)!.length, 2);
});

test("before and after the clip they are those of its ends", () => {
  assert.ok(near(curvesAt(CLIP, -1), [0, 1]));
  assert.ok(near(curvesAt(CLIP, 1), [1, 0]));
});

test("a clip without curves has none", () => {
  assert.equal(curvesAt({ ...CLIP, curves: null }, 0.1), null);
});
