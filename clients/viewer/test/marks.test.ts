/** Marks of what was captured: of two things, each said only where the service says it. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { marks } from "../src/trust.ts";

const words = (trust: Parameters<typeof marks>[0]) => marks(trust).map((mark) => mark.words);

test("what was captured and what was not are told apart", () => {
  const near = { performer: null, supported: true };
  assert.deepEqual(words(near), ["Captured near here"]);
  assert.deepEqual(words({ ...near, supported: false }), ["Nothing like it was captured"]);
  assert.deepEqual(
    marks({ ...near, supported: false }).map(({ yes }) => yes),
    [false],
  );
});

test("who moves has a mark of its own where performers are told apart", () => {
  const known = { supported: true, performer: "kim", performer_seen: true };
  assert.deepEqual(words(known), ["Captured near here", "kim was captured"]);
  const nobody = { supported: true, performer: null, performer_seen: false };
  assert.deepEqual(words(nobody)[1], "Moves as an unseen performer");
});

test("there is no mark of a fact that the service does not state", () => {
  assert.deepEqual(marks({ performer: "kim" }), []);
});
