/** Answers that a client keeps, asked of the real service. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { defaults, observed } from "./service.ts";

const KEPT = { cacheBytes: 1 << 20 };

test("what is kept under a name is asked for by its tag", async () => {
  const { client, sent } = observed(undefined, KEPT);
  const question = { controls: await defaults(client), times: [0] };
  const first = await client.pose("reach", question);
  assert.deepEqual(await client.pose("reach", question), first);
  const [, before, after] = sent;
  assert.deepEqual([before?.status, after?.status], [200, 304]);
  assert.match(after!.headers.get("If-None-Match")!, /^"[0-9a-f]{32}/);
});

test("what is kept under a hash is not asked for again, and cannot be spoilt", async () => {
  const { client, sent } = observed(undefined, KEPT);
  const { identity } = await client.card("reach");
  const question = { controls: await defaults(client) };
  const { content } = await client.file(identity, "bvh", question);
  const asked = sent.length;
  const whole = content.slice();
  for (let time = 0; time < 3; time++) {
    const again = await client.file(identity, "bvh", question);
    assert.deepEqual(again.content, whole);
    content.fill(0);
    again.content.fill(0);
  }
  assert.equal(sent.length, asked);
});

test("nothing is kept, if not wanted", async () => {
  const { client, sent } = observed();
  await client.card("reach");
  await client.card("reach");
  assert.deepEqual(
    sent.map(({ status, headers }) => [status, headers.has("If-None-Match")]),
    [
      [200, false],
      [200, false],
    ],
  );
});

test("no more is kept than wanted, and the longest unused goes first", async () => {
  const plain = observed();
  const question = { controls: await defaults(plain.client), times: [0] };
  const { content } = await plain.client.file("reach", "msgpack", { controls: question.controls });
  const { client, sent } = observed(undefined, { cacheBytes: Math.ceil(2.5 * content.length) });
  const ask = async (fps: number) => {
    await client.file("reach", "msgpack", { controls: question.controls, fps });
    return sent.at(-1)?.status;
  };
  // All three have about one length, of which two fit.
  assert.deepEqual([await ask(30), await ask(30.1), await ask(30)], [200, 200, 304]);
  assert.deepEqual([await ask(30.2), await ask(30), await ask(30.1)], [200, 304, 200]);
});

test("what has no link is not kept", async () => {
  const { client, sent } = observed(undefined, { ...KEPT, longestLink: 0 });
  const { identity } = await client.card("reach");
  const question = { controls: await defaults(client), times: [0] };
  await client.pose(identity, question);
  await client.pose(identity, question);
  assert.deepEqual(
    sent.slice(-2).map(({ method, status }) => [method, status]),
    [
      ["POST", 200],
      ["POST", 200],
    ],
  );
});
