import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { choose, pixels } from "../src/detail.ts";

const ERRORS = Float64Array.of(0.01, 0.02, 0.05, 0.1);

describe("the level that a view asks for", () => {
  it("is the coarsest whose error covers no more than the limit", () => {
    for (const [scale, level] of [
      [200, 0],
      [50, 1],
      [49, 1],
      [20, 2],
      [10, 3],
      [1, 3],
    ] as const) {
      assert.equal(choose(ERRORS, scale, 1), level, `at ${scale} pixels a metre`);
    }
  });

  it("is finer at once and coarser only with room to spare", () => {
    const scale = 20;
    assert.equal(choose(ERRORS, scale, 1, 3), 2);
    assert.equal(choose(ERRORS, scale, 1, 2), 2);
    assert.equal(choose(ERRORS, scale, 1, 1), 1);
    assert.equal(choose(ERRORS, 0.79 * scale, 1, 1), 2);
  });
});

it("a metre covers the whole image where the lens sees a metre", () => {
  const lens = { fov: 2 * Math.atan(0.5), height: 720 };
  assert.ok(Math.abs(pixels(lens) - 720) < 1e-9);
  assert.ok(Math.abs(pixels({ ...lens, fov: 1 }) - 720) > 1);
});
