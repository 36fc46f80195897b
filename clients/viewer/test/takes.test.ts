/** Takes and feet: what is asked of a service, and what is said of its answer. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { says } from "../src/feet-words.ts";
import { initial } from "../src/hash.ts";
import type { Source } from "../src/page.ts";
import { LARGEST_SEED, nextSeed, otherTakes, takeAndFeet, takeFields } from "../src/takes.ts";
import { CARD as PLAIN } from "./card.ts";

const CARD = {
  ...PLAIN,
  feet: [2],
  contacts: [{ joint: 2 }],
  diagnostics: { detail: { directions: 3 } },
} as unknown as typeof PLAIN;
const SERVICE = { file: () => undefined } as unknown as Source;
const COPY = {} as Source;
const START = initial("hop", CARD);

test("the prediction asks for nothing new, so that its answer is that of before", () => {
  assert.deepEqual(takeAndFeet(SERVICE, CARD, START), {});
  assert.deepEqual(takeAndFeet(SERVICE, CARD, { ...START, variety: 0.2 }), {});
});

test("a take asks for its seed, and for what is not usual", () => {
  assert.deepEqual(takeAndFeet(SERVICE, CARD, { ...START, take: 7 }), { take: 7 });
  const all = { ...START, take: 7, variety: 0, detail: true, stands: false } as const;
  const said = { take: 7, variety: 0, detail: true };
  assert.deepEqual(takeFields(SERVICE, CARD, all), said);
  assert.deepEqual(takeAndFeet(SERVICE, CARD, all), { ...said, feet: "as_predicted" });
  assert.deepEqual(takeFields(SERVICE, CARD, { ...START, detail: true }), { detail: true });
});

test("a floor is asked for where feet stand", () => {
  const raised = { ...START, floor: 0.2 };
  assert.deepEqual(takeAndFeet(SERVICE, CARD, raised), { floor: 0.2 });
  assert.deepEqual(takeAndFeet(SERVICE, CARD, { ...raised, stands: false }), {
    feet: "as_predicted",
  });
  assert.deepEqual(takeAndFeet(SERVICE, PLAIN, { ...raised, stands: false }), {});
  assert.deepEqual(takeAndFeet(COPY, CARD, raised), {});
});

test("a model without details is asked for none, and a copy of the page for nothing", () => {
  assert.deepEqual(takeFields(SERVICE, PLAIN, { ...START, detail: true }), {});
  const all = { ...START, take: 7, detail: true, stands: false } as const;
  assert.deepEqual(takeAndFeet(COPY, CARD, all), {});
});

test("seeds go on, around the last, and a fan leaves out the one that is shown", () => {
  assert.deepEqual([0, 1, LARGEST_SEED].map(nextSeed), [1, 2, 1]);
  assert.deepEqual(otherTakes(0, 5), [1, 2, 3, 4, 5]);
  assert.deepEqual(otherTakes(3, 5), [1, 2, 4, 5, 6]);
  assert.deepEqual(otherTakes(70, 2), [1, 2]);
});

const STANCE = { joint: "Foot", begin: 0, end: 0.5, position: [0, 0, 0] };
const DONE = {
  stances: [STANCE, STANCE],
  swings: 1,
  skate_before: 0.1191,
  skate: 0.0012,
  drift: 0.0001,
  lowered: 0.0213,
  grounded: 0.0094,
  left: [],
};

test("what was done to feet is said with its figures", () => {
  assert.equal(
    says(CARD, true, DONE),
    "Feet stand: 2 stances, 1 swing; skate 11.9 cm/s before, 0.1 cm/s now; " +
      "pelvis lowered by up to 2.1 cm; body lowered to the floor by 0.9 cm.",
  );
  const other = { ...DONE, drift: 0.004, lowered: 0, grounded: -0.02, left: ["Foot: too far"] };
  const said = says(CARD, true, other);
  for (const words of [
    "off its place by up to 0.4 cm",
    "pelvis not lowered",
    "raised to the floor",
  ])
    assert.ok(said.includes(words), said);
  assert.match(said, / Foot: too far\.$/);
});

test("why nothing was done is said", () => {
  const none = { ...DONE, stances: [], left: ["Foot: never stands."] };
  assert.match(says(CARD, true, none), /none could be placed\. Foot: never stands\.$/);
  assert.equal(says(CARD, false, undefined), "Feet as predicted.");
  assert.match(says(PLAIN, false, undefined), /names no feet/);
  const stays = { ...CARD, root: "in_place" } as const;
  assert.match(says(stays, false, undefined), /root stays in place/);
  assert.match(says(CARD, true, undefined, false), /only a service/);
  assert.match(says(CARD, true, undefined), /did not say/);
});
