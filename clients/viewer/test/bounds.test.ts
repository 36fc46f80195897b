/** Outside the sampled ranges answers are bounded, as the service bounds them. */

import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { band, worded } from "../src/bands.ts";
import { Bounds, deviations, limited, merged, sentence, told } from "../src/offline/bounds.ts";
import { CARD } from "./card.ts";

const bounds = new Bounds(CARD);

describe("bounds of answers", () => {
  it("hold a control to a quarter of its range outside", () => {
    const [speed] = CARD.controls;
    assert.equal(limited(speed!, 3), 2 + 0.25 * 1.5);
    assert.equal(limited(speed!, -9), 0.5 - 0.25 * 1.5);
    assert.equal(limited(speed!, 2.2), 2.2);
    const far = Float32Array.of(9, -100, 1, 0);
    assert.deepEqual([...bounds.limit(far)], [2.375, -30, 1, 0]);
    assert.deepEqual([...bounds.nearest(far)], [2, -20, 1, 0]);
    assert.deepEqual(bounds.outside(far), [true, false]);
  });

  it("hold a duration to a quarter of the captured ones, or to that at the nearest controls", () => {
    assert.equal(bounds.duration(0.1, 1.5), 0.75);
    assert.equal(bounds.duration(9, 1.5), 2.5);
    assert.equal(bounds.duration(1.1, 1.5), 1.1);
    assert.equal(bounds.duration(0.1, 0.6), 0.6);
    assert.equal(bounds.duration(9, 3), 3);
  });

  it("tell what was asked and given, and on which side", () => {
    const found = deviations(CARD, [3, -20.5]);
    assert.equal(found.length, 1);
    assert.equal(
      sentence(found[0]!),
      "speed: asked 3 m/s, given 2.375 m/s, captured 0.5 to 2 m/s; below what was asked",
    );
    const said = ["speed = 3 m/s lies outside", "time = 9 deg lies outside"];
    assert.deepEqual(merged(said, found), [sentence(found[0]!), said[1]]);
    assert.equal(deviations(CARD, [-1, 0])[0]!.side, "above");
    assert.deepEqual(deviations(CARD, [2.376, 30.03]), []);
    assert.deepEqual(told([], 0.05), { band: "near" });
    assert.deepEqual(told(found, 0.5), { band: "guess", deviations: found });
  });
});

describe("bands of sigma", () => {
  it("are one scale for all models", () => {
    const expected = { 0.03: "close", 0.031: "near", 0.075: "near", 0.15: "rough", 0.151: "guess" };
    for (const [sigma, name] of Object.entries(expected)) assert.equal(band(Number(sigma)), name);
    assert.match(worded(0.2), /more than 15 cm/);
  });
});
