/** Looking goes on, whatever those do who are told. */

import assert from "node:assert/strict";
import { mock, test } from "node:test";

import { Watch } from "../src/service.ts";

test("one look that fails is not the last", async () => {
  const faults: unknown[] = [];
  const browser = { document: { hidden: false }, reportError: (it: unknown) => faults.push(it) };
  Object.assign(globalThis, browser);
  mock.timers.enable({ apis: ["setTimeout"] });
  let looks = 0;
  const watch = new Watch(
    async () => {
      looks += 1;
      if (looks === 1) throw new Error("a listener's fault");
    },
    async () => {},
  );
  mock.timers.tick(5000);
  await new Promise((done) => setImmediate(done));
  assert.match(faults.join(), /a listener's fault/);
  mock.timers.tick(5000);
  assert.equal(looks, 2);
  await new Promise((done) => setImmediate(done));
  watch.end();
  mock.timers.tick(60000);
  assert.equal(looks, 2, "and none after the end");
  mock.timers.reset();
});
