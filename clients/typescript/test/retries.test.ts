/** How long is waited before asking again. */

import assert from "node:assert/strict";
import { type TestContext, test } from "node:test";

import { Unreachable } from "../src/index.ts";
import { retried } from "../src/retries.ts";

/** Waits, ms, between attempts that all fail; nobody waits for them here. */
async function waits(
  context: TestContext,
  plan: { readonly retries: number; readonly pause: number },
  retryAfter: number | null = null,
): Promise<number[]> {
  const found: number[] = [];
  const timer = context.mock.method(globalThis, "setTimeout", (run: () => void, wait: number) => {
    found.push(wait);
    queueMicrotask(run);
  });
  const ask = () => Promise.reject(new Unreachable("gone", { retryAfter }));
  await assert.rejects(retried(ask, plan, undefined), Unreachable);
  timer.mock.restore();
  return found;
}

test("a pause doubles, and stays at half a minute", async (context) => {
  context.mock.method(Math, "random", () => 1);
  assert.deepEqual(
    await waits(context, { retries: 6, pause: 2000 }),
    [2000, 4000, 8000, 16_000, 30_000, 30_000],
  );
});

test("half of a pause is chance, what the service says is none", async (context) => {
  const random = context.mock.method(Math, "random", () => 0);
  assert.deepEqual(await waits(context, { retries: 2, pause: 200 }), [100, 200]);
  assert.deepEqual(await waits(context, { retries: 2, pause: 200 }, 2), [2100, 2200]);
  random.mock.mockImplementation(() => 1);
  assert.deepEqual(await waits(context, { retries: 2, pause: 200 }, 2), [2200, 2400]);
});

test("who is to wait for longer than half a minute gives up", async (context) => {
  assert.equal((await waits(context, { retries: 2, pause: 200 }, 30)).length, 2);
  assert.deepEqual(await waits(context, { retries: 2, pause: 200 }, 30.1), []);
});
