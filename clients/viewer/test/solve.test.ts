/** A joint brought to a point: an arm of two links that knows where it is. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { Descent, type Places, type Point } from "../src/solve.ts";

/** Two angles (degrees) and a height that hardly matters. */
const FREE = [
  { minimum: -90, maximum: 90 },
  { minimum: 0, maximum: 150 },
  { minimum: 0.8, maximum: 1.2 },
];
const START = [10, 60, 1];

function hand([shoulder, elbow, height]: readonly number[]): Point {
  const first = (shoulder! * Math.PI) / 180;
  const second = first + (elbow! * Math.PI) / 180;
  const x = 0.3 * Math.cos(first) + 0.3 * Math.cos(second);
  return [x, height! + 0.3 * Math.sin(first) + 0.3 * Math.sin(second), 0];
}

async function solved(places: Places, target: Point, steps = 15) {
  const descent = new Descent(places, FREE, START, START, target);
  let found = await descent.step();
  for (let i = 1; i < steps; i++) {
    found = await descent.step();
    for (const [k, { minimum, maximum }] of FREE.entries())
      assert.ok(found.values[k]! >= minimum && found.values[k]! <= maximum);
  }
  return found;
}

const places: Places = async (settings) => settings.map(hand);

test("a point within reach is reached to a millimetre, and each step asks once", async () => {
  let asked = 0;
  const counted: Places = (settings) => {
    asked += 1;
    assert.equal(settings.length, 1 + FREE.length);
    return places(settings);
  };
  const { miss } = await solved(counted, hand([40, 90, 1.05]));
  assert.ok(miss < 1e-3, `${miss}`);
  assert.equal(asked, 15);
});

test("… and is not where it was at the start, nor after one step", async () => {
  assert.ok((await solved(places, hand([40, 90, 1.05]), 1)).miss > 0.05);
  assert.ok((await solved(places, hand([40, 90, 1.05]), 2)).miss > 1e-3);
});

test("one that is out of reach is approached from within the range, and the miss is told", async () => {
  const { miss } = await solved(places, [2, 1, 0]);
  assert.ok(Math.abs(miss - 1.4) < 0.02, `${miss}`);
});

test("controls that need not move stay", async () => {
  const { values } = await solved(places, hand(START));
  for (const [i, value] of values.entries()) assert.ok(Math.abs(value - START[i]!) < 1e-9);
});

test("a control without effect stays where it is", async () => {
  const blind: Places = async (settings) => settings.map(([a, b]) => hand([a!, b!, 1]));
  const { values } = await solved(blind, hand([40, 90, 1]));
  assert.equal(values[2], 1);
});
