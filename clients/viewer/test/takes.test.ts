/** Takes and feet: the questions to a service, and the words about its answer. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { initial } from "../src/hash.ts";
import {
  LARGEST_SEED,
  nextSeed,
  otherTakes,
  takeAndFeet,
  takeFields,
  targetFields,
} from "../src/questions.ts";
import { feetSentence as says } from "../src/trust.ts";
import { CARD as PLAIN } from "./card.ts";

const CARD = {
  ...PLAIN,
  feet: [2],
  contacts: [{ joint: 2 }],
  diagnostics: { detail: { directions: 3 } },
} as unknown as typeof PLAIN;
const START = initial("hop", CARD);

test("the prediction asks for nothing new, so that its answer is that of before", () => {
  assert.deepEqual(takeAndFeet(CARD, START), {});
  assert.deepEqual(takeAndFeet(CARD, { ...START, variety: 0.2 }), {});
});

test("a take asks for its seed, and for what is not usual", () => {
  assert.deepEqual(takeAndFeet(CARD, { ...START, take: 7 }), { take: 7 });
  const all = { ...START, take: 7, variety: 0, detail: true, stands: false } as const;
  const said = { take: 7, variety: 0, detail: true };
  assert.deepEqual(takeFields(CARD, all), said);
  assert.deepEqual(takeAndFeet(CARD, all), { ...said, feet: "as_predicted" });
  assert.deepEqual(takeFields(CARD, { ...START, detail: true }), { detail: true });
});

test("a floor is asked for where feet stand", () => {
  const raised = { ...START, floor: 0.2 };
  assert.deepEqual(takeAndFeet(CARD, raised), { floor: 0.2 });
  assert.deepEqual(takeAndFeet(CARD, { ...raised, stands: false }), {
    feet: "as_predicted",
  });
  assert.deepEqual(takeAndFeet(PLAIN, { ...raised, stands: false }), {});
});

test("a model without details is asked for none", () => {
  assert.deepEqual(takeFields(PLAIN, { ...START, detail: true }), {});
});

test("a target is that of the event's joint", () => {
  const target = [0.1, 1.23456, 0] as const;
  const card = { ...PLAIN, event: { joint: 3, share: 1 } } as unknown as typeof PLAIN;
  assert.deepEqual(targetFields(card, { target }), {
    targets: [{ joint: "Arm", at: "event", position: [0.1, 1.2346, 0] }],
  });
  assert.deepEqual(targetFields(card, { target: null }), {});
  assert.deepEqual(targetFields(PLAIN, { target }), {});
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
  assert.match(says(CARD, true, undefined), /did not say/);
});
