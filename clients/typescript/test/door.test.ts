/** What is asked for and cannot be: nothing of it is sent. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { Client, PosefieldError, WrongQuestion } from "../src/index.ts";
import { observed, serving } from "./service.ts";

const HAND = { joint: "RightHand", position: [0, 1, 0] };

type Ask = (client: Client, number: number) => unknown;

const ASKED: Record<string, Ask> = {
  "a link's control": (client, turn) => client.clip("reach", { controls: { turn } }),
  "a link's time": (client, time) => client.pose("reach", { controls: {}, times: [0, time] }),
  "a link's setting": (client, fps) => client.file("reach", "bvh", { controls: {}, fps }),
  "a target's place": (client, x) =>
    client.clip("reach", { controls: {}, targets: [{ ...HAND, position: [0, x, 0], at: "end" }] }),
  "a target's time": (client, time) =>
    client.clip("reach", { controls: {}, targets: [{ ...HAND, time }] }),
  "a camera": (client, x) => client.crowdFile("walk", "usda", { camera: [x, 0, 0] }),
  "a body's time": (client, time) => client.crowd("reach", { controls: {}, time: [0, time] }),
  "a clip of many": (client, turn) => client.archive("reach", "bvh", [{ controls: { turn } }]),
  "a link to be sent on": async (client, turn) =>
    client.url("reach", "glb", { controls: { turn } }),
};

for (const [what, ask] of Object.entries(ASKED)) {
  test(`${what} is a number, or nothing is sent`, async () => {
    for (const number of [Number.NaN, Infinity, -Infinity]) {
      const { client, sent } = observed(undefined, { retries: 0 });
      await assert.rejects(
        async () => ask(client, number),
        (fault: unknown) => {
          assert.ok(fault instanceof WrongQuestion && fault instanceof PosefieldError);
          assert.match(fault.message, new RegExp(`found ${number}, expected a finite number`));
          return true;
        },
      );
      assert.equal(sent.length, 0);
    }
  });
}

test("a key that no header can hold is refused without being said", () => {
  for (const key of ["top\nsecret", "top secret", "top\u00a0secret", "topsecret\u00e9"]) {
    assert.throws(
      () => new Client("", { key }),
      (fault: unknown) => {
        assert.ok(fault instanceof WrongQuestion);
        assert.doesNotMatch(`${fault.stack} ${fault.cause}`, /top|secret/);
        return true;
      },
    );
  }
});

test("an address that is none is refused", async () => {
  for (const base of [
    "nonsense",
    "localhost:8000",
    "ftp://a",
    "http://",
    "http://u:p@a",
    "http://a?b",
  ])
    assert.throws(() => new Client(base), WrongQuestion, base);
  await serving(
    (_, answer) => answer.end('{"models":[]}'),
    async (base, asked) => {
      for (const own of [base, `${base}/`, `${base}/under/`]) await new Client(own).models();
      assert.deepEqual(asked, ["/v1/models", "/v1/models", "/under/v1/models"]);
    },
  );
  assert.equal(new Client().base, "");
});
