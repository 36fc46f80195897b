/** The address: whatever the state, it comes back; whatever the text, the rest holds. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { address, initial, restored, written } from "../src/hash.ts";
import { LONGEST_SCRIPT } from "../src/performance/script.ts";
import type { State } from "../src/state.ts";
import { CARD as PLAIN } from "./card.ts";

/** With feet that may stand, and details to sample. */
const CARD = {
  ...PLAIN,
  feet: [2],
  diagnostics: { detail: { directions: 3 } },
} as unknown as typeof PLAIN;
const START = initial("hop", CARD);
const OTHER: State = {
  model: "hop@0123",
  controls: { speed: 1.25 },
  inferred: { ...START.inferred, time: -3.5 },
  performer: "bob & co",
  labels: { style: "in a hurry", mood: "sad" },
  level: 2,
  time: 0.625,
  playing: false,
  speed: 0.5,
  loop: false,
  root: "in_place",
  body: "stick",
  ghost: true,
  fan: true,
  varied: true,
  feet: true,
  stands: true,
  floor: 0.25,
  take: 7,
  variety: 0.35,
  detail: true,
  target: [0.25, 1.5, -0.125],
  view: "crowd",
  across: "time",
  along: "speed",
  crowd: 500,
  pixels: 2,
  script: '{"segments":[{"kind":"hold","seconds":1}]}',
};

function back(state: State) {
  return restored(address(written(state, CARD)), state.model, CARD);
}

test("every part of the state comes back", () => {
  assert.deepEqual(back(OTHER), { state: OTHER, faults: [] });
  for (const key of Object.keys(OTHER) as (keyof State)[]) {
    const one = { ...START, [key]: OTHER[key] };
    assert.deepEqual(back(one).state, one, key);
    assert.notDeepEqual(back(one).state, START, key);
  }
});

test("what is as at the start is not written, and the text is stable", () => {
  assert.equal(written(START, CARD), "#hop?speed=~1&time=~0");
  const text = written({ ...OTHER, controls: { speed: 1 / 3, time: 1e-7 } }, CARD);
  const again = restored(address(text), OTHER.model, CARD).state;
  assert.equal(written(again, CARD), text);
});

test("a map begins with controls of many values", () => {
  const controls = CARD.controls.map((each, i) => ({ ...each, values: i ? [] : [1, 2] }));
  const { across, along } = initial("hop", { ...CARD, controls });
  assert.deepEqual([across, along], ["time", "speed"]);
  assert.equal(initial("hop", CARD).across, "speed");
});

test("a control may be called as a part of the state is", () => {
  const { state } = restored(address("#hop?time=5&~time=0.5"), "hop", CARD);
  assert.deepEqual([state.controls["time"], state.time], [5, 0.5]);
});

const WRONG: readonly (readonly [string, RegExp])[] = [
  ["speed=1,5", /write 1\.5/],
  ["speed=", /a number is expected/],
  ["speed=NaN", /is not a number/],
  ["speed=1e999", /too large/],
  ["height=2", /no such control/],
  ["~level=4", /expected 0 to 3/],
  ["~level=0.5", /expected 0 to 3/],
  ["~view=both", /one or levels or crowd/],
  ["~performer=eve", /ann, bob/],
  ["~labels=style:slow", /style:calm or in a hurry, mood:glad or sad/],
  ["~labels=calm", /style:calm or/],
  ["~across=height", /speed, time/],
  ["~ghost=1", /yes or no/],
  ["~take=1.5", /expected 0 to 999999999/],
  ["~take=-1", /expected 0 to 999999999/],
  ["~variety=1.1", /expected 0 to 1/],
  ["~stands=1", /yes or no/],
  ["~model=x", /unknown/],
  ["~__proto__=x", /unknown/],
  ["__proto__=1", /no such control/],
  ["%", /no such control/],
  ["%E0%A4=1", /no such control/],
];

for (const [entry, words] of WRONG)
  test(`${entry} is named, and the rest holds`, () => {
    const { state, faults } = restored(address(`#hop?${entry}&~feet=yes`), "hop", CARD);
    assert.equal(faults.length, 1);
    assert.match(faults[0]!, words);
    assert.deepEqual(state, { ...START, feet: true });
  });

test("what a model cannot do is refused with the reason, and feet stand where contacts are known", () => {
  for (const [entry, words] of [
    ["~stands=yes", /no: this model names no feet/],
    ["~detail=yes", /no: this model has no details/],
  ] as const) {
    const { state, faults } = restored(address(`#hop?${entry}`), "hop", PLAIN);
    assert.match(faults.join(), words);
    assert.deepEqual(state, initial("hop", PLAIN));
  }
  const contacts = [{ joint: 2 }] as unknown as NonNullable<typeof CARD.contacts>;
  assert.equal(initial("hop", CARD).stands, false);
  assert.equal(initial("hop", { ...CARD, contacts }).stands, true);
  assert.equal(initial("hop", { ...CARD, contacts, root: "in_place" }).stands, false);
});

test("a hash without anything names no model", () => {
  for (const text of ["", "#", "#?"]) assert.equal(address(text).model, null);
});

test("a script that is too long for a link stays out of it, one that is none is named", () => {
  const hold = (joint: string) => `{"segments":[{"kind":"hold","seconds":1,"joint":"${joint}"}]}`;
  const room = LONGEST_SCRIPT - hold("").length;
  const longest = { ...START, script: hold("x".repeat(room)) };
  assert.equal(back(longest).state.script, longest.script);
  assert.equal(back({ ...START, script: hold("x".repeat(room + 1)) }).state.script, "");
  const { faults, state } = restored(address("#hop?~script=%7B"), "hop", CARD);
  assert.match(faults[0]!, /^~script: .*expected the script of a performance/);
  assert.equal(state.script, "");
});
