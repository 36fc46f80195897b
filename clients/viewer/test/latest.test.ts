/** Of many questions only the newest matters, and never two are on their way. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { Latest } from "../src/latest.ts";

function slow() {
  const seen: number[] = [];
  let open = 0;
  let most = 0;
  const latest = new Latest<number>(async (question) => {
    most = Math.max(most, ++open);
    seen.push(question);
    await new Promise((done) => setTimeout(done, 5));
    open -= 1;
  });
  return { latest, seen, most: () => most };
}

test("what came meanwhile is dropped, and the last is answered", async () => {
  const { latest, seen, most } = slow();
  for (let question = 0; question < 100; question++) latest.ask(question);
  await new Promise((done) => setTimeout(done, 40));
  assert.deepEqual(seen, [0, 99]);
  assert.equal(most(), 1);
});

test("a question after all are answered is answered too", async () => {
  const { latest, seen } = slow();
  latest.ask(1);
  await new Promise((done) => setTimeout(done, 20));
  latest.ask(2);
  await new Promise((done) => setTimeout(done, 20));
  assert.deepEqual(seen, [1, 2]);
});
