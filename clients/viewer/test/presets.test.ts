/** A preset is pressed where the state is at its point, and nowhere else. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { isAt } from "../src/controls.ts";
import { initial } from "../src/hash.ts";
import { CARD } from "./card.ts";

const PRESET = { name: "stroll", controls: { speed: 0.7, time: 5 }, performer: null };
const START = initial("hop", CARD);

test("all values and the performer count", () => {
  const there = { ...START, controls: { speed: 0.7, time: 5 } };
  assert.ok(isAt(there, PRESET));
  assert.ok(!isAt(START, PRESET));
  assert.ok(!isAt({ ...there, controls: { speed: 0.7, time: 5.001 } }, PRESET));
  assert.ok(!isAt({ ...there, performer: "ann" }, PRESET));
  assert.ok(isAt({ ...there, performer: "ann" }, { ...PRESET, performer: "ann" }));
  const calm = { style: "calm" };
  assert.ok(!isAt({ ...there, labels: calm }, PRESET));
  assert.ok(!isAt(there, { ...PRESET, labels: calm }));
  assert.ok(isAt({ ...there, labels: calm }, { ...PRESET, labels: calm }));
});
