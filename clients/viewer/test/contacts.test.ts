/** Feet on the ground, on steps whose sliding is known. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { ground } from "../src/feet.ts";

const RATE = 50;

/** Stands for a second, sliding at so many m/s; swings for one; stands again. */
function foot(slide: number): Float32Array {
  const track = new Float32Array(3 * 150);
  for (let frame = 0; frame < 150; frame++) {
    const swing = frame >= 50 && frame < 100 ? (frame - 50) / 50 : frame < 50 ? 0 : 1;
    const stood = Math.min(frame, 49) + Math.max(0, frame - 100);
    track[3 * frame] = 0.8 * swing + (slide / RATE) * stood;
    track[3 * frame + 1] = 0.05 + 0.15 * Math.sin(Math.PI * swing);
  }
  return track;
}

test("a foot that stands still does not slide", () => {
  const found = ground([foot(0)], RATE);
  assert.equal(found.contacts.length, 2);
  assert.ok(found.slide < 0.04, `${found.slide}`);
});

test("one that slides does so at its speed", () => {
  const still = ground([foot(0)], RATE).slide;
  for (const slide of [0.1, 0.3]) {
    const found = ground([foot(slide)], RATE).slide;
    assert.ok(Math.abs(found - still - slide) < 0.02, `${found}`);
  }
});

test("contacts say when and where", () => {
  const found = ground([foot(0), foot(0)], RATE);
  assert.deepEqual(
    found.contacts.map(({ foot }) => foot),
    [0, 0, 1, 1],
  );
  assert.ok(Math.abs(found.contacts[1]!.x - 0.8) < 0.02);
  assert.deepEqual(
    found.contacts.map(({ first, last }) => [first < 3, last > 120]),
    [
      [true, false],
      [false, true],
      [true, false],
      [false, true],
    ],
  );
});

test("a foot that never stands for two frames says nothing", () => {
  const hop = Float32Array.from({ length: 30 }, (_, i) => (i % 3 === 1 ? Math.abs(15 - i) : 0));
  assert.equal(ground([hop], RATE).slide, 0);
});
