/** Length of a video. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { length, SHORTEST } from "../src/video.ts";

test("a clip that loops is recorded in whole laps, at least three seconds", () => {
  assert.equal(length(1.25, true), 3.75);
  assert.equal(length(SHORTEST, true), SHORTEST);
  assert.equal(length(5, true), 5);
});

test("a clip that ends is recorded once", () => {
  assert.equal(length(1.25, false), 1.25);
});
